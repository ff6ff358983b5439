"""What a law wants."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.rt.signals import Outputs
from heptarm.values.pose import Pose

Floats = npt.NDArray[np.float64]


class Output:
    """What a law wants; set again before every call.

    Attributes:
        q: position, shape (7,) [rad]; begins as the interpolator's.
        tau: superposed torques, shape (7,) [Nm]; begin as zero.
        wrench: superposed wrench, shape (6,) [N, Nm]; begins as zero.
        pose: x y z [m] and quaternion x y z w, shape (7,), or a `Pose` assigned; begins as the interpolator's, NaN
            where no pose is commanded.
        e1: redundancy angle of the pose [rad]; begins as the interpolator's.
        io: outputs of the cabinet, `out.io["LEDBlue"] = True`; one that is not written stays as it is.
    """

    __slots__ = ("_pose", "e1", "io", "q", "tau", "wrench")

    def __init__(self, outputs: Outputs | None = None) -> None:
        self.io = Outputs() if outputs is None else outputs
        self.e1 = math.nan
        self.q: Floats = np.zeros(7)
        self.tau: Floats = np.zeros(7)
        self.wrench: Floats = np.zeros(6)
        self._pose: Floats = np.full(7, np.nan)

    @property
    def pose(self) -> Floats:
        """Wanted pose, shape (7,) [m, x y z w]."""
        return self._pose

    @pose.setter
    def pose(self, value: Pose | npt.ArrayLike) -> None:
        self._pose[:] = value.array if isinstance(value, Pose) else value

    @classmethod
    def on(cls, q: Any, tau: Any, wrench: Any) -> Output:
        """An output on memory that is there."""
        made = cls()
        made.q, made.tau, made.wrench = (np.frombuffer(part, dtype=np.float64) for part in (q, tau, wrench))
        return made
