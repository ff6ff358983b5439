"""A policy driven by messages: joint states and targets in, commands out. For ROS nodes and similar programs."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.rl.pilot import Decides, Pilot, PolicyGuard
from heptarm.values.checks import Array, array


class Follower:
    """Follows the newest target with the newest joint states; without either it sends nothing, and the arm brakes.

    Not thread-safe.

    Args:
        policy: what decides.
        joints: names of the robot's seven joints from the base on.
        guard: limits; a joint state older than its `stale` is as good as none.
    """

    def __init__(self, policy: Decides, joints: Sequence[str], *, guard: PolicyGuard | None = None) -> None:
        self.guard = guard or PolicyGuard()
        self.task = policy.task
        self._pilot = Pilot(policy, self.guard)
        self._joints = tuple(joints)
        if len(set(self._joints)) != 7:
            raise ShapeError(f"joints must be seven different names, got {list(joints)}", parameter="joints")
        self._q = self._dq = np.full(7, nan)
        self._seen = -np.inf
        self._target: Array | None = None
        self._under_way = False

    @property
    def distance(self) -> float:
        """From the flange to the target, by the newest joint state [m]; NaN without a target."""
        if self._target is None:
            return nan
        return float(self.task.distance(self.task.tip(self._q), self._target))

    @property
    def counts(self) -> dict[str, int]:
        """Number of interventions of the guard."""
        return dict(self._pilot.watch.counts)

    def on_joints(
        self, names: Sequence[str], position: Sequence[float], velocity: Sequence[float], now: float
    ) -> None:
        """Take a joint state.

        Args:
            names: of its joints in any order; a message without all seven is another robot's and passed over.
            position: of these joints [rad].
            velocity: likewise [rad/s].
            now: the time [s].
        """
        place = {name: index for index, name in enumerate(names)}
        if not all(name in place for name in self._joints) or not len(position) == len(velocity) == len(
            names
        ):
            return
        order = [place[name] for name in self._joints]
        self._q, self._dq = np.asarray(position)[order], np.asarray(velocity)[order]
        self._seen = now

    def on_target(self, target: npt.ArrayLike | None) -> None:
        """Take a target, base frame, shape (3,) [m]; None: hold.

        Raises:
            LimitError: outside the guard's box; the last target stays.
            ShapeError: not three numbers.
        """
        if target is None:
            self._target, self._under_way = None, False
            return
        self._target = self.guard.check(array(target, 3, "target"))

    def command(self, now: float) -> Array | None:
        """The next commanded joint positions, shape (7,) [rad]; call it `task.rate` times per second.

        None: no target, or no fresh joint state; then send nothing.

        Raises:
            CommandRejected: the policy diverges; then send nothing either.
        """
        if self._target is None or not now - self._seen <= self.guard.stale:
            self._under_way = False
            return None
        if not self._under_way:
            self._pilot.begin(self._q)
            self._under_way = True
        return self._pilot.decide(self._q, self._dq, self._target)
