"""Set-points that are computed ahead of their ticks, many at once.

A motion in joint space has its set-points as soon as the speed is constant: many at once cost a fraction of what they
cost one by one. Whatever changes the motion's time or its set-points in between makes them useless: then the
interpolator goes on tick by tick.
"""

from __future__ import annotations

from heptarm.planning.table import MotionTable, SetPointRows
from heptarm.sim.controller.setpoints import SetPoints
from heptarm.values.checks import Array


class SetPointsAhead:
    """The next set-points of whichever motion runs.

    Args:
        command: the set-points so far.

    Attributes:
        last: the newest set-point that was taken.
        place: path parameter s there.
    """

    __slots__ = ("_index", "_rows", "_size", "_step", "_table", "_time", "last", "place")

    def __init__(self, command: SetPoints) -> None:
        self._rows = SetPointRows(command.largest_step)
        self._table: MotionTable | None = None
        self._index = self._size = 0
        self._step = self._time = self.place = 0.0
        self.last = command.after

    def drop(self) -> None:
        """Forget those that were not taken."""
        self._table = None

    def compute(self, table: MotionTable, time: float, step: float, here: Array) -> None:
        """Compute the next ones.

        Args:
            table: of the motion.
            time: of the motion now [s].
            step: by which it grows in each tick [s].
            here: the set-point so far, shape (7,) [rad].
        """
        self._size, self._index = self._rows.compute(table, time, step, here), 0
        self._table, self._step, self._time, self.last = table, step, time, here

    def are_over(self, table: MotionTable) -> bool:
        """Whether every set-point of a motion was taken, and no more follow."""
        return table is self._table and self._index >= self._size and self._rows.is_last

    def take(self, table: MotionTable, time: float, step: float, here: Array) -> float:
        """Take the next set-point, which `last` and `place` then are.

        Args:
            table: of the motion.
            time: of the motion before this tick [s].
            step: by which it grows in this tick [s].
            here: the set-point so far, shape (7,) [rad].

        Returns:
            The time of the motion after this tick; negative: there is no such set-point.
        """
        index = self._index
        if (
            table is not self._table
            or index >= self._size
            or here is not self.last
            or step != self._step
            or time != self._time
        ):
            return -1.0
        rows = self._rows
        self.last, self.place, self._time = rows.joints[index], rows.places[index], rows.times[index]
        self._index = index + 1
        return self._time
