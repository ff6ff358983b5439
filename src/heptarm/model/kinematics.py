"""Forward kinematics and Jacobian of an LBR.

The chain is Rz(A1) Ry(A2) Rz(A3) Ry(-A4) Rz(A5) Ry(A6) Rz(A7) with all offsets along z: base to shoulder, to
elbow, to wrist, to flange. `native/kinematics.h` computes it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heptarm.errors import ShapeError
from heptarm.model.native import Jacobian, Joints, Matrix, Reals, Vector, Vectors, constants, one, values_of
from heptarm.values.checks import Array, array, instance, integer
from heptarm.values.robot import RobotModel

Vec: TypeAlias = tuple[float, float, float]
#: Columns of a rotation matrix.
Columns: TypeAlias = tuple[Vec, Vec, Vec]


def flange(robot: RobotModel, q: Sequence[float]) -> tuple[Columns, Vec]:
    """Columns of the flange's rotation and its position [m] in the base frame; plain floats, for the tick."""
    found = Matrix()
    one().hk_forward(constants(robot), 1, Joints(*q), found)
    a, b, c, x, d, e, f, y, g, h, i, z, *_ = found[:]
    return ((a, d, g), (b, e, h), (c, f, i)), (x, y, z)


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
    angles, found = Joints(*array(q, 7, "q").tolist()), Matrix()
    if link is None:
        one().hk_forward(constants(robot), 1, angles, found)
    else:
        origins = Vectors(*robot.links.origin.ravel().tolist())
        one().hk_link(origins, angles, integer(link, "link", 1, 7), found)
    return values_of(found).reshape(4, 4)


def joints(robot: RobotModel, q: Sequence[float]) -> tuple[list[Vec], list[Vec], Vec]:
    """Axes and points of the seven joints in the base frame, and the flange's position."""
    axes, points, tip = Vectors(), Vectors(), Vector()
    one().hk_joints(constants(robot), Joints(*q), axes, points, tip)
    return _vectors(axes), _vectors(points), (tip[0], tip[1], tip[2])


def _vectors(flat: Reals) -> list[Vec]:
    numbers = list(flat)
    return list(zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True))


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
    given = Joints(*array(q, 7, "q").tolist())
    found = Jacobian()
    target = None if point is None else Vector(*array(point, 3, "point").tolist())
    one().hk_jacobian(constants(robot), 1, given, target, found)
    result = values_of(found).reshape(6, 7)
    result[:, link:] = 0.0
    return result


def jacobian_derivative(robot: RobotModel, q: npt.ArrayLike, dq: npt.ArrayLike) -> Array:
    """Time derivative of the flange's Jacobian along dq [rad/s], shape (6, 7), base axes.

    dz_i = w_i x z_i with w_i the velocity of the link that carries axis i; the lever's derivative is the
    difference of the tip's and the point's velocities.
    """
    instance(robot, RobotModel, "robot")
    axes, points, tip = joints(robot, array(q, 7, "q").tolist())
    z, p, rates = np.array(axes), np.array(points), array(dq, 7, "dq")
    lever = np.asarray(tip) - p
    spin = np.vstack([np.zeros(3), np.cumsum(z * rates[:, None], axis=0)[:-1]])
    dz = np.cross(spin, z)
    tip_velocity = np.cross(z, lever).T @ rates
    point_velocity = np.array(
        [sum((rates[j] * np.cross(z[j], p[i] - p[j]) for j in range(i)), np.zeros(3)) for i in range(7)]
    )
    return np.vstack([(np.cross(dz, lever) + np.cross(z, tip_velocity - point_velocity)).T, dz.T])


def nullspace(robot: RobotModel, q: npt.ArrayLike) -> Array:
    """Projector on the joint motions that do not move the flange, N = 1 - J^+ J, shape (7, 7)."""
    j = jacobian(robot, q)
    return np.eye(7) - np.linalg.pinv(j) @ j


def manipulability(robot: RobotModel, q: npt.ArrayLike) -> float:
    """Yoshikawa's measure sqrt(det(J Jᵀ)); 0 at a singularity."""
    j = jacobian(robot, q)
    return float(np.sqrt(max(0.0, np.linalg.det(j @ j.T))))
