"""Set-points that are computed ahead of their ticks, many at once.

A path in joint space has its set-points as soon as the speed is constant: with full arrays they cost a fraction of what
they cost one by one. Whatever changes the motion's time or its set-points in between makes them useless: then the
interpolator goes on tick by tick.
"""

from __future__ import annotations

from math import ceil

import numpy as np

from heptarm.sim.controller.setpoints import SetPoints
from heptarm.sim.planning.jerk_profile import TimeLaw
from heptarm.sim.planning.path import JointPath
from heptarm.values.arrays import Array

#: Largest number of ticks that are computed at once: with this many, most motions need it once.
MANY = 1024


class SetPointsAhead:
    """The next set-points of a motion.

    Args:
        path: joint positions over s.
        profile: s over time.
        time: of the motion now [s].
        step: by which it grows in each tick [s].
        command: the set-points so far.

    Attributes:
        step: as given.
        times: of the motion, beginning with the one given [s].
        places: s at each of them but the first.
        joints: set-points at each of them but the first, shape (7,) each [rad].
        last: the newest set-point that was taken.
        ends: whether the last of them is the last before the end of the motion, or before one that cannot be followed.
    """

    __slots__ = ("_index", "_size", "ends", "joints", "last", "place", "places", "step", "times")

    def __init__(
        self, path: JointPath, profile: TimeLaw, time: float, step: float, command: SetPoints
    ) -> None:
        self.step, self.last, self._index, self.place = step, command.after, 0, 0.0
        many = ceil(min(MANY - 1.0, max(0.0, profile.duration - time) / step)) + 1
        times = np.full(many + 1, step)
        times[0] = time
        times = np.cumsum(times)
        places = np.clip(profile.places(times[1:]), 0.0, 1.0)
        joints = path.row(places[places < 1.0])
        joints = joints[: command.followable(joints)]
        self.joints: list[Array] = list(joints)
        self._size = len(self.joints)
        self.ends = self._size < MANY
        self.times: list[float] = times.tolist()
        self.places: list[float] = places.tolist()

    @property
    def used_up(self) -> bool:
        """Whether every set-point was taken."""
        return self._index >= self._size

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
        if index >= self._size or here is not self.last or step != self.step or time != self.times[index]:
            return -1.0
        self.last, self.place = self.joints[index], self.places[index]
        self._index = index = index + 1
        return self.times[index]
