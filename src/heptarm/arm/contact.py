"""Touching: lines that end at a contact, once or twice, and taps on the arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from heptarm.arm.connection import Connection
from heptarm.arm.feed import States
from heptarm.arm.tooling import Tooling
from heptarm.errors import LimitError, MotionAborted, NoContact, ShapeError, Timeout
from heptarm.values.arrays import Array, within
from heptarm.values.condition import Condition
from heptarm.values.contact import Contact, TapWatch, direction_of
from heptarm.values.mode import Mode
from heptarm.values.motion import TOOL, lin_rel
from heptarm.values.result import Cause, Result
from heptarm.values.signals import force as force_signal
from heptarm.values.state import State

#: States whose mean is what acts on the arm before it touches anything, and how long they may take to come [s].
_SAMPLES = 8
_PATIENCE = 5.0


class Touching:
    """The part of an arm that feels for things."""

    _connection: Connection
    _tooling: Tooling
    move: Callable[..., Result]
    states: Callable[..., States]
    wait_for_rest: Callable[..., State]

    def touch(
        self,
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
        timeout: float | None = None,
    ) -> Contact:
        """Move straight on until something is touched.

        The cabinet watches the force: along each axis of the frame it may differ from the baseline by the
        threshold. The slower the arm, the shorter the way it needs to stop behind the contact.

        Args:
            direction: whither: an axis of the frame such as "z" or "-x", or a vector in its axes, shape (3,).
            distance: how far at most [m].
            force: threshold [N].
            frame: whose axes: "tool" (the moved frame's own), "base", or a frame's name.
            speed_mps: [m/s].
            retreat: move back afterwards to so far before the contact [m]; None: stay in touch.
            retreat_mps: speed of that [m/s].
            baseline: "rest": what acts on the arm before it moves is no contact, such as a load that is not quite
                known; "zero": everything is.
            mode: control mode; None: that of `using`, otherwise position. An impedance mode touches more softly.
            timeout: see `move`.

        Returns:
            Where and how hard.

        Raises:
            NoContact: nothing was met, or something else ended the motion.
            LimitError: a value outside its range.
        """
        ahead = direction_of(direction)
        way = within(distance, "distance", 0.0, 2.0, above=True, unit="m")
        threshold = within(force, "force", 0.0, TapWatch.STRONGEST, above=True, unit="N")
        if retreat is not None:
            within(retreat, "retreat", 0.0, 2.0, unit="m")
        if baseline not in ("rest", "zero"):
            raise ShapeError(f"baseline is {baseline!r}; allowed are 'rest', 'zero'", parameter="baseline")
        start = self.wait_for_rest()
        bias = self._mean_force(frame) if baseline == "rest" else np.zeros(3)
        step = lin_rel(*(way * ahead).tolist(), frame=frame, speed_mps=speed_mps)
        result = self.move(step, mode=mode, until=_leaves(bias, threshold, frame), timeout=timeout)
        contact = self._contact(result, start, frame, bias, f"within {way * 1e3:.0f} mm")
        if retreat is not None:
            self._retreat(contact, ahead, frame, retreat, retreat_mps)
        return contact

    def touch_twice(
        self,
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
            direction: see `touch`.
            distance: see `touch`.
            force: see `touch`; of both contacts.
            frame: see `touch`.
            fast_mps: speed of the first approach [m/s].
            slow_mps: speed of the second one [m/s].
            back: how far it backs off from the first contact [m]; the second has to come within twice that.
            retreat: see `touch`; after the second contact.
            baseline: see `touch`.
            mode: see `touch`.
            timeout: see `move`; of each motion.

        Returns:
            The second contact; `first` is the other one, `spread` their distance.

        Raises:
            NoContact: one of them did not come.
            LimitError: a value outside its range, or a second approach that is faster than the first.
        """
        off = within(back, "back", 0.0, 0.5, above=True, unit="m")
        if within(slow_mps, "slow_mps", 0.0, 10.0, above=True, unit="m/s") > fast_mps:
            raise LimitError(
                f"slow_mps is {slow_mps:g}, fast_mps is {fast_mps:g} m/s; the second approach has to be the slower one",
                code=2,
                parameter="slow_mps",
                value=slow_mps,
                allowed=f"(0, {fast_mps:g}] m/s",
            )
        ways = {"force": force, "frame": frame, "baseline": baseline, "mode": mode, "timeout": timeout}
        first = self.touch(direction, distance=distance, speed_mps=fast_mps, retreat=off, **ways)  # type: ignore[arg-type]
        second = self.touch(direction, distance=2.0 * off, speed_mps=slow_mps, retreat=retreat, **ways)  # type: ignore[arg-type]
        return replace(second, first=first)

    def wait_for_taps(
        self, count: int = 2, *, force: float = 8.0, gap: float = 1.0, timeout: float = 60.0
    ) -> State:
        """Wait until somebody taps the resting arm, looked at here, not on the cabinet.

        Args:
            count: how often.
            force: a tap is at least so strong [N]; what acts all the time is no tap.
            gap: the next tap comes within this time [s].
            timeout: how long to wait [s].

        Returns:
            The state after the last tap.

        Raises:
            Timeout: it was not tapped in time.
        """
        if not isinstance(count, int) or isinstance(count, bool) or count < 1:
            raise ShapeError(f"count is {count!r}; a whole number from 1 is wanted", parameter="count")
        taps = TapWatch(force=force, gap=gap)
        for state in self.states(duration=within(timeout, "timeout", 0.0, 1e6, unit="s")):
            if taps.see(state.wrench.stamp * 1e-9, state.wrench.force) >= count:
                return state
        raise Timeout(f"the arm was not tapped {count} times within {timeout:g} s")

    def _mean_force(self, frame: str) -> Array:
        """What acts on the resting arm now, in the axes of a frame, shape (3,) [N]."""
        found = []
        for state in self.states(duration=_PATIENCE):
            found.append(self._tooling.wrench(state, TOOL, frame).force)
            if len(found) == _SAMPLES:
                break
        if not found:
            raise Timeout(f"no state came within {_PATIENCE:g} s")
        mean: Array = np.mean(found, axis=0)
        return mean

    def _contact(self, result: Result, start: State, frame: str, bias: Array, where: str) -> Contact:
        state = result.fired_at
        if result.cause is not Cause.CONDITION or state is None:
            what = "nothing was touched" if result.arrived else f"the motion was {result.cause.value}"
            raise NoContact(
                f"{what} {where}",
                result=result,
                history=self._connection.history(),
                hint="give a longer distance or a lower force, and look whether the thing is there",
            )
        axes = self._tooling.pose(state, frame).rotation
        return Contact(
            state.pose,
            np.asarray(state.wrench.force - axes @ bias),
            start.pose.distance_to(state.pose),
            state.q,
            result,
        )

    def _retreat(self, contact: Contact, ahead: Array, frame: str, retreat: float, speed: float) -> None:
        state = self.wait_for_rest()
        axes = self._tooling.pose(state, frame).rotation
        beyond = float((state.pose.xyz - contact.pose.xyz) @ (axes @ ahead))
        back = -(beyond + retreat) * ahead
        if float(np.linalg.norm(back)) > 1e-6:
            result = self.move(lin_rel(*back.tolist(), frame=frame, speed_mps=speed))
            if not result.arrived:
                raise MotionAborted(f"the retreat was {result.cause.value}", result=result)


def _leaves(bias: Array, threshold: float, frame: str) -> Condition:
    """The force along one of the axes differs from the bias by more than the threshold."""
    seen = force_signal(frame=frame)
    x, y, z = (
        seen.along(axis).outside(b - threshold, b + threshold)
        for axis, b in zip("xyz", bias.tolist(), strict=True)
    )
    return x | y | z
