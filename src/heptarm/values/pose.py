"""Pose of a frame: translation [m] and rotation (unit quaternion x y z w)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.arrays import Array, Value, array


def deg(*angles: float) -> Array:
    """Degrees to radians, shape (n,)."""
    return np.radians(np.array(angles, dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class Pose(Value):
    """Pose of a frame relative to a reference frame.

    Attributes:
        xyz: translation, shape (3,) [m].
        quat: rotation as a unit quaternion, shape (4,), x y z w; of the two that mean it, the one whose last
            entry that is not 0 is positive.

    Raises:
        ShapeError: wrong shapes, or the quaternion's norm is further than 1e-3 from 1.
        LimitError: a number is not finite.
    """

    xyz: Array
    quat: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "xyz", array(self.xyz, 3, "xyz"))
        quat = array(self.quat, 4, "quat")
        norm = float(np.linalg.norm(quat))
        if abs(norm - 1.0) > 1e-3:
            raise ShapeError(
                f"quat {quat} has norm {norm:.6g}; 1 is wanted",
                code=4,
                parameter="quat",
                value=norm,
                hint="divide it by its norm",
            )
        quat = quat / (-norm if _turned(quat.tolist()) else norm) + 0.0  # + 0.0: no -0.0, see arrays
        quat.flags.writeable = False
        object.__setattr__(self, "quat", quat)

    @classmethod
    def of(cls, xyz: npt.ArrayLike, quat: npt.ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> Pose:
        """Pose from a translation (3,) [m] and a quaternion (4,) x y z w."""
        return cls(cast("Array", xyz), cast("Array", quat))

    @classmethod
    def at(cls, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
        """Pure translation [m]."""
        return cls.of((x, y, z))

    @classmethod
    def xyz_abc(
        cls, x: float = 0.0, y: float = 0.0, z: float = 0.0, a: float = 0.0, b: float = 0.0, c: float = 0.0
    ) -> Pose:
        """KUKA's notation in SI: translation [m], then R = Rz(a) Ry(b) Rx(c) [rad]."""
        (sa, ca), (sb, cb), (sc, cc) = ((math.sin(t / 2), math.cos(t / 2)) for t in (a, b, c))
        quat = (
            sc * cb * ca - cc * sb * sa,
            cc * sb * ca + sc * cb * sa,
            cc * cb * sa - sc * sb * ca,
            cc * cb * ca + sc * sb * sa,
        )
        return cls.of((x, y, z), quat)

    @classmethod
    def from_matrix(cls, matrix: npt.ArrayLike) -> Pose:
        """Pose of a homogeneous matrix, shape (4, 4) (or (3, 4)).

        The quaternion follows the largest of its components, so it is accurate everywhere.
        """
        m = np.asarray(matrix, dtype=np.float64)
        if m.shape not in ((4, 4), (3, 4)):
            raise ShapeError(f"matrix has shape {m.shape}; (4, 4) is wanted")
        return cls.of(m[:3, 3], quaternion(m[:3, :3]))

    @property
    def x(self) -> float:
        """Translation along x [m]."""
        return float(self.xyz[0])

    @property
    def y(self) -> float:
        """Translation along y [m]."""
        return float(self.xyz[1])

    @property
    def z(self) -> float:
        """Translation along z [m]."""
        return float(self.xyz[2])

    @property
    def rotation(self) -> Array:
        """Rotation matrix, shape (3, 3)."""
        return rotation(self.quat)

    @property
    def matrix(self) -> Array:
        """Homogeneous matrix, shape (4, 4)."""
        result = np.eye(4)
        result[:3, :3] = self.rotation
        result[:3, 3] = self.xyz
        return result

    @property
    def abc(self) -> Array:
        """KUKA's angles about z, y, x [rad], shape (3,): R = Rz(a) Ry(b) Rx(c)."""
        r = self.rotation
        b = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0]))
        if math.hypot(r[0, 0], r[1, 0]) < 1e-12:  # gimbal lock: c is taken as 0
            return np.array([math.atan2(-r[0, 1], r[1, 1]), b, 0.0]) + 0.0
        return np.array([math.atan2(r[1, 0], r[0, 0]), b, math.atan2(r[2, 1], r[2, 2])]) + 0.0

    @property
    def array(self) -> Array:
        """X y z qx qy qz qw, shape (7,)."""
        return np.concatenate([self.xyz, self.quat])

    def __matmul__(self, other: Pose) -> Pose:
        """Chain of poses: T_ac = T_ab @ T_bc."""
        return Pose(self.xyz + self.rotation @ other.xyz, multiply(self.quat, other.quat))

    def inverse(self) -> Pose:
        """T_ba of T_ab."""
        quat = self.quat * np.array([-1.0, -1.0, -1.0, 1.0])
        return Pose(-(rotation(quat) @ self.xyz), quat)

    def distance_to(self, other: Pose) -> float:
        """Distance of the origins [m]."""
        return float(np.linalg.norm(self.xyz - other.xyz))

    def angle_to(self, other: Pose) -> float:
        """Angle between the orientations [rad], in [0, pi]."""
        difference = multiply(self.quat * np.array([-1.0, -1.0, -1.0, 1.0]), other.quat)
        return 2.0 * math.atan2(float(np.linalg.norm(difference[:3])), abs(float(difference[3])))

    def __repr__(self) -> str:
        """Short form in KUKA's notation, degrees."""
        a, b, c = np.degrees(self.abc)
        return f"Pose(x={self.x:.4f} y={self.y:.4f} z={self.z:.4f} m, a={a:.2f} b={b:.2f} c={c:.2f} deg)"


def _turned(quat: list[float]) -> bool:
    """Whether the last entry that is not 0 is negative."""
    return next((v for v in reversed(quat) if v != 0.0), 1.0) < 0.0


def multiply(p: Any, q: Any) -> Array:
    """Hamilton product of two quaternions x y z w."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return np.array(
        [
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz,
        ]
    )


def rotation(quat: Any) -> Array:
    """Rotation matrix of a unit quaternion x y z w, shape (3, 3)."""
    x, y, z, w = quat
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion(r: Any) -> Array:
    """Unit quaternion x y z w of a rotation matrix, w >= 0; the largest component leads (Shepperd 1978)."""
    trace = r[0][0] + r[1][1] + r[2][2]
    squares = (r[0][0], r[1][1], r[2][2], trace)
    lead = max(range(4), key=lambda i: squares[i])
    if lead == 3:
        q = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + trace]
    else:
        i, j, k = lead, (lead + 1) % 3, (lead + 2) % 3
        q = [0.0] * 4
        q[i] = 1.0 + r[i][i] - r[j][j] - r[k][k]
        q[j] = r[j][i] + r[i][j]
        q[k] = r[k][i] + r[i][k]
        q[3] = r[k][j] - r[j][k]
    result = np.array(q) / math.sqrt(sum(v * v for v in q))
    return -result if result[3] < 0 else result
