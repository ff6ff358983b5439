"""Commanding poses in the loop: the interpolator's pose, its speed while mirroring, and the guard that poses pass."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from heptarm.fri import messages as m
from heptarm.fri.pose_guard import PoseGuard, PoseLimits, between, moved

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
    """

    def __init__(self, limits: PoseLimits) -> None:
        self.guard = PoseGuard(limits)
        self.forget()

    def forget(self) -> None:
        """The session commands no pose."""
        self._frame: m.Transformation | None = None
        self.ipo: Sequence[float] = _NAN7
        self._mirrored: tuple[Sequence[float], int] | None = None
        self._twist: Sequence[float] = _REST

    @property
    def on_wire(self) -> tuple[float, ...]:
        """Interpolator's pose as it came; NaN while there is none."""
        return self._frame.values if self._frame is not None else _NAN7

    def look(self, message: m.Monitoring) -> None:
        """Take the interpolator's pose of a message."""
        if message.ipo is not None and message.ipo.pose is not None:
            self._frame = message.ipo.pose
            self.ipo = from_wire(self._frame.values)

    def mirror(self, sequence: int, period: int) -> None:
        """The pose of this message is mirrored: tells the interpolator's speed.

        Args:
            sequence: of the message.
            period: of the messages [ns].
        """
        if self._frame is None:
            return
        last, self._mirrored = self._mirrored, (self.ipo, sequence)
        self._twist = _REST
        if last is not None and period and sequence > last[1]:
            gap = (sequence - last[1]) * period * 1e-9
            self._twist = tuple(value / gap for value in between(last[0], self.ipo))

    def begin(self, period: float, *, again: bool) -> None:
        """Commands become effective; without an interpolator's pose nothing begins.

        Args:
            period: distance of two commands [s].
            again: the session is another one than that of the last message.
        """
        if self._mirrored is not None and not again:
            self.guard.start(self._mirrored[0], self._twist, period=period)
        elif self._frame is not None:  # the client was not there when commanding began
            self.guard.start(self.ipo, period=period)
        self._mirrored = None

    def resume(self, period: float) -> None:
        """After a silence: from the last pose, at rest."""
        self.guard.start(self.guard.sent, period=period)

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
