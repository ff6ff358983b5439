"""Outcomes: how a motion ended, its events, and how a recovery ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import isnan, nan

from heptarm.values.checks import Value
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.trigger import Notify, Trigger
from heptarm.values.state import State
from heptarm.values.text import degrees, fixed, lines


class Cause(Enum):
    """Why a motion ended."""

    FINISHED = "finished"  # arrived
    CANCELLED = "cancelled"  # cancelled by its client
    CONDITION = "condition"  # a break condition fired
    REPLACED = "replaced"  # another program took its place
    STOPPED = "stopped"  # a stop was commanded
    LOST = "lost"  # its controller was lost
    FAILED = "failed"  # the controller could not plan or execute it
    SAFETY = "safety"  # a safety function ended it
    DROPPED = "dropped"  # queued behind a motion that failed
    STARVED = "starved"  # no servo target arrived within the watchdog time


@dataclass(frozen=True, slots=True, eq=False)
class Result(Value):
    """How a motion or a program of motions ended.

    Attributes:
        cause: why it ended.
        state: the robot at its end; None if no state was received.
        residual: largest joint distance between measured and commanded position [rad]; NaN if it did not move.
        duration: from its start to its end, on the cabinet's clock [s].
        stopped_by: the part of the break condition that fired: of parts combined by | the one that held; None if none
            fired.
        fired_at: the robot when it fired, before it braked.
        peak_force: largest external force at the motion frame since it fired, while the arm braked and reacted [N]; NaN
            if no condition ended a motion of `move` or `start`. On a cabinet it is read every few milliseconds.
        rest_force: external force at the end, after the reaction [N]; NaN likewise.
        item: index of the motion of the program that ran last.
        code: number in the protocol's table of codes; 0: none.
        text: explanation by the cabinet.
    """

    cause: Cause
    state: State | None = None
    residual: float = nan
    duration: float = 0.0
    stopped_by: Condition | None = None
    fired_at: State | None = None
    peak_force: float = nan
    rest_force: float = nan
    item: int = 0
    code: int = 0
    text: str = ""

    def __str__(self) -> str:
        """A few lines: why it ended, how long it took, where the arm is."""
        fired = "" if self.stopped_by is None else str(self.stopped_by)
        cause = (
            self.cause.value
            + (f": {self.text}" if self.text else "")
            + (f" (code {self.code})" if self.code else "")
        )
        rows = {
            "cause": cause,
            "stopped by": fired,
            "duration": f"{self.duration:.3f} s",
            "force": "" if isnan(self.peak_force) else self._forces,
            "residual": "" if isnan(self.residual) else degrees(self.residual, 4),
        }
        if self.state is not None and self.state.joints is not None:
            rows["joints"] = degrees(self.state.q)
        if self.state is not None and self.state.groups.pose is not None:
            rows["pose"] = str(self.state.pose)
        return lines("Result", rows)

    @property
    def _forces(self) -> str:
        return f"peak {fixed(self.peak_force, 2)} N, at rest {fixed(self.rest_force, 2)} N"

    @property
    def arrived(self) -> bool:
        """Whether the motion reached its target."""
        return self.cause is Cause.FINISHED


@dataclass(frozen=True, slots=True, eq=False)
class MotionEvent(Value):
    """An event of a program.

    Attributes:
        kind: "begun" or "ended": a motion of the program; "segment": one of a spline has begun; "trigger": one has
            fired and its action is done.
        item: index of the motion in the program.
        segment: index of the segment; -1 for other kinds.
        trigger: the trigger; None for other kinds.
        time: since the program's start, on the cabinet's clock [s]; NaN for other kinds than triggers.
        state: the joints when the cabinet's application received that the trigger fired; None for other kinds, and if
            the robot did not report them.
        code: why an output was not written, a number in the protocol's table of codes; 0: it was written.
        text: the same in words.
    """

    kind: str
    item: int
    segment: int = -1
    trigger: Trigger | None = None
    time: float = nan
    state: State | None = None
    code: int = 0
    text: str = ""

    def __str__(self) -> str:
        """One line."""
        where = f"motion {self.item}" + (f", segment {self.segment}" if self.segment >= 0 else "")
        what = "" if self.trigger is None else f": {self.trigger}"
        when = "" if isnan(self.time) else f" after {self.time:.3f} s"
        failed = f", not done: {self.text} (code {self.code})" if self.code else ""
        return f"{self.kind}, {where}{what}{when}{failed}"

    @property
    def label(self) -> str:
        """Label of a trigger that notifies; otherwise empty."""
        action = None if self.trigger is None else self.trigger.action
        return action.label if isinstance(action, Notify) else ""


@dataclass(frozen=True, slots=True, eq=False)
class Recovery(Value):
    """What the software did to recover, and what is left to the operator.

    Attributes:
        done: the robot is ready to move.
        did: steps that were done, in order; empty: nothing had to be done, or nothing could be.
        remaining: steps for the operator, in order; empty if done.
    """

    done: bool
    did: tuple[str, ...] = ()
    remaining: tuple[str, ...] = ()

    def __str__(self) -> str:
        """One line of text."""
        if self.done:
            return f"ready: {', '.join(self.did) or 'nothing had to be done'}"
        return f"not ready: {'; '.join(self.remaining)}"
