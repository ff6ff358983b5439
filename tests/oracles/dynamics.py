"""Rigid-body dynamics of an LBR in Python, with which `native/dynamics.h` is compared.

Newton's and Euler's laws of every link, projected on the joints by the Jacobians Jv, Jw of its centre of mass
(Siciliano, Sciavicco, Villani, Oriolo, "Robotics", 2009, section 7.1):

    M = sum m Jv' Jv + Jw' I Jw
    C = sum m Jv' dJv + Jw' (I dJw + [w] I Jw)
    g = - sum m Jv' g0

With this C the matrix dM/dt - 2 C is skew-symmetric. Rotor inertia is not in it, and friction only as you give it: the
torque sensors sit behind the gears. The link data are nominal, see `heptarm.values.robot`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from heptarm.values.checks import Array, array, instance
from heptarm.values.robot import Body, RobotModel, symmetric

#: Acceleration of gravity in the frame of an upright base [m/s²].
GRAVITY = (0.0, 0.0, -9.81)

_Y, _Z = 1, 2
# axis of each joint in its link, and its sign
_AXES = ((_Z, 1.0), (_Y, 1.0), (_Z, 1.0), (_Y, -1.0), (_Z, 1.0), (_Y, 1.0), (_Z, 1.0))


@dataclass(frozen=True, slots=True)
class _Posture:
    """Joints and bodies in the base frame; n bodies: seven links and perhaps a load.

    `axis` and `origin` of the joints have shape (7, 3); `mass` (n,), `com` (n, 3), `inertia` (n, 3, 3) of the bodies;
    `moves` (n, 7) is 1 where a joint moves a body.
    """

    axis: Array
    origin: Array
    mass: Array
    com: Array
    inertia: Array
    moves: Array

    @property
    def linear(self) -> Array:
        """Jacobians of the centres of mass, shape (n, 7, 3)."""
        lever = self.com[:, None, :] - self.origin[None, :, :]
        return np.cross(self.axis[None, :, :], lever) * self.moves[:, :, None]

    @property
    def angular(self) -> Array:
        """Jacobians of the rotations, shape (n, 7, 3)."""
        result: Array = self.axis[None, :, :] * self.moves[:, :, None]
        return result


def _posture(robot: RobotModel, q: npt.ArrayLike, load: Body | None) -> _Posture:
    links = instance(robot, RobotModel, "robot").links
    turn, place = np.eye(3), np.zeros(3)
    turns, axis, origin = np.empty((7, 3, 3)), np.empty((7, 3)), np.empty((7, 3))
    for index, angle in enumerate(array(q, 7, "q").tolist()):
        direction, sign = _AXES[index]
        place = place + turn @ links.origin[index]
        turn = turn @ _about(direction, sign * angle)
        turns[index], axis[index], origin[index] = turn, sign * turn[:, direction], place
    mass, inertia = links.mass, turns @ links.inertia @ turns.transpose(0, 2, 1)
    com = origin + (turns @ links.com[:, :, None])[:, :, 0]
    moves = np.tri(7)
    if load is not None:
        instance(load, Body, "load")
        at_flange = place + turn @ (links.flange + load.com)
        mass, com = np.append(mass, load.mass), np.vstack([com, at_flange])
        inertia = np.concatenate([inertia, (turn @ symmetric(load.inertia) @ turn.T)[None]])
        moves = np.vstack([moves, np.ones(7)])
    return _Posture(axis, origin, mass, com, inertia, moves)


def _about(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    if axis == _Z:
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _mass_matrix(posture: _Posture) -> Array:
    jv, jw = posture.linear, posture.angular
    result: Array = np.einsum("n,nia,nja->ij", posture.mass, jv, jv)
    result += np.einsum("nia,nab,njb->ij", jw, posture.inertia, jw)
    return result


def mass_matrix(robot: RobotModel, q: npt.ArrayLike, *, load: Body | None = None) -> Array:
    """Mass matrix M(q).

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        load: on the flange.

    Returns:
        Shape (7, 7) [kg m²], symmetric and positive definite.
    """
    return _mass_matrix(_posture(robot, q, load))


def _coriolis_matrix(posture: _Posture, dq: Array) -> Array:
    axis, origin = posture.axis, posture.origin
    jv, jw = posture.linear, posture.angular
    # what carries axis j turns with the joints before it
    carrier = np.vstack([np.zeros(3), np.cumsum(axis * dq[:, None], axis=0)[:-1]])
    axis_rate = np.cross(carrier, axis)
    before = np.tri(7, k=-1)[:, :, None]  # joint i moves the origin of joint j if i < j
    between = np.cross(axis[None, :, :], origin[:, None, :] - origin[None, :, :]) * before
    origin_rate = np.einsum("jia,i->ja", between, dq)
    com_rate = np.einsum("nja,j->na", jv, dq)
    lever = posture.com[:, None, :] - origin[None, :, :]
    lever_rate = com_rate[:, None, :] - origin_rate[None, :, :]
    djv = np.cross(axis_rate[None], lever) + np.cross(axis[None], lever_rate)
    djv *= posture.moves[:, :, None]
    djw = axis_rate[None] * posture.moves[:, :, None]
    spin = np.einsum("nja,j->na", jw, dq)
    momentum = np.einsum("nab,njb->nja", posture.inertia, jw)
    turning = np.einsum("nab,njb->nja", posture.inertia, djw) + np.cross(spin[:, None, :], momentum)
    result: Array = np.einsum("n,nia,nja->ij", posture.mass, jv, djv)
    result += np.einsum("nia,nja->ij", jw, turning)
    return result


def coriolis_matrix(
    robot: RobotModel, q: npt.ArrayLike, dq: npt.ArrayLike, *, load: Body | None = None
) -> Array:
    """Matrix C(q, dq) of the Coriolis and centrifugal torques C dq; dM/dt - 2 C is skew-symmetric.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        dq: joint velocities, shape (7,) [rad/s].
        load: on the flange.

    Returns:
        Shape (7, 7) [Nm s/rad].
    """
    return _coriolis_matrix(_posture(robot, q, load), array(dq, 7, "dq"))


def coriolis(robot: RobotModel, q: npt.ArrayLike, dq: npt.ArrayLike, *, load: Body | None = None) -> Array:
    """Coriolis and centrifugal torques C(q, dq) dq, shape (7,) [Nm]; arguments as for `coriolis_matrix`."""
    rates = array(dq, 7, "dq")
    return _coriolis_matrix(_posture(robot, q, load), rates) @ rates


def _gravity(posture: _Posture, acceleration: npt.ArrayLike) -> Array:
    held: Array = np.einsum(
        "n,nia,a->i", posture.mass, posture.linear, array(acceleration, 3, "acceleration")
    )
    return -held


def gravity(
    robot: RobotModel, q: npt.ArrayLike, *, load: Body | None = None, acceleration: npt.ArrayLike = GRAVITY
) -> Array:
    """Gravity torques g(q).

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        load: on the flange.
        acceleration: of gravity in the base frame, shape (3,) [m/s²]; another one for a tilted base.

    Returns:
        Shape (7,) [Nm].
    """
    return _gravity(_posture(robot, q, load), acceleration)
