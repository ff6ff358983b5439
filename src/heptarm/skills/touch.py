"""Touching: lines that end at a contact, once or twice, and taps on the arm."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from heptarm.arm.verbs import ArmVerbs
from heptarm.errors import HeptarmError, LimitError, MotionAborted, NoContact, Timeout
from heptarm.skills.taps import TapWatch
from heptarm.values.checks import Array, integer, optional, within, word
from heptarm.values.checks import callback as check_callback
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.contact import Contact, direction_of
from heptarm.values.condition.force import force as force_signal
from heptarm.values.condition.reaction import Reaction, check_reaction
from heptarm.values.frames import TOOL, check_name
from heptarm.values.mode.mode import Mode, check_mode
from heptarm.values.motion.line import lin_rel
from heptarm.values.result import Cause, Result
from heptarm.values.state import State

#: States averaged for the baseline, and the longest time that they may take to arrive [s].
_SAMPLES = 8
_PATIENCE = 5.0
#: Highest speed of an approach or a retreat [m/s].
_FASTEST = 10.0


def touch(
    arm: ArmVerbs,
    direction: str | npt.ArrayLike = "z",
    *,
    distance: float,
    force: float,
    frame: str = TOOL,
    speed_mps: float = 0.02,
    retreat: float | None = None,
    retreat_mps: float = 0.1,
    baseline: Literal["rest", "zero"] = "rest",
    mode: Mode | None = None,
    then: Reaction = "relax",
    timeout: float | None = None,
) -> Contact:
    """Move on a straight line until a contact.

    The cabinet monitors the force: a contact is a deviation from the baseline by more than the threshold along an axis
    of the frame. The slower the arm, the shorter its stopping distance behind the contact. Then the arm relaxes, so
    that it does not go on pushing by that distance; `Contact.result` has the largest force and the one at rest.

    Args:
        arm: in control.
        direction: an axis of the frame such as "z" or "-x", or a vector in its axes, shape (3,).
        distance: largest distance [m].
        force: threshold [N].
        frame: whose axes: "tool" (the motion frame's own), "base", or the name of a frame.
        speed_mps: speed of the approach [m/s].
        retreat: move back afterwards, to this distance before the contact [m]; None: stay in contact.
        retreat_mps: speed of the retreat [m/s].
        baseline: "rest": the force before the motion, such as that of a load not quite known; "zero": no force.
        mode: control mode; None: that of `using`, otherwise position. An impedance mode limits the contact force.
        then: what the arm does at the contact; see `move`.
        timeout: see `move`.

    Returns:
        Where the contact was, and its force.

    Raises:
        NoContact: no contact within the distance, or the motion ended otherwise.
        LimitError: a value outside its range.
    """
    check_name(frame, "frame")
    check_mode(mode)
    check_reaction(then)
    word(baseline, "baseline", ("rest", "zero"))
    within(speed_mps, "speed_mps", 0.0, _FASTEST, above=True, unit="m/s")
    within(retreat_mps, "retreat_mps", 0.0, _FASTEST, above=True, unit="m/s")
    optional(timeout, "timeout", 0.0, 1e9, unit="s")
    optional(retreat, "retreat", 0.0, 2.0, unit="m")
    approach = _Approach(
        arm,
        direction_of(direction),
        distance=within(distance, "distance", 0.0, 2.0, above=True, unit="m"),
        force=within(force, "force", 0.0, TapWatch.STRONGEST, above=True, unit="N"),
        frame=frame,
    )
    contact = approach.run(speed_mps, from_rest=baseline == "rest", mode=mode, then=then, timeout=timeout)
    if retreat is not None:
        approach.retreat(contact, retreat, retreat_mps)
    return contact


def touch_twice(
    arm: ArmVerbs,
    direction: str | npt.ArrayLike = "z",
    *,
    distance: float,
    force: float,
    frame: str = TOOL,
    fast_mps: float = 0.05,
    slow_mps: float = 0.005,
    back: float = 0.01,
    retreat: float | None = None,
    baseline: Literal["rest", "zero"] = "rest",
    mode: Mode | None = None,
    timeout: float | None = None,
) -> Contact:
    """Touch fast, back off, and touch again slowly: the second contact is the precise one.

    Args:
        arm: in control.
        direction: see `touch`.
        distance: see `touch`.
        force: see `touch`; of both contacts.
        frame: see `touch`.
        fast_mps: speed of the first approach [m/s].
        slow_mps: speed of the second approach [m/s].
        back: how far the arm backs off from the first contact [m]; the second must come within twice that.
        retreat: see `touch`; after the second contact.
        baseline: see `touch`.
        mode: see `touch`.
        timeout: see `move`; of each motion.

    Returns:
        The second contact; `first` is the other one, `spread` their distance.

    Raises:
        NoContact: one of the contacts was missing.
        LimitError: a value outside its range, or a second approach faster than the first.
    """
    off = within(back, "back", 0.0, 0.5, above=True, unit="m")
    within(fast_mps, "fast_mps", 0.0, _FASTEST, above=True, unit="m/s")
    optional(retreat, "retreat", 0.0, 2.0, unit="m")
    if within(slow_mps, "slow_mps", 0.0, _FASTEST, above=True, unit="m/s") > fast_mps:
        raise LimitError(
            f"slow_mps must be slower than fast_mps of {fast_mps:g} m/s, got {slow_mps:g} m/s",
            code=2,
            parameter="slow_mps",
            value=slow_mps,
            allowed=f"(0, {fast_mps:g}] m/s",
            hint="lower slow_mps or raise fast_mps",
        )
    first = touch(
        arm,
        direction,
        distance=distance,
        force=force,
        frame=frame,
        speed_mps=fast_mps,
        retreat=off,
        baseline=baseline,
        mode=mode,
        timeout=timeout,
    )
    second = touch(
        arm,
        direction,
        distance=2.0 * off,
        force=force,
        frame=frame,
        speed_mps=slow_mps,
        retreat=retreat,
        baseline=baseline,
        mode=mode,
        timeout=timeout,
    )
    return replace(second, first=first)


def wait_for_taps(
    arm: ArmVerbs, count: int = 2, *, force: float = 8.0, gap: float = 1.0, timeout: float = 60.0
) -> State:
    """Wait until somebody taps the resting arm; checked by this program, not by the cabinet.

    Args:
        arm: connected.
        count: number of taps.
        force: smallest force of a tap [N]; a constant force is no tap.
        gap: longest time between two taps [s].
        timeout: longest wait [s].

    Returns:
        The state after the last tap.

    Raises:
        Timeout: it was not tapped in time.
    """
    integer(count, "count", 1, 1000)
    taps = TapWatch(force=force, gap=gap)
    for state in arm.states(duration=within(timeout, "timeout", 0.0, 1e6, unit="s")):
        if taps.see(state.wrench.stamp * 1e-9, state.wrench.force) >= count:
            return state
    raise Timeout(
        f"the arm was not tapped {count} times within {timeout:g} s",
        hint="give a longer timeout, a lower force or a longer gap",
    )


def on_taps(
    arm: ArmVerbs,
    callback: Callable[[State], object],
    count: int = 2,
    *,
    force: float = 8.0,
    gap: float = 1.0,
) -> Callable[[], None]:
    """Call a function each time somebody taps the resting arm; checked by this program, not by the cabinet.

    While a motion runs nothing counts as a tap: its forces look like taps.

    Args:
        arm: connected.
        callback: called with the state after the last tap, from a thread of its own; it may move the arm. An exception
            in it ends the watch.
        count: number of taps.
        force: smallest force of a tap [N]; a constant force is no tap.
        gap: longest time between two taps [s].

    Returns:
        A function that ends it; closing the arm ends it as well.

    Raises:
        ShapeError: not a function, or not a number.
        LimitError: a value outside its range.
        StaleState: the pushed states lack the wrench, or are too old.
    """
    check_callback(callback, "callback")
    integer(count, "count", 1, 1000)
    watch = TapWatch(force=force, gap=gap)
    ended = threading.Event()
    arm.state.wrench  # noqa: B018  (raises now, not in the thread, if states lack it)

    def run() -> None:
        taps, moved = watch, False
        with contextlib.suppress(HeptarmError):  # the connection has ended, and with it the states
            for state in arm.states():
                if ended.is_set():
                    return
                moves = state.motion is not None and state.motion.active
                if moved and not moves:
                    taps = TapWatch(force=force, gap=gap)
                moved = moves
                if not moves and taps.see(state.wrench.stamp * 1e-9, state.wrench.force) >= count:
                    callback(state)
                    taps = TapWatch(force=force, gap=gap)

    threading.Thread(target=run, name="heptarm-taps", daemon=True).start()
    return ended.set


@dataclass(frozen=True, slots=True)
class _Approach:
    """A straight line towards a contact.

    Attributes:
        arm: in control.
        direction: unit vector in the axes of the frame, shape (3,).
        distance: largest distance [m].
        force: threshold [N].
        frame: name of the frame.
    """

    arm: ArmVerbs
    direction: Array
    distance: float
    force: float
    frame: str

    def run(
        self, speed: float, *, from_rest: bool, mode: Mode | None, then: Reaction, timeout: float | None
    ) -> Contact:
        """Move until the contact; `from_rest`: relative to the force at rest."""
        start = self.arm.wait_for_rest()
        bias = self._mean_force() if from_rest else np.zeros(3)
        step = lin_rel(*(self.distance * self.direction).tolist(), frame=self.frame, speed_mps=speed)
        result = self.arm.move(
            step, mode=mode, until=_deviates(bias, self.force, self.frame), then=then, timeout=timeout
        )
        return self._contact(result, start, bias)

    def retreat(self, contact: Contact, distance: float, speed: float) -> None:
        """Move back to a distance [m] before the contact."""
        state = self.arm.wait_for_rest()
        axes = self.arm.pose(self.frame, state=state).rotation
        beyond = float((state.pose.xyz - contact.pose.xyz) @ (axes @ self.direction))
        back = -(beyond + distance) * self.direction
        if float(np.linalg.norm(back)) > 1e-6:
            result = self.arm.move(lin_rel(*back.tolist(), frame=self.frame, speed_mps=speed))
            if not result.arrived:
                raise MotionAborted(f"the retreat ended early: {result.cause.value}", result=result)

    def _mean_force(self) -> Array:
        """Mean force on the resting arm in the axes of the frame, shape (3,) [N]."""
        found = []
        for state in self.arm.states(duration=_PATIENCE):
            found.append(self.arm.wrench(axes=self.frame, state=state).force)
            if len(found) == _SAMPLES:
                break
        if not found:
            raise Timeout(f"no state received within {_PATIENCE:g} s", hint="arm.subscribe(rate=100)")
        mean: Array = np.mean(found, axis=0)
        return mean

    def _contact(self, result: Result, start: State, bias: Array) -> Contact:
        state = result.fired_at
        if result.cause is not Cause.CONDITION or state is None:
            what = (
                "nothing was touched" if result.arrived else f"the motion ended early ({result.cause.value})"
            )
            raise NoContact(
                f"{what} within {self.distance * 1e3:.0f} mm",
                result=result,
                history=self.arm.history(),
                hint="give a longer distance or a lower force, and check that the object is there",
            )
        axes = self.arm.pose(self.frame, state=state).rotation
        return Contact(
            state.pose,
            np.asarray(state.wrench.force - axes @ bias),
            start.pose.distance_to(state.pose),
            state.q,
            result,
        )


def _deviates(bias: Array, threshold: float, frame: str) -> Condition:
    """Condition: the force along one of the axes differs from the bias by more than the threshold."""
    seen = force_signal(frame=frame)
    x, y, z = (
        seen.along(axis).outside(b - threshold, b + threshold)
        for axis, b in zip("xyz", bias.tolist(), strict=True)
    )
    return x | y | z
