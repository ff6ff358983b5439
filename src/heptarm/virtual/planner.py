"""Turns an order into a path and a profile, or refuses it with a text of the kind that Sunrise gives.

KUKA's speed parameters are applied as the cabinet does: relative ones scale each axis' limit before the
smallest counts, Cartesian ones bound the path. Where the joints could not follow a Cartesian path at the
programmed speed, the whole path is slowed down.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan, sqrt

import numpy as np

from heptarm.errors import CommandRejected, Unreachable
from heptarm.model import inverse
from heptarm.model.kinematics import forward
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose, multiply, rotation
from heptarm.values.robot import RobotModel
from heptarm.virtual.arc import Arc
from heptarm.virtual.chain import Halts
from heptarm.virtual.geometry import Geometry, JointTurn, Slerp, Straight, Turn
from heptarm.virtual.order import Order, PlanError
from heptarm.virtual.path import CartesianPath, JointLine, JointPath
from heptarm.virtual.profile import Limits, Profile, TimeLaw, travel
from heptarm.virtual.way import Way

#: What a Cartesian motion does where its order says nothing: m/s, m/s², m/s³ and rad/s, rad/s², rad/s³.
CARTESIAN_DEFAULT = (1.0, 4.0, 40.0)
ORIENTATION_DEFAULT = (1.5, 6.0, 60.0)

_SAMPLES = 101
_LARGEST_STEP = 0.35  # rad between two samples; more is a jump to another branch
_RESERVE = 0.7  # share of an axis' acceleration for s'' and for the path's curvature each
_NEVER = 1e9


@dataclass(frozen=True, slots=True)
class Plan:
    """A motion that can be carried out.

    Attributes:
        order: what was asked.
        start: joint positions it begins at, shape (7,) [rad].
        end: joint positions it ends at, shape (7,) [rad].
        path: joint positions over s; None for a hold.
        profile: s over time; None for a hold.
        braking: limits of s when it is cancelled.
        halts: of a path with parts: where it rests on the way, and its limits of s when it is cancelled.
        marks: s at which the parts of a batch or a spline begin, without the first.
        way: of the moved frame; None: it was not measured.
    """

    order: Order
    start: Array
    end: Array
    path: JointPath | None
    profile: TimeLaw | None
    braking: Limits
    halts: Halts | None = None
    marks: tuple[float, ...] = ()
    way: Way | None = None

    @property
    def duration(self) -> float:
        """Time at full speed [s]; infinite for an endless hold."""
        if self.profile is not None:
            return self.profile.duration
        return _NEVER if isnan(self.order.duration) else self.order.duration

    def span(self, part: int) -> tuple[float, float]:
        """Path parameter at which a part begins and ends; -1: the whole."""
        marks = (0.0, *self.marks, 1.0)
        return (0.0, 1.0) if part < 0 else (marks[part], marks[part + 1])

    def progress(self, s: float, part: int) -> float:
        """How far a motion of a batch has come at s, 0 to 1; a motion by itself is its only part."""
        low, high = self.span(part if self.order.kind == "batch" else -1)
        return min(1.0, max(0.0, (s - low) / (high - low))) if high > low else 1.0


def plan(robot: RobotModel, order: Order, start: Array) -> Plan:
    """Plan an order from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a joint limit, an unreachable pose, a path that cannot be led, or values that make no sense.
    """
    try:
        return _plan(robot, order, start)
    except CommandRejected as error:
        raise PlanError("planning", f"Can not plan motion: {error}") from None


def _plan(robot: RobotModel, order: Order, start: Array) -> Plan:
    check_speeds(order)
    if order.kind in ("hold", "guide") or order.is_servo:
        return Plan(order, start, start, None, None, Limits(1.0, 1.0, 1.0))
    if order.kind == "ptp":
        return _plan_joints(robot, order, start, joint_target(robot, order, start))
    if order.kind in ("lin", "lin_rel", "circ"):
        return _plan_path(robot, order, start)
    raise PlanError("planning", f"Can not plan motion: no motion of kind {order.kind!r}")


def check_speeds(order: Order) -> None:
    """Refuse speeds that no profile can have; the upper end is the caller's business."""
    fractions = (*order.joint_velocity, *order.joint_acceleration, *order.joint_jerk)
    if not all(0.0 < value <= 1.0 for value in fractions):
        raise PlanError("planning", "Can not plan motion: relative speeds are greater than 0 and at most 1")
    line = (order.cart_velocity, order.cart_acceleration, order.cart_jerk)
    turn = (order.ori_velocity, order.ori_acceleration, order.ori_jerk)
    if not all(isnan(value) or 0.0 < value < inf for value in (*line, *turn)):
        raise PlanError("planning", "Can not plan motion: Cartesian speeds are finite and greater than 0")


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
            target = inverse.solve(
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


def check_limits(robot: RobotModel, q: Array) -> None:
    """Refuse joint positions that the robot cannot have."""
    outside = [i for i in range(7) if not robot.q_min[i] - 1e-9 <= q[i] <= robot.q_max[i] + 1e-9]
    if outside:
        axes = " ".join(f"A{i + 1}" for i in outside)
        values = ", ".join(
            f"A{i + 1} = {value:.2f} deg of [{low:.0f}, {high:.0f}]"
            for i in outside
            for value, low, high in [np.degrees([q[i], robot.q_min[i], robot.q_max[i]])]
        )
        raise PlanError(
            "joint_limit", f"Can not plan motion: Command Position violates limit {axes} ({values})"
        )


def _plan_joints(robot: RobotModel, order: Order, start: Array, end: Array) -> Plan:
    path = JointLine(start, end)
    way = np.maximum(np.abs(path.way), 1e-12)
    full = Limits(
        float((robot.dq_max / way).min()),
        float((robot.ddq_max / way).min()),
        float((robot.dddq_max / way).min()),
    )
    limits = Limits(
        float((robot.dq_max * order.joint_velocity / way).min()),
        float((robot.ddq_max * order.joint_acceleration / way).min()),
        float((robot.dddq_max * order.joint_jerk / way).min()),
    )
    if float(np.abs(path.way).max()) < 1e-9:
        return Plan(order, start, end, None, None, full)
    return Plan(order, start, end, path, travel(limits), full)


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
    """Way of the moved frame of a lin, lin_rel or circ from a pose, its orientation led as the order says.

    Raises:
        PlanError: there is no such arc, or no joint position at its end.
    """
    target, led = _target(order, origin), order.orientation
    if led.type == "ignore":
        raise PlanError("planning", "Can not plan motion: the orientation of a motion by itself cannot be ignored")
    turn: Turn | None = _joint_turn(robot, order, start, target) if led.type == "joint" else None
    if order.kind == "circ":
        assert order.via is not None
        arc = Arc(origin.xyz, _pose(order.via).xyz, target.xyz)
        if turn is None:
            return arc.led(origin.quat, target.quat, led)
        return arc.turning(turn, follows=False)
    if turn is None:
        turn = Slerp(origin.quat, origin.quat if led.type == "constant" else target.quat)
    return Straight(origin.xyz, target.xyz, turn)


def _joint_turn(robot: RobotModel, order: Order, start: Array, target: Pose) -> Turn:
    """The orientation as the joints turn it on their way to the target."""
    tcp = _pose(order.tcp)
    e1, _, _ = order.redundancy
    own = inverse.redundancy(robot, start.tolist())
    r, p = inverse.rows(target @ tcp.inverse())
    try:
        end = inverse.raw(
            robot, r, p, own.e1 if isnan(e1) else e1, own.status, start.tolist(), continuous=True
        )
    except Unreachable as error:
        raise PlanError("unreachable", f"Can not plan motion: frame is not reachable: {error.text}") from None
    return JointTurn(robot, start, np.array(end), tcp.quat)


def cartesian_path(robot: RobotModel, order: Order, start: Array) -> CartesianPath:
    """Path of a lin, lin_rel or circ.

    Raises:
        PlanError: see `geometry_of`.
    """
    tcp = _pose(order.tcp)
    geometry = geometry_of(robot, order, start, Pose.from_matrix(forward(robot, start)) @ tcp)
    return CartesianPath(robot, start, geometry, tcp, None if isnan(order.redundancy[0]) else order.redundancy[0])


def _plan_path(robot: RobotModel, order: Order, start: Array) -> Plan:
    path, e1 = cartesian_path(robot, order, start), order.redundancy[0]
    samples = _sample(robot, path)
    if path.length < 1e-7 and path.angle < 1e-7 and isnan(e1):
        return Plan(order, start, start, None, None, Limits(1.0, 1.0, 1.0))
    wanted = cartesian_limits(order, path)
    shares = [np.array(x) for x in (order.joint_velocity, order.joint_acceleration, order.joint_jerk)]
    possible = _joint_limits(robot, samples, *shares)
    braking = _joint_limits(robot, samples, np.ones(7), np.ones(7), np.ones(7))
    profile = _gently(robot, order, samples, wanted.least(possible))
    return Plan(order, start, samples[-1], path, profile, braking)


def _gently(robot: RobotModel, order: Order, samples: Array, limits: Limits) -> Profile:
    """The profile for these limits, slowed down as a whole where an axis' jerk would be too great.

    The jerk of q(s(t)) goes with the cube of time's scale; it has one part each from q', q'' and the third derivative.
    """
    profile = travel(limits)
    times = np.linspace(0.0, profile.duration, _SAMPLES)
    s, speed, acceleration = np.array([profile.at(t) for t in times.tolist()]).T
    jerk = np.gradient(acceleration, times)
    step = 1.0 / (_SAMPLES - 1)
    first = np.gradient(samples, step, axis=0)
    second = np.gradient(first, step, axis=0)
    third = np.gradient(second, step, axis=0)
    at = np.clip(np.rint(s / step).astype(int), 0, _SAMPLES - 1)
    joints = first[at] * jerk[:, None] + 3 * second[at] * (speed * acceleration)[:, None]
    joints += third[at] * (speed**3)[:, None]
    excess = float((np.abs(joints) / (robot.dddq_max * np.array(order.joint_jerk))).max())
    if excess <= 1.0:
        return profile
    k = excess ** (1 / 3)
    return travel(Limits(limits.velocity / k, limits.acceleration / k**2, limits.jerk / k**3))


def _sample(robot: RobotModel, path: CartesianPath) -> Array:
    """Joint positions along the path, shape (101, 7); refuses what cannot be led."""
    samples = [path.start]
    for index in range(1, _SAMPLES):
        s = index / (_SAMPLES - 1)
        try:
            q = path.at(s, samples[-1])
        except Unreachable as error:
            raise PlanError(
                "unreachable",
                f"Can not plan motion: the path is not reachable at {100 * s:.0f} %: {error.text}",
            ) from None
        step = np.abs(q - samples[-1])
        if step.max() > _LARGEST_STEP:
            raise PlanError(
                "planning",
                f"Can not plan motion: A{int(step.argmax()) + 1} would have to jump at {100 * s:.0f} % of the path "
                "(singularity)",
            )
        check_limits(robot, q)
        samples.append(q)
    return np.array(samples)


def _or(value: float, default: float) -> float:
    return default if isnan(value) else value


def cartesian_limits(order: Order, path: CartesianPath) -> Limits:
    """What an order allows along its path, as limits of s."""
    length, angle = max(path.length, 1e-12), max(path.angle, 1e-12)
    line = (order.cart_velocity, order.cart_acceleration, order.cart_jerk)
    turn = (order.ori_velocity, order.ori_acceleration, order.ori_jerk)
    by_line = Limits(*(_or(v, d) / length for v, d in zip(line, CARTESIAN_DEFAULT, strict=True)))
    by_turn = Limits(*(_or(v, d) / angle for v, d in zip(turn, ORIENTATION_DEFAULT, strict=True)))
    limits = by_line.least(by_turn)
    if not isinstance(path.geometry, Arc):
        return limits
    towards_centre = sqrt(_or(order.cart_acceleration, CARTESIAN_DEFAULT[1]) * path.geometry.radius) / length
    return limits.least(Limits(towards_centre, inf, inf))


def _joint_limits(
    robot: RobotModel, samples: Array, velocity: Array, acceleration: Array, jerk: Array
) -> Limits:
    """Limits of s that keep every axis within its own along the samples."""
    step = 1.0 / (_SAMPLES - 1)
    slope = np.abs(np.gradient(samples, step, axis=0)).max(axis=0)
    curve = np.abs(np.diff(samples, 2, axis=0) / step**2).max(axis=0)
    slope, curve = np.maximum(slope, 1e-12), np.maximum(curve, 1e-12)
    by_speed = float((robot.dq_max * velocity / slope).min())
    by_curve = sqrt(_RESERVE / 2 * float((robot.ddq_max * acceleration / curve).min()))
    return Limits(
        min(by_speed, by_curve),
        _RESERVE * float((robot.ddq_max * acceleration / slope).min()),
        _RESERVE * float((robot.dddq_max * jerk / slope).min()),
    )
