"""Motions as a program: turned into its items, checked against the connected robot before anything is sent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, isinf, isnan, nan
from typing import TYPE_CHECKING

import numpy as np

from heptarm.arm.conditions import condition_message
from heptarm.arm.modes import mode_message
from heptarm.arm.triggers import with_triggers
from heptarm.errors import HeptarmError, ShapeError
from heptarm.model.inverse import redundancy
from heptarm.values import motion as values
from heptarm.values.arrays import Array
from heptarm.values.condition import Condition
from heptarm.values.limits import Blending, CartesianDynamics, JointDynamics
from heptarm.values.mode import Mode
from heptarm.values.motion import (
    Circ,
    HandGuide,
    Hold,
    JointSpline,
    Lin,
    LinRel,
    Motion,
    Ptp,
    PtpHome,
    PtpPose,
    Spl,
    Spline,
)
from heptarm.values.orientation import Orientation
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel
from heptarm.values.trigger import triggers_of
from heptarm.wire import messages as wire

if TYPE_CHECKING:
    from heptarm.arm.connection import Connection
    from heptarm.arm.handle import MotionHandle
    from heptarm.arm.tooling import Tooling

_MOTIONS = (Ptp, PtpHome, PtpPose, Lin, LinRel, Circ, Spline, JointSpline, Hold, HandGuide)
_WHEN = {"queue": wire.When.QUEUE, "replace": wire.When.REPLACE, "reject": wire.When.REJECT}
_DAY = 86400.0
#: A motion may take this much longer than its slowest plausible estimate, and this much more [s].
_GENEROUS, _AND_MORE = 3.0, 15.0
#: The longest straight line and the longest arc inside the workspace of the largest arm [m].
_LONGEST_LINE, _LONGEST_ARC = 2.0, 6.0
#: Cartesian speed assumed where none is given [m/s].
_SLOW_LINE = 0.1


def listed(motion: Motion | Sequence[Motion]) -> tuple[Motion, ...]:
    """One motion or several, as a tuple.

    Raises:
        ShapeError: something else, or none at all.
    """
    motions = (motion,) if isinstance(motion, _MOTIONS) else motion
    if not isinstance(motions, Sequence) or isinstance(motions, str) or not 1 <= len(motions) <= 1000:
        raise ShapeError(
            f"{type(motion).__name__} given where a motion or a list of 1 to 1000 motions is wanted",
            code=3,
            parameter="motion",
            hint="make motions with ptp, lin, lin_rel, circ, spline and hold",
        )
    for index, one in enumerate(motions):
        if not isinstance(one, _MOTIONS):
            raise ShapeError(
                f"motions[{index}] is {one!r}, which is no motion",
                parameter=f"motions[{index}]",
                hint="make motions with ptp, lin, lin_rel, circ, spline and hold; joint positions alone are ptp(q)",
            )
    return tuple(motions)


def send(
    connection: Connection,
    tooling: Tooling,
    motions: tuple[Motion, ...],
    *,
    ceiling: float,
    mode: Mode | None,
    until: Condition | None,
    when: str,
) -> MotionHandle:
    """Check motions and send them as one program; see `Arm.start`.

    Args:
        connection: to whom.
        tooling: what hangs on the flange.
        motions: in their order.
        ceiling: of the speed, (0, 1].
        mode: control mode of all of them; None: position.
        until: condition that ends them.
        when: while another one runs: "queue", "replace" or "reject".
    """
    if when not in _WHEN:
        raise ShapeError(f"when is {when!r}; allowed are {', '.join(map(repr, _WHEN))}", parameter="when")
    chosen = mode_message(mode)
    tooling.check(motions, mode)
    told = connection.welcome.signals
    ends, parts = condition_message(until, told)
    tooling.check_until(parts)
    made = items(motions, connection.robot, ceiling, mode=chosen, until=ends)
    made = with_triggers(made, motions, connection.signals, told, tooling)
    message = wire.Run(items=made, when=_WHEN[when])
    triggers = tuple(map(triggers_of, motions))
    limit = _limit(connection, motions, ceiling)
    return connection.run(message, len(motions), limit, until=parts, triggers=triggers)


def _limit(connection: Connection, motions: tuple[Motion, ...], ceiling: float) -> float:
    """Time after which waiting for them makes no sense [s], with what is before them in the queue."""
    newest = connection.newest()
    override = newest.motion.override if newest is not None and newest.motion is not None else 1.0
    own = longest(motions, connection.robot, ceiling) / max(override, 0.01) / min(connection.pace, 1.0)
    total = own + connection.events.pending()
    return total if total < _DAY else _DAY


def items(
    motions: Sequence[Motion],
    robot: RobotModel,
    ceiling: float,
    *,
    mode: wire.Mode | None = None,
    until: wire.Condition | None = None,
) -> tuple[wire.Item, ...]:
    """The items of a program.

    Args:
        motions: what to do.
        robot: the connected robot.
        ceiling: no axis faster than this fraction of its maximum, (0, 1].
        mode: control mode of all of them; None: position.
        until: break condition of all of them.

    Raises:
        LimitError: a target is outside the robot's limits; the text names motion, axis, value and range.
    """
    result = []
    for index, motion in enumerate(motions):
        try:
            item = _item(motion.under(ceiling), robot)
            result.append(replace(item, mode=mode, until=until or wire.Condition()))
        except HeptarmError as error:
            if len(motions) > 1:  # which of them
                error.text = f"motions[{index}]: {error.text}"
                error.parameter = f"motions[{index}].{error.parameter}"
                error.args = (error.text,)
            raise
    return tuple(result)


def longest(motions: Sequence[Motion], robot: RobotModel, ceiling: float) -> float:
    """A time that no healthy program takes [s]; infinite if it holds until it is cancelled."""
    return _AND_MORE + _GENEROUS * sum(_slowest(motion.under(ceiling), robot) for motion in motions)


def _slowest(motion: Motion, robot: RobotModel) -> float:
    if isinstance(motion, Hold):
        return motion.duration
    if isinstance(motion, HandGuide):
        return inf
    if isinstance(motion, JointSpline):
        return sum(_turn(point.joints, robot) for point in motion.points)
    turn = _turn(motion.joints, robot)
    if isinstance(motion, Spline):
        return turn * len(motion.segments) + sum(_along(one, motion.path) for one in motion.segments)
    if isinstance(motion, Lin | LinRel | Circ):
        speed = motion.path.velocity
        way = _LONGEST_ARC if isinstance(motion, Circ) else _LONGEST_LINE
        return turn + way / (_SLOW_LINE if isnan(speed) else speed) + 1.0
    return turn


def _along(segment: Spl | Lin | Circ, whole: CartesianDynamics) -> float:
    """Time for the longest segment at its speed [s]."""
    speeds = (segment.path.velocity, whole.velocity, _SLOW_LINE)
    speed = next(speed for speed in speeds if not isnan(speed))
    return (_LONGEST_ARC if isinstance(segment, Circ) else _LONGEST_LINE) / speed


def _turn(joints: JointDynamics, robot: RobotModel) -> float:
    """Time for every axis to go from end to end, with ramps [s]."""
    velocity, acceleration = (
        np.nan_to_num(joints.velocity, nan=1.0),
        np.nan_to_num(joints.acceleration, nan=1.0),
    )
    jerk = np.nan_to_num(joints.jerk, nan=1.0)
    way = (robot.q_max - robot.q_min) / (robot.dq_max * velocity)
    ramps = robot.dq_max * velocity / (robot.ddq_max * acceleration) + robot.ddq_max / (robot.dddq_max * jerk)
    return float(np.max(way + ramps))


def _item(motion: Motion, robot: RobotModel) -> wire.Item:
    if isinstance(motion, Ptp):
        robot.check(motion.q)
        return wire.Item(
            motion=wire.Ptp(
                q=_tuple(motion.q), dynamics=_joints(motion.joints), blending=_blending(motion.blending)
            )
        )
    if isinstance(motion, PtpHome):
        return wire.Item(
            motion=wire.PtpHome(dynamics=_joints(motion.joints), blending=_blending(motion.blending))
        )
    if isinstance(motion, PtpPose):
        return wire.Item(
            motion=wire.PtpPose(
                target=_pose(motion.pose),
                redundancy=_redundancy(motion, robot),
                dynamics=_joints(motion.joints),
                blending=_blending(motion.blending),
            ),
            frame=_frame(motion.moving),
        )
    if isinstance(motion, Lin):
        return wire.Item(
            motion=wire.Lin(
                target=_pose(motion.pose),
                redundancy=_redundancy(motion, robot),
                dynamics=_path(motion.path),
                joints=_joints(motion.joints),
                blending=_blending(motion.blending),
                orientation=_orientation(motion.orientation),
            ),
            frame=_frame(motion.moving),
        )
    if isinstance(motion, LinRel):
        return wire.Item(
            motion=wire.LinRel(
                offset=_pose(motion.offset),
                reference=_frame(motion.frame),
                dynamics=_path(motion.path),
                joints=_joints(motion.joints),
                blending=_blending(motion.blending),
                orientation=_orientation(motion.orientation),
            ),
            frame=_frame(motion.moving),
        )
    if isinstance(motion, Circ):
        return wire.Item(
            motion=wire.Circ(
                via=_pose(motion.via),
                end=_pose(motion.end),
                redundancy=_redundancy(motion, robot),
                dynamics=_path(motion.path),
                joints=_joints(motion.joints),
                blending=_blending(motion.blending),
                orientation=_orientation(motion.orientation),
            ),
            frame=_frame(motion.moving),
        )
    if isinstance(motion, Spline):
        return wire.Item(
            motion=wire.Spline(
                segments=tuple(_segment(one) for one in motion.segments),
                dynamics=_path(motion.path),
                joints=_joints(motion.joints),
            ),
            frame=_frame(motion.moving),
        )
    if isinstance(motion, JointSpline):
        for index, point in enumerate(motion.points):
            robot.check(point.q, f"points[{index}].q")
        return wire.Item(
            motion=wire.JointSpline(
                points=tuple(
                    wire.JointPoint(q=_tuple(point.q), dynamics=_joints(point.joints))
                    for point in motion.points
                ),
                dynamics=_joints(motion.joints),
            )
        )
    if isinstance(motion, HandGuide):
        return wire.Item(motion=_guide(motion, robot))
    return wire.Item(motion=wire.Hold(duration=nan if isinf(motion.duration) else motion.duration))


def _guide(motion: HandGuide, robot: RobotModel) -> wire.HandGuide:
    for name in ("q_min", "q_max"):
        limits = getattr(motion, name)
        robot.check(np.where(np.isnan(limits), 0.5 * (robot.q_min + robot.q_max), limits), name)
    return wire.HandGuide(
        q_min=_tuple(motion.q_min),
        q_max=_tuple(motion.q_max),
        joint_velocity=motion.joint_velocity,
        cartesian_velocity=motion.cartesian_velocity,
        freezes_all=motion.at_limit == "all",
        pulls_back=motion.outside == "pull",
    )


def _segment(one: Spl | Lin | Circ) -> wire.SplineSegment:
    dynamics, orientation = _path(one.path), _orientation(one.orientation)
    if isinstance(one, Circ):
        return wire.CircSegment(
            via=_pose(one.via), end=_pose(one.end), dynamics=dynamics, orientation=orientation
        )
    kind = wire.SplSegment if isinstance(one, Spl) else wire.LinSegment
    return kind(target=_pose(one.pose), dynamics=dynamics, orientation=orientation)


def _frame(name: str) -> str:
    """On the wire the moved frame has no name."""
    return "" if name == values.TOOL else name


def _redundancy(motion: PtpPose | Lin | Circ, robot: RobotModel) -> wire.Redundancy:
    if motion.near is not None:
        robot.check(motion.near, "near")
        near = redundancy(robot, motion.near.tolist())
        return wire.Redundancy(e1=near.e1, status=near.status, turn=-1)
    if motion.redundancy is not None:
        chosen = motion.redundancy
        return wire.Redundancy(e1=chosen.e1, status=chosen.status, turn=chosen.turn)
    return wire.Redundancy(e1=nan, status=-1, turn=-1)


def _pose(pose: Pose) -> wire.Pose:
    return wire.Pose(xyz=_tuple(pose.xyz), quat=_tuple(pose.quat))


def _joints(limits: JointDynamics) -> wire.JointDynamics:
    return wire.JointDynamics(
        velocity=_tuple(limits.velocity), acceleration=_tuple(limits.acceleration), jerk=_tuple(limits.jerk)
    )


def _path(limits: CartesianDynamics) -> wire.CartesianDynamics:
    return wire.CartesianDynamics(
        velocity=limits.velocity,
        acceleration=limits.acceleration,
        jerk=limits.jerk,
        orientation_velocity=limits.orientation_velocity,
        orientation_acceleration=limits.orientation_acceleration,
        orientation_jerk=limits.orientation_jerk,
    )


def _blending(blending: Blending) -> wire.Blending:
    return wire.Blending(
        relative=blending.relative, distance=blending.distance, orientation=blending.orientation
    )


def _orientation(led: Orientation) -> wire.Orientation:
    return wire.Orientation(
        type=wire.OrientationType[led.type.upper()],
        reference=wire.OrientationReference[led.reference.upper()],
    )


def _tuple(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())


def is_endless(motions: Sequence[Motion]) -> bool:
    """Whether it ends only when it is cancelled."""
    return any(
        isinstance(motion, HandGuide) or (isinstance(motion, Hold) and motion.duration == inf)
        for motion in motions
    )
