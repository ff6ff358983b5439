"""Rigid-body dynamics of an LBR: M(q) ddq + C(q, dq) dq + g(q) = tau.

`native/dynamics.h` computes it by the recursion of Newton and Euler (Featherstone, "Rigid Body Dynamics
Algorithms", 2008, chapter 5), and C by the Jacobians of the links (Siciliano, Sciavicco, Villani, Oriolo,
"Robotics", 2009, section 7.1): with it the matrix dM/dt - 2 C is skew-symmetric. Rotor inertia is not in it, and
friction only as you give it: the torque sensors sit behind the gears. The link data are nominal, see
`heptarm.values.robot`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from heptarm.model.native import Joints, Reals, Square, Vector, one, reals, values_of
from heptarm.values.checks import Array, array, frozen, instance
from heptarm.values.robot import Body, Friction, RobotModel

#: Acceleration of gravity in the frame of an upright base [m/s²].
GRAVITY = (0.0, 0.0, -9.81)
#: Inertia that a motor is assumed to show behind its gear and its torque control, as in the simulator [kg m²].
ROTOR = 0.1

_STILL = Joints()
_WEIGHTLESS = Vector()


@lru_cache(maxsize=64)
def rigid_bodies(robot: RobotModel, load: Body | None = None, *, rotor: float = 0.0) -> Array:
    """`struct robot` of dynamics.h: the links, the load on the flange, the inertia of the motors; shape (105,).

    Args:
        robot: the robot.
        load: on the flange.
        rotor: inertia that each motor shows behind its gear [kg m²].
    """
    links = instance(robot, RobotModel, "robot").links
    inertia = links.inertia.reshape(7, 9)[:, [0, 4, 8, 1, 2, 5]]
    body = Body(0.0, np.zeros(3)) if load is None else instance(load, Body, "load")
    parts = (
        *(links.origin, links.mass, links.com, inertia, links.flange),
        *([body.mass], body.com, body.inertia, [rotor]),
    )
    return frozen(np.concatenate([np.ravel(part) for part in parts]))


def _bodies(robot: RobotModel, load: Body | None) -> Reals:
    return _in_c(instance(robot, RobotModel, "robot"), load)


@lru_cache(maxsize=64)
def _in_c(robot: RobotModel, load: Body | None) -> Reals:
    return reals(rigid_bodies(robot, load))


def _joints(value: npt.ArrayLike, name: str) -> Reals:
    return Joints(*array(value, 7, name).tolist())


def _fall(acceleration: npt.ArrayLike) -> Reals:
    return Vector(*array(acceleration, 3, "acceleration").tolist())


def mass_matrix(robot: RobotModel, q: npt.ArrayLike, *, load: Body | None = None) -> Array:
    """Mass matrix M(q).

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        load: on the flange.

    Returns:
        Shape (7, 7) [kg m²], symmetric and positive definite.
    """
    found = Square()
    one().hd_mass_matrix(_bodies(robot, load), _joints(q, "q"), found)
    return values_of(found).reshape(7, 7)


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
    found = Square()
    one().hd_coriolis_matrix(_bodies(robot, load), _joints(q, "q"), _joints(dq, "dq"), found)
    return values_of(found).reshape(7, 7)


def centrifugal_matrix(robot: RobotModel, q: npt.ArrayLike, *, load: Body | None = None) -> Array:
    """Matrix B(q) of the centrifugal torques B dq²: column i has the torques of joint i turning alone at 1 rad/s.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        load: on the flange.

    Returns:
        Shape (7, 7) [Nm s²/rad²].
    """
    return np.column_stack([coriolis(robot, q, alone, load=load) for alone in np.eye(7)])


def coriolis(robot: RobotModel, q: npt.ArrayLike, dq: npt.ArrayLike, *, load: Body | None = None) -> Array:
    """Coriolis and centrifugal torques C(q, dq) dq, shape (7,) [Nm]; arguments as for `coriolis_matrix`."""
    return _torques(robot, q, _joints(dq, "dq"), _STILL, _WEIGHTLESS, load)


def _torques(
    robot: RobotModel, q: npt.ArrayLike, dq: Reals, ddq: Reals, fall: Reals, load: Body | None
) -> Array:
    found = Joints()
    one().hd_inverse(_bodies(robot, load), _joints(q, "q"), dq, ddq, fall, found)
    return values_of(found)


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
    return _torques(robot, q, _STILL, _STILL, _fall(acceleration), load)


def inverse_dynamics(
    robot: RobotModel,
    q: npt.ArrayLike,
    dq: npt.ArrayLike,
    ddq: npt.ArrayLike,
    *,
    load: Body | None = None,
    acceleration: npt.ArrayLike = GRAVITY,
    friction: Friction | None = None,
) -> Array:
    """Inverse dynamics: joint torques M ddq + C dq + g, and the friction.

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        dq: joint velocities, shape (7,) [rad/s].
        ddq: joint accelerations, shape (7,) [rad/s²].
        load: on the flange.
        acceleration: of gravity in the base frame, shape (3,) [m/s²].
        friction: of the joints; None: without.

    Returns:
        Shape (7,) [Nm].
    """
    rigid = _torques(robot, q, _joints(dq, "dq"), _joints(ddq, "ddq"), _fall(acceleration), load)
    return rigid + _friction(friction, dq)


def inverse_dynamics_rows(
    robot: RobotModel,
    q: Array,
    dq: Array,
    ddq: Array,
    *,
    load: Body | None = None,
    acceleration: npt.ArrayLike = GRAVITY,
) -> Array:
    """`inverse_dynamics` without friction of many moments, unchecked: arguments and result of shape (n, 7)."""
    bodies, fall, found, result = _bodies(robot, load), _fall(acceleration), Joints(), np.empty((len(q), 7))
    function = one().hd_inverse
    for index, row in enumerate(np.concatenate([q, dq, ddq], axis=1).tolist()):
        function(bodies, Joints(*row[:7]), Joints(*row[7:14]), Joints(*row[14:]), fall, found)
        result[index] = found
    return result


def _friction(friction: Friction | None, dq: npt.ArrayLike) -> Array:
    return np.zeros(7) if friction is None else instance(friction, Friction, "friction").torque(dq)


def forward_dynamics(
    robot: RobotModel,
    q: npt.ArrayLike,
    dq: npt.ArrayLike,
    tau: npt.ArrayLike,
    *,
    load: Body | None = None,
    acceleration: npt.ArrayLike = GRAVITY,
    friction: Friction | None = None,
) -> Array:
    """Forward dynamics: joint accelerations M^-1 (tau - C dq - g - friction).

    Args:
        robot: the robot.
        q: joint positions, shape (7,) [rad].
        dq: joint velocities, shape (7,) [rad/s].
        tau: joint torques, shape (7,) [Nm].
        load: on the flange.
        acceleration: of gravity in the base frame, shape (3,) [m/s²].
        friction: of the joints; None: without.

    Returns:
        Shape (7,) [rad/s²].
    """
    bodies, angles, rates = _bodies(robot, load), _joints(q, "q"), _joints(dq, "dq")
    driving = array(tau, 7, "tau") - _friction(friction, dq)
    found = Joints()
    one().hd_forward(bodies, angles, rates, Joints(*driving.tolist()), _fall(acceleration), found)
    return values_of(found)
