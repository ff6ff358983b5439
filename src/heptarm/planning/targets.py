"""What an order asks for: target joints, path of the tool frame, limits along it.

Speed parameters are applied as the cabinet does: relative ones scale each axis' limit before the smallest counts,
Cartesian ones bound the path.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, isnan, sqrt
from typing import NoReturn

import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.inverse_kinematics import PathInverse, solve
from heptarm.model.kinematics import forward
from heptarm.planning.command import Order, PlanError
from heptarm.planning.composite_path import SegmentLimits, check_limits
from heptarm.planning.geometry import Arc, Geometry, JointOrientation, OrientationPath, Slerp, Straight
from heptarm.planning.path import CartesianPath
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose, multiply, rotation
from heptarm.values.robot import RobotModel

#: Limits of a Cartesian motion whose order names none: m/s, m/s², m/s³ and rad/s, rad/s², rad/s³.
CARTESIAN_DEFAULT = (1.0, 4.0, 40.0)
ORIENTATION_DEFAULT = (1.5, 6.0, 60.0)

#: Kinds of motions on a Cartesian path.
LINES = ("lin", "lin_rel", "circ")
#: A path shorter than this [m or rad] does not move.
STILL = 1e-7
#: Smallest speed, acceleration or jerk: a fraction of the axes' maxima, or along a path in SI units.
SLOWEST = 1e-6
#: Farthest position of a target or of a tool frame [m].
FARTHEST = 100.0


def check_numbers(order: Order) -> None:
    """Refuse speeds and positions that no motion can have, before anything divides by them or squares them."""
    fractions = (*order.joint_velocity, *order.joint_acceleration, *order.joint_jerk)
    line = (order.cart_velocity, order.cart_acceleration, order.cart_jerk)
    turn = (order.ori_velocity, order.ori_acceleration, order.ori_jerk)
    for value in fractions:
        if not SLOWEST <= value <= 1.0:
            _refuse_number("relative speeds", value, f"in [{SLOWEST:g}, 1]")
    for value in (*line, *turn):
        if not (isnan(value) or SLOWEST <= value < inf):
            _refuse_number("Cartesian speeds", value, f"finite and at least {SLOWEST:g}")
    for place in (order.pose, order.via, order.offset, order.tcp):
        for value in place or ():
            if not abs(value) <= FARTHEST:
                _refuse_number("positions", value, f"in [{-FARTHEST:g}, {FARTHEST:g}] m")


def _refuse_number(what: str, value: float, allowed: str) -> NoReturn:
    raise PlanError("planning", f"Can not plan motion: {what} must be {allowed}, got {value:g}")


def _pose(values: tuple[float, ...]) -> Pose:
    return Pose.of(values[:3], values[3:])


def joint_target(robot: RobotModel, order: Order, start: Array) -> Array:
    """Joint positions at the end of a ptp, shape (7,) [rad].

    Raises:
        PlanError: they are outside the limits, or the pose is not reachable.
    """
    if order.joints is not None:
        target = np.array(order.joints)
    else:
        assert order.pose is not None
        e1, status, _ = order.redundancy
        try:
            target = solve(
                robot,
                _pose(order.pose) @ _pose(order.tcp).inverse(),
                e1=None if isnan(e1) else e1,
                status=None if status < 0 else status,
                near=start.tolist(),
            )
        except Unreachable as error:
            raise PlanError(
                "unreachable", f"Can not plan motion: frame is not reachable: {error.text}"
            ) from None
    check_limits(robot, target)
    return target


def _target(order: Order, origin: Pose) -> Pose:
    if order.offset is None:
        assert order.pose is not None
        return _pose(order.pose)
    offset = _pose(order.offset)
    if order.reference is None:
        return origin @ offset
    axes = np.array(order.reference)
    back = axes * np.array([-1.0, -1.0, -1.0, 1.0])
    turn = multiply(multiply(axes, offset.quat), back)
    return Pose(origin.xyz + rotation(axes) @ offset.xyz, multiply(turn, origin.quat))


def geometry_of(robot: RobotModel, order: Order, start: Array, origin: Pose) -> Geometry:
    """Path of the tool frame of a lin, lin_rel or circ that begins at a pose.

    Raises:
        PlanError: there is no such arc, or no joint position at its end.
    """
    target, control = _target(order, origin), order.orientation
    if control.type == "ignore":
        raise PlanError(
            "planning",
            "Can not plan motion: only a spline segment may ignore its orientation; use variable, constant or joint",
        )
    turn: OrientationPath | None = None
    if control.type == "joint":
        turn = _joint_orientation(robot, order, start, target)
    if order.kind == "circ":
        assert order.via is not None
        arc = Arc(origin.xyz, _pose(order.via).xyz, target.xyz)
        if turn is None:
            return arc.oriented(origin.quat, target.quat, control)
        return arc.turning(turn, follows=False)
    if turn is None:
        turn = Slerp(origin.quat, origin.quat if control.type == "constant" else target.quat)
    return Straight(origin.xyz, target.xyz, turn)


def _joint_orientation(robot: RobotModel, order: Order, start: Array, target: Pose) -> JointOrientation:
    """The orientation as a PTP to the target would turn it."""
    tcp = _pose(order.tcp)
    e1, _, _ = order.redundancy
    place = target @ tcp.inverse()
    try:
        end = PathInverse(robot, Pose()).joints(place.xyz.tolist(), place.quat.tolist(), start, a3=e1)
    except Unreachable as error:
        raise PlanError("unreachable", f"Can not plan motion: frame is not reachable: {error.text}") from None
    return JointOrientation(robot, start, end, tcp.quat)


def cartesian_path(robot: RobotModel, order: Order, start: Array) -> CartesianPath:
    """Path of a lin, lin_rel or circ.

    Raises:
        PlanError: see `geometry_of`.
    """
    tcp = _pose(order.tcp)
    geometry = geometry_of(robot, order, start, Pose.from_matrix(forward(robot, start)) @ tcp)
    return CartesianPath(
        robot, start, geometry, tcp, None if isnan(order.redundancy[0]) else order.redundancy[0]
    )


def or_default(value: float, default: float) -> float:
    """A value of a command; the default where it is NaN."""
    return default if isnan(value) else value


def programmed_speed(order: Order, path: CartesianPath) -> float:
    """Largest ds/dt that an order allows along its path; infinite where only the elbow moves."""
    speeds = (
        (or_default(order.cart_velocity, CARTESIAN_DEFAULT[0]), path.length),
        (or_default(order.ori_velocity, ORIENTATION_DEFAULT[0]), path.angle),
    )
    fastest = min((speed / size for speed, size in speeds if size > STILL), default=inf)
    if isinstance(path.geometry, Arc):
        acceleration = or_default(order.cart_acceleration, CARTESIAN_DEFAULT[1])
        fastest = min(fastest, sqrt(acceleration * path.geometry.radius) / path.length)
    return fastest


def segment_limits(order: Order) -> SegmentLimits:
    """What an order allows, beside its speed along the path."""
    joints = SegmentLimits(
        np.array(order.joint_velocity), np.array(order.joint_acceleration), np.array(order.joint_jerk)
    )
    if order.kind not in (*LINES, "spl"):
        return joints
    _, *line = CARTESIAN_DEFAULT
    _, *turn = ORIENTATION_DEFAULT
    return replace(
        joints,
        line=(or_default(order.cart_acceleration, line[0]), or_default(order.cart_jerk, line[1])),
        turn=(or_default(order.ori_acceleration, turn[0]), or_default(order.ori_jerk, turn[1])),
    )
