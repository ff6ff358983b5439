"""The way of the moved frame along a planned path: which point of it lies how many metres behind another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual.path import JointPath

_SAMPLES = 201


@dataclass(frozen=True, slots=True)
class Way:
    """Lengths at samples of a path.

    Attributes:
        shares: s, ascending, shape (n,).
        lengths: of the way up to there, shape (n,) [m].
    """

    shares: Array
    lengths: Array

    @classmethod
    def through(cls, shares: Array, places: Array) -> Way:
        """From places of the moved frame, shape (n, 3) [m], at values of s, shape (n,)."""
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        return cls(shares, np.concatenate([[0.0], np.cumsum(steps)]))

    @classmethod
    def along(cls, robot: RobotModel, path: JointPath, start: Array, tcp: Sequence[float]) -> Way:
        """Of a path from joint positions, shape (7,) [rad]; the moved frame lies at `tcp` in the flange's [m]."""
        shares, offset = np.linspace(0.0, 1.0, _SAMPLES), np.array(tcp[:3])
        q, places = start, []
        for share in shares.tolist():
            q = path.at(share, q)
            pose = forward(robot, q)
            places.append(pose[:3, :3] @ offset + pose[:3, 3])
        return cls.through(shares, np.array(places))

    def place(self, distance: float, low: float, high: float, *, from_start: bool) -> float | None:
        """Path parameter at a distance [m] from one end of the part between two others; None: beyond its end."""
        first, last = np.interp([low, high], self.shares, self.lengths).tolist()
        wanted = (first if from_start else last) + distance
        if wanted > last + 1e-9:
            return None
        if wanted <= first and (from_start or wanted < last):
            return low
        return high if wanted >= last else float(np.interp(wanted, self.lengths, self.shares))
