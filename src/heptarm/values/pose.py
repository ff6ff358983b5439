"""Poses: translation and rotation; redundancy: which of the joint positions of one pose."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar, cast

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import (
    Array,
    Value,
    array,
    finite,
    finite_entries,
    numbers,
    scalar,
    shown,
    within,
    word,
)
from heptarm.values.frames import BASE, check_name
from heptarm.values.text import fixed

#: Whose axes an offset of a pose may refer to.
_FRAMES = ("base", "tool")
#: Largest angle; more is degrees [rad].
_TURN = 2.0 * math.pi + 1e-9

#: E1 that is not given. A NaN of a computation is not this one, and is refused.
NOT_GIVEN = float("nan")
#: Largest E1 that is accepted [rad].
_LARGEST = 1000.0
#: Largest error of the products of the rows of a rotation matrix.
_ORTHONORMAL = 2e-3
#: Gimbal lock: so near to it one of the angles a and c is free.
_LOCKED = 1e-13


@dataclass(frozen=True, slots=True, eq=False)
class Redundancy(Value):
    """E1, Status and Turn.

    Attributes:
        e1: the angle of A3 [rad], as in Sunrise. NaN, the default: not given.
        status: bit 0, the wrist is behind A1's x axis; bit 1, A4 < 0; bit 2, A6 <= 0. -1: not given.
        turn: bit i, A(i+1) < 0. -1: not given. An LBR does not need it: its joints turn less than once.

    Raises:
        LimitError: E1 is infinite or another NaN than the default, or Status or Turn has bits that do not exist.
    """

    e1: float = NOT_GIVEN
    status: int = -1
    turn: int = -1

    def __post_init__(self) -> None:
        if self.e1 is not NOT_GIVEN:
            within(scalar(self.e1, "e1"), "e1", -_LARGEST, _LARGEST, unit="rad")
        for name, value, last in (("status", self.status, 7), ("turn", self.turn, 127)):
            if isinstance(value, bool) or not (isinstance(value, int) and -1 <= value <= last):
                raise LimitError(
                    f"{name} must be 0 to {last}, or -1 for not given, got {shown(value)}",
                    code=2,
                    parameter=name,
                    value=value,
                    allowed=f"[-1, {last}]",
                )


def near_of(near: npt.ArrayLike | None, redundancy: Redundancy | None) -> Array | None:
    """Joint positions that choose the arm position, shape (7,) [rad], unless a redundancy does.

    Raises:
        CommandRejected: both are given.
        ShapeError: a wrong shape or type.
    """
    if near is not None and redundancy is not None:
        raise CommandRejected(
            "near and redundancy both choose the arm position", parameter="near", hint="give one of them"
        )
    if redundancy is not None and not isinstance(redundancy, Redundancy):
        raise ShapeError(
            f"redundancy must be a Redundancy, got {shown(redundancy)}",
            parameter="redundancy",
            value=redundancy,
        )
    return None if near is None else array(near, 7, "near")


def deg(*angles: float) -> Array:
    """Degrees to radians, shape (n,).

    Raises:
        ShapeError: an angle is no number.
        LimitError: an angle is infinite or NaN.
    """
    return np.radians([finite(angle, f"angles[{index}]", unit="deg") for index, angle in enumerate(angles)])


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
        norm = math.sqrt(quat.dot(quat))
        if abs(norm - 1.0) > 1e-3:
            raise ShapeError(
                f"quat must have norm 1, got {norm:.6g} for {quat}",
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
        return cls.of([finite(value, name, unit="m") for name, value in (("x", x), ("y", y), ("z", z))])

    @classmethod
    def xyz_abc(
        cls, x: float = 0.0, y: float = 0.0, z: float = 0.0, a: float = 0.0, b: float = 0.0, c: float = 0.0
    ) -> Pose:
        """KUKA's notation in SI: translation [m], then R = Rz(a) Ry(b) Rx(c) [rad], each at most one turn.

        Raises:
            LimitError: a number is not finite, or an angle is more than a turn, as degrees are.
        """
        angles = [_angle(value, name) for name, value in (("a", a), ("b", b), ("c", c))]
        (sa, ca), (sb, cb), (sc, cc) = ((math.sin(t / 2), math.cos(t / 2)) for t in angles)
        quat = (
            sc * cb * ca - cc * sb * sa,
            cc * sb * ca + sc * cb * sa,
            cc * cb * sa - sc * sb * ca,
            cc * cb * ca + sc * sb * sa,
        )
        return cls.of(cls.at(x, y, z).xyz, quat)

    @classmethod
    def from_matrix(cls, matrix: npt.ArrayLike) -> Pose:
        """Pose of a homogeneous matrix, shape (4, 4) (or (3, 4)).

        The quaternion follows the largest of its components, so it is accurate everywhere.
        """
        m = numbers(matrix, "matrix", "a matrix of shape (4, 4)")
        if m.shape not in ((4, 4), (3, 4)):
            raise ShapeError(
                f"matrix must have shape (4, 4), got {m.shape}", parameter="matrix", value=matrix
            )
        finite_entries(m, "matrix")
        check_rotation(m[:3, :3], "matrix")
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
        """KUKA's angles about z, y, x [rad], shape (3,): R = Rz(a) Ry(b) Rx(c); c is 0 in gimbal lock."""
        x, y, z, w = self.quat.tolist()
        # w + y, z - x = √2 cos(b/2 - π/4) (cos, sin)((a - c) / 2)
        # w - y, z + x = √2 sin(π/4 - b/2) (cos, sin)((a + c) / 2)
        upper, lower = math.hypot(w + y, z - x), math.hypot(w - y, z + x)
        difference, total = math.atan2(z - x, w + y), math.atan2(z + x, w - y)
        b = 0.5 * math.pi - 2.0 * math.atan2(lower, upper)
        if lower < _LOCKED:
            total = difference
        elif upper < _LOCKED:
            difference = total
        a, c = total + difference, total - difference
        return np.array([math.remainder(a, math.tau), b, math.remainder(c, math.tau)]) + 0.0

    @property
    def array(self) -> Array:
        """X y z qx qy qz qw, shape (7,)."""
        return np.concatenate([self.xyz, self.quat])

    def __matmul__(self, other: Pose) -> Pose:
        """Chain of poses: T_ac = T_ab @ T_bc."""
        check_pose(other, "other")
        return Pose(self.xyz + self.rotation @ other.xyz, multiply(self.quat, other.quat))

    def inverse(self) -> Pose:
        """T_ba of T_ab."""
        quat = self.quat * np.array([-1.0, -1.0, -1.0, 1.0])
        return Pose(-(rotation(quat) @ self.xyz), quat)

    def distance_to(self, other: Pose) -> float:
        """Distance of the origins [m]."""
        check_pose(other, "other")
        return float(np.linalg.norm(self.xyz - other.xyz))

    def angle_to(self, other: Pose) -> float:
        """Angle between the orientations [rad], in [0, pi]."""
        check_pose(other, "other")
        difference = multiply(self.quat * np.array([-1.0, -1.0, -1.0, 1.0]), other.quat)
        return 2.0 * math.atan2(float(np.linalg.norm(difference[:3])), abs(float(difference[3])))

    def displacement(self, other: Pose) -> Array:
        """Way to another pose along and about the axes of the base, shape (6,).

        Returns:
            x y z [m], and the rotation vector of the smaller turn [rad].

        Raises:
            ShapeError: `other` is not a pose.
        """
        check_pose(other, "other")
        turn = Pose(np.zeros(3), multiply(other.quat, self.quat * np.array([-1.0, -1.0, -1.0, 1.0])))
        return np.concatenate([other.xyz - self.xyz, turn.rotvec])

    @property
    def rpy(self) -> Array:
        """Roll, pitch, yaw about the fixed x, y, z axes [rad], shape (3,): R = Rz(yaw) Ry(pitch) Rx(roll)."""
        return np.ascontiguousarray(self.abc[::-1])

    @property
    def rotvec(self) -> Array:
        """Rotation vector: its axis times its angle, shape (3,) [rad], at most pi long."""
        length = float(np.linalg.norm(self.quat[:3]))
        w = float(self.quat[3])
        sign = -1.0 if w < 0.0 else 1.0
        if length < 1e-12:
            return np.zeros(3)
        angle = 2.0 * math.atan2(length, abs(w))
        return np.asarray(sign * angle / length * self.quat[:3]) + 0.0

    @classmethod
    def from_rotvec(cls, xyz: npt.ArrayLike, rotvec: npt.ArrayLike) -> Pose:
        """Pose from a translation (3,) [m] and a rotation vector (3,): axis times angle [rad].

        Raises:
            ShapeError: not three numbers.
            LimitError: a number that is not finite, or more than a turn, as degrees are.
        """
        vector = array(rotvec, 3, "rotvec")
        angle = float(np.linalg.norm(vector))
        if angle > _TURN:
            raise LimitError(
                f"rotvec must be at most one turn long, {2.0 * math.pi:.4f} rad, got {angle:g} rad",
                code=2,
                parameter="rotvec",
                value=rotvec,
                allowed=f"[0, {2.0 * math.pi:.4f}] rad",
                hint="angles are radians: heptarm.deg(...) makes them of degrees",
            )
        if angle == 0.0:
            return cls.of(xyz)
        axis = vector / angle * math.sin(angle / 2)
        return cls.of(xyz, (*axis.tolist(), math.cos(angle / 2)))

    def shifted(self, x: float = 0.0, y: float = 0.0, z: float = 0.0, *, frame: str = "base") -> Pose:
        """The pose moved by an offset [m].

        Args:
            x: along the x axis of the frame.
            y: along its y axis.
            z: along its z axis.
            frame: whose axes: "base", or "tool", the pose's own.

        Raises:
            LimitError: an offset that is not finite.
            ShapeError: another frame.
        """
        offset = Pose.at(x, y, z).xyz
        turned = offset if word(frame, "frame", _FRAMES) == "base" else self.rotation @ offset
        return Pose(self.xyz + turned, self.quat)

    def rotated(self, a: float = 0.0, b: float = 0.0, c: float = 0.0, *, frame: str = "tool") -> Pose:
        """The pose turned about its own origin by R = Rz(a) Ry(b) Rx(c) [rad].

        Args:
            a: about the z axis of the frame.
            b: about the y axis.
            c: about the x axis.
            frame: whose axes: "tool", the pose's own, or "base".

        Raises:
            LimitError: an angle that is not finite.
            ShapeError: another frame.
        """
        turn = Pose.xyz_abc(a=a, b=b, c=c).quat
        is_own = word(frame, "frame", _FRAMES) == "tool"
        return Pose(self.xyz, multiply(self.quat, turn) if is_own else multiply(turn, self.quat))

    def interpolate(self, other: Pose, fraction: float) -> Pose:
        """A pose between two: on the straight line, and on the shortest rotation at constant speed (slerp).

        Half a turn goes as in a LIN: about the axis whose first component that is not 0 is positive in base axes.

        Args:
            other: the pose at 1.
            fraction: 0 is this pose; [0, 1].

        Raises:
            LimitError: a fraction outside its range.
        """
        check_pose(other, "other")
        s = within(fraction, "fraction", 0.0, 1.0)
        part = Pose.from_rotvec((0.0, 0.0, 0.0), s * turn_between(self.quat, other.quat))
        return Pose(self.xyz + s * (other.xyz - self.xyz), multiply(part.quat, self.quat))

    def __str__(self) -> str:
        """One line: millimetres and degrees, and the same in SI units."""
        a, b, c = (fixed(v, 2) for v in np.degrees(self.abc))
        x, y, z = (fixed(v * 1e3, 1) for v in self.xyz)
        si, quat = (" ".join(fixed(v, 4) for v in numbers) for numbers in (self.xyz, self.quat))
        return f"x {x}  y {y}  z {z} mm   a {a}  b {b}  c {c} deg   ({si} m, xyzw {quat})"

    def __repr__(self) -> str:
        """Exact: the expression that makes this pose; `str` is the readable form."""
        return f"Pose(xyz={self.xyz.tolist()}, quat={self.quat.tolist()})"


@dataclass(frozen=True, slots=True, eq=False)
class PartialPose(Value):
    """A target of which only some coordinates are given; the others stay as they are where the motion begins.

    ::

        arm.move(ha.lin(ha.PartialPose(z=0.3)))  # straight up or down to a height of 0.3 m

    It is no pose: what it lacks is known once the arm is about to move. `ptp` and `lin` accept it.

    Attributes:
        x: translation along x of the frame of the target [m]; NaN: as where the motion begins, likewise the others.
        y: along y [m].
        z: along z [m].
        a: KUKA's angle about z [rad]: R = Rz(a) Ry(b) Rx(c). Where b is a quarter turn, a kept c is 0, see `Pose.abc`.
        b: about y [rad].
        c: about x [rad].
        frame: pose of the frame of these numbers in the frame of the target.

    Raises:
        LimitError: a number is infinite, an angle is more than a turn, or no number is given.
    """

    x: float = math.nan
    y: float = math.nan
    z: float = math.nan
    a: float = math.nan
    b: float = math.nan
    c: float = math.nan
    frame: Pose = field(default_factory=Pose.at)

    def __post_init__(self) -> None:
        check_pose(self.frame, "frame")
        for name in "xyzabc":
            value = scalar(getattr(self, name), name)
            if not math.isnan(value):
                value = finite(value, name, unit="m") if name in "xyz" else _angle(value, name)
            object.__setattr__(self, name, value)
        if np.isnan(self._given).all():
            raise LimitError(
                "a target must have one coordinate at least, got NaN for all six",
                code=1,
                parameter="x",
                value=math.nan,
                hint="NaN keeps a coordinate; check how it was computed",
            )

    @property
    def _given(self) -> Array:
        return np.array([getattr(self, name) for name in "xyzabc"])

    def placed(self, frame: Pose) -> PartialPose:
        """The same target in the frame in which `frame` is given."""
        check_pose(frame, "frame")
        return replace(self, frame=frame @ self.frame)

    def completed(self, start: Pose) -> Pose:
        """The whole target of a motion.

        Args:
            start: where the motion begins, in the same frame as the target.
        """
        check_pose(start, "start")
        here = self.frame.inverse() @ start
        xyz = np.where(np.isnan(self._given[:3]), here.xyz, self._given[:3])
        if np.isnan(self._given[3:]).all():
            return Pose(self.frame.rotation @ xyz + self.frame.xyz, start.quat)
        return self.frame @ Pose.xyz_abc(
            *xyz, *np.where(np.isnan(self._given[3:]), here.abc, self._given[3:])
        )


def check_target(target: Pose | PartialPose) -> None:
    """Refuse what is no target of a motion.

    Raises:
        ShapeError: it is neither a pose nor a partial one.
    """
    if not isinstance(target, PartialPose):
        check_pose(target)


def check_pose(pose: Pose, parameter: str = "pose") -> None:
    """Refuse what is no pose.

    Raises:
        ShapeError: it is something else.
    """
    if not isinstance(pose, Pose):
        raise ShapeError(
            f"{parameter} must be a Pose, got {shown(pose)}",
            parameter=parameter,
            value=pose,
            hint="build one with Pose.xyz_abc(x, y, z, a, b, c)",
        )


_Target = TypeVar("_Target", Pose, PartialPose, Pose | PartialPose)


def placed_target(frame: Pose, target: _Target) -> _Target:
    """A target that is given in a frame, seen from where the frame is given."""
    return target.placed(frame) if isinstance(target, PartialPose) else frame @ target


def given_in(frame: str | Pose, *poses: _Target) -> tuple[str, tuple[_Target, ...]]:
    """The name of the frame that poses refer to, and the poses in it.

    Args:
        frame: its name; or its pose in the base, in which the poses are computed at once.
        poses: in that frame.

    Raises:
        ShapeError: neither a name nor a pose.
    """
    if not isinstance(frame, Pose):
        return check_name(frame, "frame"), poses
    return BASE, tuple(
        placed_target(frame, pose) if isinstance(pose, Pose | PartialPose) else pose for pose in poses
    )


def _angle(value: float, name: str) -> float:
    return within(value, name, -_TURN, _TURN, unit="rad")


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


#: Half a turn, whose direction is free: cosine of half the angle between two orientations, which are known to 1e-6 rad.
_HALF_TURN = 1e-6


def is_half_turn(start: Array, end: Array) -> bool:
    """Whether one orientation is half a turn from another, so that two directions lead to it; quaternions."""
    return abs(float(start @ end)) < _HALF_TURN


def towards(start: Array, end: Array, *, is_other: bool = False) -> Array:
    """The quaternion of an orientation, `end` or `-end`, to which a rotation from another goes by the smaller angle.

    Half a turn goes about the axis whose first component that is not 0 is positive, in base axes: so its direction does
    not depend on rounding.

    Args:
        start: quaternion x y z w.
        end: quaternion x y z w.
        is_other: half a turn goes in the other direction.
    """
    is_ahead = float(start @ end) >= 0.0
    if is_half_turn(start, end):
        axis = multiply(end, _conjugate(start))[:3]
        is_ahead = (axis[int(np.argmax(np.abs(axis) > 1e-3))] >= 0.0) != is_other
    return end if is_ahead else -end


def turn_between(start: Array, end: Array, *, is_other: bool = False) -> Array:
    """Rotation vector from one orientation to another in base axes, shape (3,) [rad]; see `towards`."""
    difference = multiply(towards(start, end, is_other=is_other), _conjugate(start))
    length = float(np.linalg.norm(difference[:3]))
    if length < 1e-12:
        return np.zeros(3)
    return np.asarray(2.0 * math.atan2(length, float(difference[3])) / length * difference[:3])


def _conjugate(quat: Array) -> Array:
    return np.asarray(quat * (-1.0, -1.0, -1.0, 1.0))


def check_rotation(turned: Array, name: str) -> None:
    """Refuse matrices that are no rotations, shape (3, 3) or (n, 3, 3), finite.

    Raises:
        ShapeError: one is none; the text has its index.
    """
    # the components one by one are several times as fast as products of many small matrices
    is_one = turned.ndim == 2
    rows = turned.ravel().tolist() if is_one else np.ascontiguousarray(turned.reshape(-1, 9).T)
    xx, xy, xz, yx, yy, yz, zx, zy, zz = rows
    with np.errstate(over="ignore", invalid="ignore"):
        off = (
            xx * xx + xy * xy + xz * xz - 1.0,
            yx * yx + yy * yy + yz * yz - 1.0,
            zx * zx + zy * zy + zz * zz - 1.0,
            xx * yx + xy * yy + xz * yz,
            yx * zx + yy * zy + yz * zz,
            xx * zx + xy * zy + xz * zz,
        )
        handedness = (xy * yz - xz * yy) * zx + (xz * yx - xx * yz) * zy + (xx * yy - xy * yx) * zz
        is_turn = np.atleast_1d((np.abs(off).max(axis=0) <= _ORTHONORMAL) & (handedness > 0.0))
    if is_turn.all():
        return
    wrong = int(is_turn.argmin())
    named, value = (name, turned) if is_one else (f"{name}[{wrong}]", turned[wrong])
    raise ShapeError(
        f"the rotation of {named} must be orthonormal and right-handed, got {value.tolist()}",
        parameter=named,
        value=value,
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
    """Unit quaternion x y z w of a rotation matrix, w >= 0; from the largest component (Shepperd 1978)."""
    trace = r[0][0] + r[1][1] + r[2][2]
    squares = (r[0][0], r[1][1], r[2][2], trace)
    largest = max(range(4), key=lambda i: squares[i])
    if largest == 3:
        q = [r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1], 1.0 + trace]
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = [0.0] * 4
        q[i] = 1.0 + r[i][i] - r[j][j] - r[k][k]
        q[j] = r[j][i] + r[i][j]
        q[k] = r[k][i] + r[i][k]
        q[3] = r[k][j] - r[j][k]
    result = np.array(q) / math.sqrt(sum(v * v for v in q))
    return -result if result[3] < 0 else result
