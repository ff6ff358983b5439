"""How a motion ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import nan

from heptarm.values.arrays import Value
from heptarm.values.condition import Condition
from heptarm.values.state import State


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
        state: the robot at its end; None if nothing is known of it.
        residual: largest joint distance between measured and commanded position [rad]; NaN if it never moved.
        duration: from its start to its end, on the cabinet's clock [s].
        stopped_by: the part of the break condition that fired: of those combined by | the one that held; None if none
            did.
        fired_at: the robot when it fired, before it braked.
        item: index of the motion of the program that ran last.
        code: number in the protocol's table of codes; 0: none.
        text: what the cabinet says.
    """

    cause: Cause
    state: State | None = None
    residual: float = nan
    duration: float = 0.0
    stopped_by: Condition | None = None
    fired_at: State | None = None
    item: int = 0
    code: int = 0
    text: str = ""

    @property
    def arrived(self) -> bool:
        """Whether the motion reached its target."""
        return self.cause is Cause.FINISHED
