"""MoveIt's requests as those of `Arm.find_path`: constraints become goals and what a path keeps, links the tool frame.

What a request asks for is never loosened: a tolerance that has another shape here becomes one inside of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import pi, sqrt
from typing import Any, Literal

import numpy as np

from heptarm.errors import CollisionForeseen, CommandRejected, HeptarmError, LimitError, NoPath, Unreachable
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.motions import pose_of, positions, stamped_pose
from heptarm.ros.interface.planning.scene import BOX, SPHERE, tool_on_flange
from heptarm.values.checks import Array
from heptarm.values.motion.planned_path import OnPlane, PathConstraint, Region, Upright
from heptarm.values.pose import Pose
from heptarm.values.workspace import Workspace

#: Tolerances below are met by the pose itself: position [m], angle [rad].
_EXACT_POSITION, _EXACT_ANGLE = 0.005, 0.02
#: Name of the planning group, without prefix, as in heptarm_moveit_config.
_GROUP = "arm"
#: Angle between an axis that a path constraint leaves free and one of the tool frame [rad].
_ALONG = 1e-3
#: A point of a link so near to the tool frame is its origin [m].
_LEVER = 1e-6
#: Of a box along a path: the farthest from the planes through its middle [m], which is as far as a constraint goes.
_WIDEST = 1.0
_AXES: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")


class MoveItCode(IntEnum):
    """Error codes of moveit_msgs/MoveItErrorCodes."""

    SUCCESS = 1
    FAILURE = 99999
    PLANNING_FAILED = -1
    MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE = -3
    CONTROL_FAILED = -4
    TIMED_OUT = -6
    PREEMPTED = -7
    START_STATE_IN_COLLISION = -10
    START_STATE_VIOLATES_PATH_CONSTRAINTS = -11
    GOAL_IN_COLLISION = -12
    GOAL_VIOLATES_PATH_CONSTRAINTS = -13
    INVALID_GROUP_NAME = -15
    INVALID_GOAL_CONSTRAINTS = -16
    INVALID_ROBOT_STATE = -17
    INVALID_LINK_NAME = -18
    FRAME_TRANSFORM_FAILURE = -21
    GOAL_STATE_INVALID = -27
    NO_IK_SOLUTION = -31


#: By the reason of a NoPath.
_OF_REASON = {
    "start": MoveItCode.START_STATE_IN_COLLISION,
    "goal": MoveItCode.GOAL_IN_COLLISION,
    "inverse kinematics": MoveItCode.NO_IK_SOLUTION,
    "constraint": MoveItCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
    "not connected": MoveItCode.PLANNING_FAILED,
    "time": MoveItCode.TIMED_OUT,
}


class RequestRefused(CommandRejected):
    """A request of MoveIt's was refused.

    Args:
        text: why: the value and what is allowed.
        moveit: code for the client.
        hint: what to do.
    """

    def __init__(self, text: str, moveit: MoveItCode, *, hint: str = "") -> None:
        super().__init__(text, hint=hint)
        self.moveit = moveit


def code_of(error: HeptarmError) -> MoveItCode:
    """The code of MoveIt for an error."""
    if isinstance(error, RequestRefused):
        return error.moveit
    if isinstance(error, NoPath):
        if error.reason == "constraint" and error.parameter == "start":
            return MoveItCode.START_STATE_VIOLATES_PATH_CONSTRAINTS
        return _OF_REASON.get(error.reason, MoveItCode.FAILURE)
    if isinstance(error, CollisionForeseen):
        return MoveItCode.MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE
    if isinstance(error, Unreachable):
        return MoveItCode.NO_IK_SOLUTION
    return MoveItCode.GOAL_STATE_INVALID if isinstance(error, LimitError) else MoveItCode.FAILURE


def check_group(context: NodeContext, name: str) -> None:
    """Refuse the name of another planning group; "" is the only one there is."""
    own = f"{context.driver.configuration.values['prefix']}{_GROUP}"
    if name not in ("", own):
        raise RequestRefused(f"group_name must be {own!r}, got {name!r}", MoveItCode.INVALID_GROUP_NAME)


def link_on_flange(context: NodeContext, name: str) -> Pose:
    """Where a link of which a pose is asked for is in the flange frame: the flange itself or the tool; "": the tool.

    Raises:
        RequestRefused: another link.
    """
    flange, tool = context.driver.configuration.links
    if name == flange:
        return Pose.of((0.0, 0.0, 0.0))
    if name in ("", tool):
        return tool_on_flange(context)
    raise RequestRefused(f"link must be {flange!r} or {tool!r}, got {name!r}", MoveItCode.INVALID_LINK_NAME)


def start_of(context: NodeContext, state: Any) -> Array | None:
    """Joint positions of a moveit_msgs/RobotState, shape (7,) [rad]; None: it names none, which is where the arm is."""
    if state.attached_collision_objects:
        raise RequestRefused(
            "attached bodies of a start state are not supported",
            MoveItCode.INVALID_ROBOT_STATE,
            hint="publish them on attached_collision_object",
        )
    names = context.driver.configuration.own(state.joint_state.name)
    pairs = [pair for pair in zip(names, state.joint_state.position) if pair[0] in context.joints]
    if not pairs:
        return None
    return positions(context.driver, [name for name, _ in pairs], [value for _, value in pairs])


# --------------------------------------------------------------------------------------------- goals


def goals_of(context: NodeContext, constraints: Sequence[Any]) -> list[Array | Pose | Region]:
    """Goals of several moveit_msgs/Constraints, of which one has to be reached.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    if not constraints:
        raise RequestRefused("there is no goal", MoveItCode.INVALID_GOAL_CONSTRAINTS)
    return [_goal_of(context, constraint) for constraint in constraints]


def _goal_of(context: NodeContext, message: Any) -> Array | Pose | Region:
    counts = len(message.position_constraints), len(message.orientation_constraints)
    if message.visibility_constraints or max(counts) > 1:
        raise RequestRefused(
            "a goal must be joint positions, or one position with at most one orientation",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    joints = message.joint_constraints
    if joints and not any(counts):
        return positions(
            context.driver, [joint.joint_name for joint in joints], [joint.position for joint in joints]
        )
    if joints or not counts[0]:
        raise RequestRefused(
            "a goal must be joint positions, or a position with or without an orientation",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
            hint="give one of them",
        )
    return _pose_goal(context, message.position_constraints[0], message.orientation_constraints)


def _pose_goal(context: NodeContext, place: Any, turns: Sequence[Any]) -> Pose | Region:
    """A goal for the tool frame, of a position and perhaps an orientation of a link."""
    to_tool = link_on_flange(context, place.link_name).inverse() @ tool_on_flange(context)
    offset = place.target_point_offset
    to_tool = Pose.of((-offset.x, -offset.y, -offset.z)) @ to_tool
    has_lever = bool(np.abs(to_tool.xyz).max() > 0.0)
    centre, radius = _ball(context, place)
    if turns:
        orientation = turns[0]
        if orientation.link_name not in ("", place.link_name):
            raise RequestRefused(
                "position and orientation must be of the same link, "
                f"got {place.link_name!r} and {orientation.link_name!r}",
                MoveItCode.INVALID_GOAL_CONSTRAINTS,
            )
        quat = _in_base(context, orientation.header, (0.0, 0.0, 0.0), orientation.orientation).quat
        cone = min(orientation.absolute_x_axis_tolerance, orientation.absolute_y_axis_tolerance, pi)
        turn = min(orientation.absolute_z_axis_tolerance, pi)
    elif has_lever:
        raise RequestRefused(
            "a position with any orientation must be of the tool frame itself",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
            hint="name the tool's link, without target_point_offset, or give an orientation",
        )
    else:
        quat, cone, turn = np.array([0.0, 0.0, 0.0, 1.0]), pi, pi
    if has_lever:
        cone = turn = 0.0  # to turn the tool frame would move the link
    cone, turn = (0.0 if angle <= _EXACT_ANGLE else angle for angle in (cone, turn))
    pose = Pose.of(centre.xyz, quat) @ to_tool
    edge = 0.0 if radius <= _EXACT_POSITION else 2.0 * radius / sqrt(3.0)
    if not (edge or cone or turn):
        return pose
    return Region.of(pose, box=(edge, edge, edge), cone=cone, turn=turn)


def _ball(context: NodeContext, message: Any) -> tuple[Pose, float]:
    """Centre, in the base, and radius of the largest ball in the region of a position constraint [m]."""
    primitive, middle = _primitive(context, message)
    sizes = list(primitive.dimensions)
    return middle, sizes[0] if primitive.type == SPHERE else min(sizes) / 2.0


def _primitive(context: NodeContext, message: Any, *, turned: bool = False) -> tuple[Any, Pose]:
    """The box or sphere of a position constraint, and its pose in the base; its orientation only if it is `turned`."""
    region = message.constraint_region
    if region.meshes or len(region.primitives) != 1 or len(region.primitive_poses) != 1:
        raise RequestRefused(
            "a region of positions must be one primitive with its pose", MoveItCode.INVALID_GOAL_CONSTRAINTS
        )
    primitive, at = region.primitives[0], region.primitive_poses[0]
    if len(primitive.dimensions) != {BOX: 3, SPHERE: 1}.get(primitive.type):
        raise RequestRefused(
            f"a region of positions must be a box with three edges or a sphere with a radius, got a primitive of type "
            f"{primitive.type} with {len(primitive.dimensions)} numbers",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    point = (at.position.x, at.position.y, at.position.z)
    return primitive, _in_base(context, message.header, point, at.orientation if turned else None)


def _in_base(context: NodeContext, header: Any, point: tuple[float, float, float], turn: Any) -> Pose:
    """A point and an orientation of a frame as a pose in the base.

    Raises:
        RequestRefused: unknown frame.
    """
    message = _Stamped(header, context.ros.pose())
    place = message.pose.position
    place.x, place.y, place.z = point
    message.pose.orientation.w = 1.0
    if turn is not None:
        message.pose.orientation = turn
    return stamped_in_base(context, message)


@dataclass(frozen=True, slots=True)
class _Stamped:
    """As a geometry_msgs/PoseStamped."""

    header: Any
    pose: Any


def stamped_in_base(context: NodeContext, message: Any) -> Pose:
    """Convert a geometry_msgs/PoseStamped to a pose in the base.

    Raises:
        RequestRefused: it is in an unknown frame, or has no orientation.
    """
    try:
        pose_of(message.pose)
        return stamped_pose(message, context.driver)
    except HeptarmError as error:
        raise RequestRefused(str(error), MoveItCode.FRAME_TRANSFORM_FAILURE) from None


# ---------------------------------------------------------------------------------- path constraints


def keep_of(context: NodeContext, message: Any) -> list[PathConstraint]:
    """What a moveit_msgs/Constraints along a path keeps.

    Args:
        context: of the node.
        message: the constraints.

    Raises:
        RequestRefused: a constraint that none of heptarm's is.
        HeptarmError: a number outside its range.
    """
    if message.visibility_constraints:
        raise RequestRefused(
            "a path constraint must be of joints, a position or an orientation, got one of visibility",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    kept: list[PathConstraint] = [_upright(context, one) for one in message.orientation_constraints]
    for one in message.position_constraints:
        kept += _box(context, one)
    if message.joint_constraints:
        kept.append(_ranges(context, message.joint_constraints))
    return kept


def _upright(context: NodeContext, one: Any) -> Upright:
    """An axis of the tool frame keeps the direction that an orientation gives it."""
    tolerances = (one.absolute_x_axis_tolerance, one.absolute_y_axis_tolerance, one.absolute_z_axis_tolerance)
    free = [index for index, tolerance in enumerate(tolerances) if tolerance >= pi]
    if len(free) != 1:
        raise RequestRefused(
            f"an orientation along a path must leave free one axis, with a tolerance of at least pi, got tolerances "
            f"{', '.join(f'{value:g}' for value in tolerances)} rad",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    to_tool = link_on_flange(context, one.link_name).inverse() @ tool_on_flange(context)
    along = to_tool.rotation.T[:, free[0]]
    axis = int(np.abs(along).argmax())
    if abs(along[axis]) < np.cos(_ALONG):
        raise RequestRefused(
            "the axis that stays upright must be one of the tool frame", MoveItCode.INVALID_GOAL_CONSTRAINTS
        )
    wanted = _in_base(context, one.header, (0.0, 0.0, 0.0), one.orientation).rotation[:, free[0]]
    within = min(tolerance for index, tolerance in enumerate(tolerances) if index != free[0])
    return Upright(_AXES[axis], within=within, direction=np.sign(along[axis]) * wanted)


def _box(context: NodeContext, one: Any) -> list[PathConstraint]:
    """The tool frame stays in a box: near the three planes through its middle, by half an edge."""
    to_tool = link_on_flange(context, one.link_name).inverse() @ tool_on_flange(context)
    offset = one.target_point_offset
    if np.abs(to_tool.xyz - (offset.x, offset.y, offset.z)).max() > _LEVER:
        raise RequestRefused(
            "a position along a path must be of the tool frame itself",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
            hint="name the tool's link",
        )
    primitive, pose = _primitive(context, one, turned=True)
    if primitive.type != BOX:
        raise RequestRefused(
            f"a region of positions along a path must be a box, got a primitive of type {primitive.type}",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    halves = [min(0.5 * edge, _WIDEST) for edge in primitive.dimensions]
    return [
        OnPlane(pose.xyz, normal, within=half) for normal, half in zip(pose.rotation.T, halves, strict=True)
    ]


def _ranges(context: NodeContext, joints: Sequence[Any]) -> Workspace:
    """Joints stay between a position less one tolerance and that position plus another."""
    robot, names = context.arm.robot, context.joints
    low, high = robot.q_min.copy(), robot.q_max.copy()
    for one in joints:
        index = names.index(one.joint_name) if one.joint_name in names else None
        if index is None:
            raise RequestRefused(
                f"joint must be one of {', '.join(names)}, got {one.joint_name!r}",
                MoveItCode.INVALID_GOAL_CONSTRAINTS,
            )
        low[index] = max(low[index], one.position - one.tolerance_below)
        high[index] = min(high[index], one.position + one.tolerance_above)
    return Workspace(joints=(low, high))
