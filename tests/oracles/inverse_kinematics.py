"""Inverse kinematics of an LBR by the arm angle in Python: what `native/redundancy.c` is compared with.

Geometry after Shimizu, Kakuya, Yoon, Kitagaki, Kosuge, "Analytical Inverse Kinematic Computation for 7-DOF
Redundant Manipulators With Joint Limits and Its Application to Redundancy Resolution", IEEE T-RO 24(5),
2008, with KUKA's zero of the arm angle: E1 is the angle about the shoulder-wrist line away from the arm that
reaches the wrist with A3 = 0 in the same Status. Status: bit 0, the wrist is behind A1's x axis; bit 1, A4 < 0;
bit 2, A6 <= 0. Turn: bit i, A(i+1) < 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import TypeAlias

import numpy as np

from heptarm.errors import ShapeError, Unreachable
from heptarm.values.checks import Array, finite_entries, instance, integer, numbers
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from tests.oracles.kinematics import Columns, Vec, flange
from tests.oracles.null_space import events

#: Rows of a rotation matrix.
Rows: TypeAlias = tuple[Vec, Vec, Vec]

#: Below it sin(b) does not determine the other two angles, and the wrist is neither before nor behind A1.
SINGULAR = 1e-10
_NARROW = 1e-9
#: Largest step of the arm angle [rad] when the best of an interval is looked for.
_STEP = pi / 36
#: Where a solution is looked for when nothing is known: elbow down in front, wrist bent.
_USUAL = (0.0, 0.3, 0.0, -pi / 2, 0.0, pi / 3, 0.0)
_USUAL_STATUS = 2


def rows(pose: Pose | Array) -> tuple[Rows, Vec]:
    """Rotation rows and position of a pose or a homogeneous matrix, as floats."""
    if not isinstance(pose, Pose):
        given = finite_entries(numbers(pose, "pose", "a Pose or a matrix of shape (4, 4)"), "pose")
        if given.shape not in ((4, 4), (3, 4)):
            raise ShapeError(f"pose must have shape (4, 4), got {given.shape}", parameter="pose", value=pose)
        m = given.tolist()
    else:
        m = pose.matrix.tolist()
    return (tuple(m[0][:3]), tuple(m[1][:3]), tuple(m[2][:3])), (m[0][3], m[1][3], m[2][3])


def _times(a: Rows, b: Rows) -> Rows:
    (b00, b01, b02), (b10, b11, b12), (b20, b21, b22) = b
    r = [
        (
            x * b00 + y * b10 + z * b20,
            x * b01 + y * b11 + z * b21,
            x * b02 + y * b12 + z * b22,
        )
        for x, y, z in a
    ]
    return r[0], r[1], r[2]


def _transposed(a: Rows) -> Rows:
    t = list(zip(*a, strict=True))
    return t[0], t[1], t[2]


def _about(u: Vec, angle: float) -> Rows:
    """Rotation about the unit vector u (Rodrigues)."""
    x, y, z = u
    c, s = cos(angle), sin(angle)
    k = 1.0 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


def _zy(a: float, b: float) -> Rows:
    """Rz(a) Ry(b)."""
    ca, sa, cb, sb = cos(a), sin(a), cos(b), sin(b)
    return (ca * cb, -sa, ca * sb), (sa * cb, ca, sa * sb), (-sb, 0.0, cb)


def _wrap(angle: float) -> float:
    return angle - 2 * pi if angle > pi else angle + 2 * pi if angle <= -pi else angle


def _zyz(r: Rows, negative: bool, near: float) -> Vec:
    """Angles a, b, c of r = Rz(a) Ry(b) Rz(c) with b of the wanted sign; where b is 0, a keeps `near`.

    c comes from a + c = atan2(r10 - r01, r00 + r11), or where b is near pi from a - c, so that r is
    reproduced to the last digits however little b determines a.
    """
    s = hypot(r[0][2], r[1][2])
    upright = r[2][2] >= 0
    if s < SINGULAR:
        a, b = near, 0.0 if upright else -pi if negative else pi
    elif negative:
        a, b = atan2(-r[1][2], -r[0][2]), -atan2(s, r[2][2])
    else:
        a, b = atan2(r[1][2], r[0][2]), atan2(s, r[2][2])
    if upright:
        return a, b, _wrap(atan2(r[1][0] - r[0][1], r[0][0] + r[1][1]) - a)
    return a, b, _wrap(a - atan2(-r[1][0] - r[0][1], r[1][1] - r[0][0]))


def _reference(robot: RobotModel, w: Vec, q4: float, behind: bool) -> tuple[float, float]:
    """A1 and A2 of the arm with A3 = 0 whose wrist is at w (from the shoulder)."""
    radius = hypot(w[0], w[1])
    q1 = atan2(w[1], w[0])
    if behind:
        q1, radius = q1 + pi, -radius
    return q1, atan2(radius, w[2]) - atan2(-robot.d_ew * sin(q4), robot.d_se + robot.d_ew * cos(q4))


def _elbow(robot: RobotModel, w: Vec) -> float:
    """|A4| from the shoulder-wrist distance; half-angle form, accurate near the straight arm.

    Raises:
        Unreachable: the wrist is too far from or too near to the shoulder.
    """
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    far, near = robot.d_se + robot.d_ew, abs(robot.d_se - robot.d_ew)
    above, below = far * far - square, square - near * near
    if above < -1e-9 or below < -1e-9 or square < 1e-9:
        raise Unreachable(
            f"the wrist would be {sqrt(square):.3f} m from the shoulder; the {robot.title} reaches "
            f"{max(near, 0.0):.3f} to {far:.3f} m",
            code=51,
            value=round(sqrt(square), 4),
            allowed=f"[{near:.3f}, {far:.3f}] m",
            hint="bring the target nearer, or change its orientation",
        )
    return 2.0 * atan2(sqrt(max(above, 0.0)), sqrt(max(below, 0.0)))


def _wrist(robot: RobotModel, r: Rows, p: Vec) -> Vec:
    """Wrist as seen from the shoulder."""
    d = robot.d_wf
    return (p[0] - d * r[0][2], p[1] - d * r[1][2], p[2] - d * r[2][2] - robot.d_bs)


def raw(
    robot: RobotModel,
    r: Rows,
    p: Vec,
    e1: float,
    status: int,
    near: Sequence[float] | None = None,
    *,
    continuous: bool = False,
) -> tuple[float, ...]:
    """Joint positions of a flange pose for an arm angle and a Status; limits are not checked.

    Args:
        robot: the robot.
        r: rows of the flange's rotation.
        p: position of the flange in the base frame [m].
        e1: arm angle [rad].
        status: bit 0 selects the reference arm of E1; bits 0 and 2 select A2's and A6's branch, unless
            `continuous`.
        near: joint positions that decide where a singularity leaves a choice.
        continuous: of the two branches of the shoulder and of the wrist take the one next to `near`, so that
            a path may pass through A2 = 0 or A6 = 0.

    Raises:
        Unreachable: out of reach.
    """
    w = _wrist(robot, r, p)
    q4 = _elbow(robot, w)
    if status & 2:
        q4 = -q4
    a1, a2 = _reference(robot, w, q4, bool(status & 1))
    length = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    r03 = _times(_about((w[0] / length, w[1] / length, w[2] / length), e1), _zy(a1, a2))
    hint = near if near is not None else (a1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if continuous and near is not None:
        shoulder = _next(_zyz(r03, False, hint[0]), _zyz(r03, True, hint[0]), hint[0], hint[1])
    else:
        shoulder = _zyz(r03, False, hint[0])
        # bit 0: sign of the wrist's x in the frame of A1
        ahead = w[0] * cos(shoulder[0]) + w[1] * sin(shoulder[0])
        if abs(ahead) < SINGULAR:
            same = cos(shoulder[0] - a1) > 0
        else:
            same = (ahead < 0) == bool(status & 1)
        if not same:
            shoulder = _zyz(r03, True, hint[0])
    r47 = _times(_transposed(_times(r03, _zy(0.0, -q4))), r)
    if continuous and near is not None:
        wrist = _next(_zyz(r47, False, hint[4]), _zyz(r47, True, hint[4]), hint[4], hint[5])
    else:
        wrist = _zyz(r47, bool(status & 4), hint[4])
    return (*shoulder, q4, *wrist)


def _next(one: Vec, other: Vec, a: float, b: float) -> Vec:
    """The branch whose first two angles are nearer to (a, b)."""

    def distance(v: Vec) -> float:
        return abs(_wrap(v[0] - a)) + abs(v[1] - b)

    return one if distance(one) <= distance(other) else other


def inside(robot: RobotModel, q: Sequence[float], tolerance: float = 1e-9) -> bool:
    """Whether all joints are within their limits."""
    return all(
        low - tolerance <= value <= high + tolerance
        for low, value, high in zip(robot.q_min.tolist(), q, robot.q_max.tolist(), strict=True)
    )


def status_of(robot: RobotModel, q: Sequence[float]) -> int:
    """Status bits of a joint position."""
    columns, p = flange(robot, q)
    w = _wrist(robot, _rows(columns), p)
    behind = w[0] * cos(q[0]) + w[1] * sin(q[0]) < -SINGULAR
    return behind | (q[3] < 0) << 1 | (q[5] <= 0) << 2


def _rows(columns: Columns) -> Rows:
    x, y, z = columns
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


def arm_angle(robot: RobotModel, q: Sequence[float], behind: bool) -> float:
    """E1 [rad] of a joint position, against the reference arm of Status bit 0 = `behind`."""
    columns, p = flange(robot, q)
    w = _wrist(robot, _rows(columns), p)
    length = sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    a1, a2 = _reference(robot, w, q[3], behind)
    c, s = cos(q[2]), sin(q[2])
    turned = _times(
        _times(_zy(q[0], q[1]), ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))), _transposed(_zy(a1, a2))
    )
    axial = (turned[2][1] - turned[1][2]) * w[0] + (turned[0][2] - turned[2][0]) * w[1]
    axial += (turned[1][0] - turned[0][1]) * w[2]
    return atan2(axial / length, turned[0][0] + turned[1][1] + turned[2][2] - 1.0)


def intervals(robot: RobotModel, pose: Pose | Array, status: int) -> list[tuple[float, float]]:
    """Arm angles at which a flange pose can be held in a Status within the joint limits.

    Args:
        robot: the robot.
        pose: of the flange in the base frame.
        status: bits 0-2.

    Returns:
        Closed intervals of E1 [rad], ascending, the lower end in (-pi, pi]; one that passes through pi goes
        on above it.

    Raises:
        Unreachable: out of reach.
    """
    r, p = rows(pose)
    return _intervals(instance(robot, RobotModel, "robot"), r, p, integer(status, "status", 0, 7))


def _intervals(robot: RobotModel, r: Rows, p: Vec, status: int) -> list[tuple[float, float]]:
    w = _wrist(robot, r, p)
    q4 = _elbow(robot, w)
    if status & 2:
        q4 = -q4
    if abs(q4) > robot.q_max[3] + 1e-9:
        return []
    u = np.array(w) / sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    reference = np.array(_zy(*_reference(robot, w, q4, bool(status & 1))))

    def feasible(e1: float) -> bool:
        return inside(robot, raw(robot, r, p, e1, status))

    marks = events(robot, u, reference, np.array(r), q4)
    if not marks:
        return [(-pi, pi)] if feasible(0.0) else []
    pairs = list(zip(marks, [*marks[1:], marks[0] + 2 * pi], strict=True))
    found: list[tuple[float, float]] = []
    for low, high in pairs:
        if not feasible((low + high) / 2):
            continue
        if found and low - found[-1][1] <= _NARROW:
            found[-1] = (found[-1][0], high)
        else:
            found.append((low, high))
    # the last interval may end where the first begins, one turn on
    if len(found) > 1 and found[0][0] + 2 * pi - found[-1][1] <= _NARROW:
        first = found.pop(0)
        found[-1] = (found[-1][0], first[1] + 2 * pi)
    return found
