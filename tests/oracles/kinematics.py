"""Forward kinematics and Jacobian of an LBR in Python: what `native/kinematics.h` is compared with.

The chain is Rz(A1) Ry(A2) Rz(A3) Ry(-A4) Rz(A5) Ry(A6) Rz(A7) with all offsets along z: base to shoulder, to
elbow, to wrist, to flange. A rotation about z or y mixes two columns of the rotation matrix, so the product
is six sums a joint; it is written with plain floats because numpy's overhead on 3x3 matrices is ten times
its work.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.values.checks import Array, array, instance, integer
from heptarm.values.robot import RobotModel

Vec: TypeAlias = tuple[float, float, float]
#: Columns of a rotation matrix.
Columns: TypeAlias = tuple[Vec, Vec, Vec]


def _mix(u: Vec, v: Vec, c: float, s: float) -> Vec:
    return (c * u[0] + s * v[0], c * u[1] + s * v[1], c * u[2] + s * v[2])


def _turn_z(m: Columns, angle: float) -> Columns:
    """M Rz(angle)."""
    c, s = cos(angle), sin(angle)
    return _mix(m[0], m[1], c, s), _mix(m[1], m[0], c, -s), m[2]


def _turn_y(m: Columns, angle: float) -> Columns:
    """M Ry(angle)."""
    c, s = cos(angle), sin(angle)
    return _mix(m[0], m[2], c, -s), m[1], _mix(m[2], m[0], c, s)


def _along(p: Vec, d: Vec, length: float) -> Vec:
    return (p[0] + length * d[0], p[1] + length * d[1], p[2] + length * d[2])


_IDENTITY: Columns = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def flange(robot: RobotModel, q: Sequence[float]) -> tuple[Columns, Vec]:
    """Columns of the flange's rotation and its position [m] in the base frame; plain floats, for the tick."""
    m = _turn_y(_turn_z(_IDENTITY, q[0]), q[1])
    p = _along((0.0, 0.0, robot.d_bs), m[2], robot.d_se)
    m = _turn_y(_turn_z(m, q[2]), -q[3])
    p = _along(p, m[2], robot.d_ew)
    m = _turn_y(_turn_z(m, q[4]), q[5])
    p = _along(p, m[2], robot.d_wf)
    return _turn_z(m, q[6]), p


def forward(robot: RobotModel, q: npt.ArrayLike, *, link: int | None = None) -> Array:
    """Pose of the flange, or of a link, in the base frame.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        link: 1 to 7: the frame of this link, at the origin of its joint in `robot.links`; its axes are the base's when
            all joints are at 0. None: the flange.

    Returns:
        Homogeneous matrix, shape (4, 4) [m].

    Raises:
        ShapeError: `q` has not seven entries.
        LimitError: one is not finite, or no such link.
    """
    instance(robot, RobotModel, "robot")
    angles = array(q, 7, "q").tolist()
    if link is not None:
        return _link(robot, angles, integer(link, "link", 1, 7))
    columns, position = flange(robot, angles)
    result = np.eye(4)
    result[:3, :3] = np.array(columns).T
    result[:3, 3] = position
    return result


def _link(robot: RobotModel, q: Sequence[float], link: int) -> Array:
    """Pose of the frame of link 1 to 7, shape (4, 4) [m]."""
    columns, position = _IDENTITY, np.zeros(3)
    for index in range(link):
        position = position + np.array(columns).T @ robot.links.origin[index]
        angle = -q[index] if index == 3 else q[index]
        columns = _turn_z(columns, angle) if index % 2 == 0 else _turn_y(columns, angle)
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = np.array(columns).T, position
    return result


def joints(robot: RobotModel, q: Sequence[float]) -> tuple[list[Vec], list[Vec], Vec]:
    """Axes and points of the seven joints in the base frame, and the flange's position."""
    m0 = _turn_z(_IDENTITY, q[0])
    m1 = _turn_y(m0, q[1])
    m2 = _turn_z(m1, q[2])
    m3 = _turn_y(m2, -q[3])
    m4 = _turn_z(m3, q[4])
    m5 = _turn_y(m4, q[5])
    shoulder = (0.0, 0.0, robot.d_bs)
    elbow = _along(shoulder, m1[2], robot.d_se)
    wrist = _along(elbow, m3[2], robot.d_ew)
    minus_y = (-m2[1][0], -m2[1][1], -m2[1][2])
    axes = [(0.0, 0.0, 1.0), m0[1], m1[2], minus_y, m3[2], m4[1], m5[2]]
    points = [shoulder, shoulder, shoulder, elbow, wrist, wrist, wrist]
    return axes, points, _along(wrist, m5[2], robot.d_wf)


def jacobian(
    robot: RobotModel, q: npt.ArrayLike, point: npt.ArrayLike | None = None, *, link: int = 7
) -> Array:
    """Geometric Jacobian of a point of a link, base axes.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        point: point of the link whose velocity is asked for, in the base frame, shape (3,) [m]; None: the flange.
        link: the link that the point moves with, 1 to 7; the columns of the joints behind it are 0.

    Returns:
        Shape (6, 7): rows vx vy vz [m/rad], wx wy wz.

    Raises:
        ShapeError: a wrong shape, or a link other than the last without a point.
        LimitError: a number is not finite, or no such link.
    """
    instance(robot, RobotModel, "robot")
    if integer(link, "link", 1, 7) < 7 and point is None:
        raise ShapeError(
            f"link {link} must be given with a point of it",
            parameter="point",
            hint=f"for example model.forward(robot, q, link={link})[:3, 3]",
        )
    axes, points, tip = joints(robot, array(q, 7, "q").tolist())
    target = np.asarray(tip) if point is None else array(point, 3, "point")
    z = np.array(axes)
    result = np.vstack([np.cross(z, target - np.array(points)).T, z.T])
    result[:, link:] = 0.0
    return result
