"""Set-points that are computed ahead of their ticks, many at once.

A motion in joint space has its set-points as soon as the speed is constant: many at once cost a fraction of what they
cost one by one. Whatever changes the motion's time or its set-points in between makes them useless: then the
interpolator goes on tick by tick.
"""

from __future__ import annotations

from heptarm.sim.controller.setpoints import SetPoints
from heptarm.sim.planning.table import MotionTable
from heptarm.values.arrays import Array


class SetPointsAhead:
    """The next set-points of a motion.

    Args:
        table: of the motion.
        time: of the motion now [s].
        step: by which it grows in each tick [s].
        command: the set-points so far.

    Attributes:
        last: the newest set-point that was taken.
        place: path parameter s there.
    """

    __slots__ = ("_index", "_rows", "_size", "_step", "_time", "last", "place")

    def __init__(self, table: MotionTable, time: float, step: float, command: SetPoints) -> None:
        self.last, self.place = command.after, 0.0
        self._step, self._time, self._index = step, time, 0
        self._rows = table.ahead(time, step, last=command.after, leap=command.largest_step)
        self._size = len(self._rows.joints)

    @property
    def is_over(self) -> bool:
        """Whether every set-point was taken, and no more follow."""
        return self._index >= self._size and self._rows.is_last

    def take(self, time: float, step: float, here: Array) -> float:
        """Take the next set-point, which `last` and `place` then are.

        Args:
            time: of the motion before this tick [s].
            step: by which it grows in this tick [s].
            here: the set-point so far, shape (7,) [rad].

        Returns:
            The time of the motion after this tick; negative: there is no such set-point.
        """
        index = self._index
        if index >= self._size or here is not self.last or step != self._step or time != self._time:
            return -1.0
        rows = self._rows
        self.last, self.place, self._time = rows.joints[index], rows.places[index], rows.times[index]
        self._index = index + 1
        return self._time
