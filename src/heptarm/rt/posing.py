"""Commanding poses in the loop: the interpolator's pose, its speed while mirroring, and the guard that poses pass."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from heptarm.fri import messages as m
from heptarm.fri.pose_guard import PoseGuard, PoseLimits, between, moved
from heptarm.fri.silence import part_carried_on, speed_after
from heptarm.rt.state import Floats, State

_NAN7 = (math.nan,) * 7
_REST = (0.0,) * 6


def from_wire(values: Sequence[float]) -> tuple[float, ...]:
    """Pose as x y z [m], quaternion x y z w, of FRI's x y z [mm], w x y z."""
    x, y, z, qw, qx, qy, qz = values
    return (1e-3 * x, 1e-3 * y, 1e-3 * z, qx, qy, qz, qw)


def to_wire(pose: Sequence[float]) -> tuple[float, ...]:
    """FRI's x y z [mm], quaternion w x y z, of x y z [m], x y z w."""
    x, y, z, qx, qy, qz, qw = pose
    return (1e3 * x, 1e3 * y, 1e3 * z, qw, qx, qy, qz)


class Posing:
    """What a session that commands poses needs beside the session itself.

    Args:
        limits: what the guard keeps.

    Attributes:
        guard: limits the poses.
        ipo: interpolator's pose, shape (7,) [m, x y z w]; NaN while there is none.
        ipo_e1: its redundancy angle [rad]; NaN where it has none.
    """

    def __init__(self, limits: PoseLimits) -> None:
        self.guard = PoseGuard(limits)
        self.forget()

    def forget(self) -> None:
        """The session commands no pose."""
        self._frame: m.Transformation | None = None
        self._redundancy: m.Redundancy | None = None
        self.ipo: Sequence[float] = _NAN7
        self.ipo_e1 = math.nan
        self._mirrored: tuple[Sequence[float], float, int] | None = None
        self._twist: Sequence[float] = _REST
        self._turning = 0.0  # of the redundancy angle [rad/s]

    @property
    def knows(self) -> bool:
        """Whether an interpolator's pose has come."""
        return self._frame is not None

    @property
    def on_wire(self) -> tuple[float, ...]:
        """Interpolator's pose as it came; NaN while there is none."""
        return self._frame.values if self._frame is not None else _NAN7

    def look(self, message: m.Monitoring) -> None:
        """Take the interpolator's pose of a message, and its redundancy."""
        if message.ipo is not None and message.ipo.pose is not None:
            self._frame, self._redundancy = message.ipo.pose, message.ipo.redundancy
            self.ipo = from_wire(self._frame.values)
            has_angle = self._redundancy is not None and self._redundancy.strategy is m.RedundancyStrategy.E1
            self.ipo_e1 = self._redundancy.value if self._redundancy is not None and has_angle else math.nan

    def mirror(self, sequence: int, period: int) -> None:
        """The pose of this message is mirrored: tells the interpolator's speed.

        Args:
            sequence: of the message.
            period: of the messages [ns].
        """
        if self._frame is None:
            return
        last, self._mirrored = self._mirrored, (self.ipo, self.ipo_e1, sequence)
        self._twist, self._turning = _REST, 0.0
        if last is not None and period and sequence > last[2]:
            gap = (sequence - last[2]) * period * 1e-9
            self._twist = tuple(value / gap for value in between(last[0], self.ipo))
            turned = (self.ipo_e1 - last[1]) / gap
            self._turning = turned if math.isfinite(turned) else 0.0

    def begin(self, period: float, *, again: bool) -> None:
        """Commands become effective; without an interpolator's pose nothing begins.

        Args:
            period: distance of two commands [s].
            again: the session is another one than that of the last message.
        """
        if self._mirrored is not None and not again:
            pose, e1, _ = self._mirrored
            self.guard.start(pose, self._twist, period=period, e1=e1, e1_speed=self._turning)
        elif self._frame is not None:  # the client was not there when commanding began
            self.guard.start(self.ipo, period=period, e1=self.ipo_e1)
        self._mirrored = None

    def resume(self, message: m.Monitoring, last: Floats | None, *, time: float, period: float) -> None:
        """After a silence: go on from where the flange has come to, with the speed that it still has.

        Args:
            message: the first one after it.
            last: words of the state before it.
            time: how long nothing was heard [s].
            period: distance of two commands [s].
        """
        guard, monitor = self.guard, message.monitor
        way: Sequence[float] = _REST
        turned = 0.0
        if last is not None and monitor is not None and monitor.pose is not None:
            then = State(last)
            way = between(then.pose.array.tolist(), from_wire(monitor.pose.values))
            if monitor.redundancy is not None and math.isfinite(then.e1):
                turned = monitor.redundancy.value - then.e1
        gone, speed = part_carried_on([value / period for value in guard.v], way[:3], time)
        spun, rate = part_carried_on([value / period for value in guard.w], way[3:], time)
        bent, bending = speed_after(guard.u / period, turned, time)
        before = moved(guard.sent, [-value for value in (*guard.v, *guard.w)])
        guard.start(
            moved(before, (*gone, *spun)),
            (*speed, *rate),
            period=period,
            e1=guard.e1 - guard.u + bent,
            e1_speed=bending,
        )

    def command(self, wish: Sequence[float] | None, skipped: int) -> m.Transformation:
        """The pose to send, as FRI has it.

        Args:
            wish: shape (7,) [m, x y z w]; None brakes.
            skipped: cycles of which nothing was heard; they are done evenly towards the wish.
        """
        guard, limited = self.guard, False
        reach = self.ipo if guard.limits.reach < math.inf else None
        if skipped:
            start = (*guard.goal[0], *guard.goal[1])
            way = wish and between(start, wish)
            for k in range(1, skipped + 1):
                share = k / (skipped + 1)
                guard.pose(way and moved(start, [share * value for value in way]), reach)
                limited |= guard.was_limited
        pose = guard.pose(wish, reach)
        guard.was_limited |= limited
        assert self._frame is not None
        return replace(self._frame, values=to_wire(pose))

    def command_elbow(self, wish: float | None) -> m.Redundancy | None:
        """The redundancy to send with a pose, after `command`; None where the interpolator has none.

        Args:
            wish: angle [rad]; None brakes.
        """
        if self._redundancy is None or math.isnan(self.guard.e1):
            return self._redundancy
        return m.Redundancy(m.RedundancyStrategy.E1, self.guard.elbow(wish))
