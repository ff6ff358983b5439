"""The interface of MoveIt's move_group, for programs that are written for it: the parameter `moveit`.

Names and types are MoveIt's, the work is done by `Arm.find_path`, by heptarm's inverse kinematics and by the driver: no
plugin, pipeline or planner of MoveIt's is asked, so their names in a request have no effect. `TOPICS`, `SERVICES` and
`ACTIONS` are the tables.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from heptarm import planning
from heptarm.errors import CollisionForeseen, CommandRejected, HeptarmError, Unreachable
from heptarm.model.batch import solve_batch
from heptarm.model.inverse_kinematics import PathInverse, inside, solve
from heptarm.model.kinematics import forward
from heptarm.ros.interface.action import FEEDBACK_PERIOD, ActionResult, GoalClient, GoalWork, RosAction
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import class_of, pose_message, trajectory_goal
from heptarm.ros.interface.planning.constraints import (
    MoveItCode,
    RequestRefused,
    check_group,
    code_of,
    goals_of,
    keep_of,
    link_on_flange,
    stamped_in_base,
    start_of,
)
from heptarm.ros.interface.planning.paths import timed, trajectory_fields
from heptarm.ros.interface.planning.scene import (
    carried_model,
    change_scene,
    replace_scene,
    scene_fields,
    tool_on_flange,
)
from heptarm.ros.interface.program_goal import run_motion
from heptarm.ros.interface.service import Service, ServiceResponse
from heptarm.ros.interface.topics import Topic
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.values.checks import Array
from heptarm.values.motion.planned_path import Path
from heptarm.values.motion.spline import spline_joints
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel

#: A start nearer than this to the arm is where the arm is [rad].
_HERE = 0.01
#: Longest steps of a Cartesian path: position [m], angle, and the largest move of a joint that is no jump [rad].
_STEP, _TURN, _JUMP = 0.01, 0.05, 0.5
#: Time between two points of a Cartesian path [s], and the most points on each of its lines.
_PERIOD, _MOST_POINTS = 0.02, 1000
#: Angles of A3 at which inverse kinematics are tried when bodies are in the way.
_ELBOWS = 36
#: Longest wait for the result of a trajectory that was cancelled [s].
_BRAKING = 10.0
_ERROR, _RESPONSE = "moveit_msgs/MoveItErrorCodes", "motion_plan_response"


# ------------------------------------------------------------------------------------------- results


def _error(code: MoveItCode, text: str = "") -> dict[str, Any]:
    """Fields of a moveit_msgs/MoveItErrorCodes; that of ROS 2 has a text, too."""
    fields: dict[str, Any] = {"val": int(code)}
    if hasattr(class_of(_ERROR, "msg"), "message"):
        fields |= {"message": text, "source": "heptarm"}
    return fields


_SUCCESS = MoveItCode.SUCCESS


def _answering(handler: Callable[[NodeContext, Any], Mapping[str, Any]], *inside_of: str) -> Any:
    """A handler of a service whose response has an error code, which may be inside of another message."""

    def answer(context: NodeContext, request: Any) -> ServiceResponse:
        try:
            fields = dict(handler(context, request))
        except HeptarmError as error:
            fields = {"error_code": _error(code_of(error), str(error))}
        for name in inside_of:
            fields = {name: fields}
        return ServiceResponse(True, "", fields)

    return answer


def _failed(error: HeptarmError, client: GoalClient | None = None) -> ActionResult:
    cancelled = client is not None and client.is_cancel_requested()
    code = MoveItCode.PREEMPTED if cancelled else code_of(error)
    outcome = GoalOutcome.CANCELED if cancelled else GoalOutcome.ABORTED
    return ActionResult(outcome, str(error), {"error_code": _error(code, str(error))})


def _ended(result: ActionResult, fields: Mapping[str, Any]) -> ActionResult:
    """The result of a motion, with a code of MoveIt."""
    codes = {GoalOutcome.SUCCEEDED: _SUCCESS, GoalOutcome.ABORTED: MoveItCode.CONTROL_FAILED}
    code = codes.get(result.outcome, MoveItCode.PREEMPTED)
    return replace(result, fields={**fields, "error_code": _error(code, result.text)})


def _robot_state(context: NodeContext, q: Array) -> dict[str, Any]:
    return {"joint_state": {"name": context.joints, "position": q.tolist()}}


# -------------------------------------------------------------------------------------------- search


class _Request:
    """A moveit_msgs/MotionPlanRequest, checked.

    Args:
        context: of the node.
        message: the request.
        difference: moveit_msgs/PlanningScene by which the world differs for this request; that of MoveIt's clients is
            empty, and not marked as a difference. None: it does not differ.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """

    def __init__(self, context: NodeContext, message: Any, difference: Any = None) -> None:
        check_group(context, message.group_name)
        self._context = context
        values = context.driver.configuration.values
        self.speed: float = message.max_velocity_scaling_factor or values["speed"]
        self._acceleration = message.max_acceleration_scaling_factor or 1.0
        self._time = message.allowed_planning_time or planning.search.TIMEOUT
        start = start_of(context, message.start_state)
        here = context.arm.state.q_cmd
        self.is_here = start is None or bool(np.abs(start - here).max() < _HERE)
        self.start = here if start is None or self.is_here else start
        self._goals = goals_of(context, message.goal_constraints)
        self._keep = keep_of(context, message.path_constraints)
        draft = context.world.draft()
        if difference is not None:
            change_scene(context, draft, difference)
        self._world = draft.model

    def find(self, stop: Callable[[], bool] | None) -> Path:
        """Search until `stop` returns true.

        Raises:
            NoPath: none was found.
            HeptarmError: refused; the text gives the reason.
        """
        how: dict[str, Any] = {"keep": self._keep, "speed": self.speed, "timeout": self._time, "stop": stop}
        if self.is_here:
            path = self._context.arm.find_path(self._goals, avoid=self._world, **how)
        else:
            tip, load = tool_on_flange(self._context), self._context.arm.load
            path = planning.find_path(
                self._world, start=self.start, goal=self._goals, tcp=tip, load=load, **how
            )
        if self._acceleration == 1.0:
            return path
        slower = np.fmin(path.dynamics.joint_acceleration, self._acceleration)
        return replace(path, dynamics=replace(path.dynamics, joint_acceleration=slower))

    def fields(self, path: Path) -> dict[str, Any]:
        """Fields of a moveit_msgs/RobotTrajectory along a path."""
        return {"joint_trajectory": timed(self._context, path, speed=self.speed)}


def _motion_plan(context: NodeContext, request: Any) -> Mapping[str, Any]:
    """Plan a moveit_msgs/MotionPlanRequest."""
    begin = time.monotonic()
    wanted = _Request(context, request.motion_plan_request)
    path = wanted.find(None)
    return {
        "trajectory_start": _robot_state(context, path.start),
        "group_name": request.motion_plan_request.group_name,
        "trajectory": wanted.fields(path),
        "planning_time": time.monotonic() - begin,
        "error_code": _error(_SUCCESS),
    }


def _move_group(context: NodeContext, goal: Any) -> GoalWork:
    """Plan, and move along what was found unless `plan_only` is set."""
    options = goal.planning_options
    try:
        if not options.plan_only:
            context.check_active()
        wanted = _Request(context, goal.request, options.planning_scene_diff)
        if not options.plan_only and not wanted.is_here:
            raise RequestRefused(
                "a motion must begin where the arm is", MoveItCode.INVALID_ROBOT_STATE, hint="set plan_only"
            )
    except HeptarmError as error:
        refused = error  # a rejected goal could not have the code
        return lambda client: _failed(refused)

    def work(client: GoalClient) -> ActionResult:
        client.publish_feedback({"state": "PLANNING"})
        begin = time.monotonic()
        try:
            path = wanted.find(client.is_cancel_requested)
            fields = {
                "trajectory_start": _robot_state(context, path.start),
                "planned_trajectory": wanted.fields(path),
                "planning_time": time.monotonic() - begin,
            }
            if options.plan_only:
                return _ended(ActionResult(GoalOutcome.SUCCEEDED, str(path)), fields)
            client.publish_feedback({"state": "MONITOR"})
            moving = run_motion(context, replace(path, world=context.world.model), speed=wanted.speed)
        except HeptarmError as error:
            return _failed(error, client)
        return _ended(moving(client), fields)

    return work


def _execute(context: NodeContext, goal: Any) -> GoalWork:
    """Follow a trajectory, which is checked against the world before."""
    message = goal.trajectory.joint_trajectory
    try:
        context.check_active()
        wanted = trajectory_goal(context.ros, message, now=lambda: context.driver.now)
        if len(goal.trajectory.multi_dof_joint_trajectory.points):
            raise CommandRejected(
                "a trajectory must be of joints alone", parameter="multi_dof_joint_trajectory"
            )
        _check_free(context, message)
        number = context.driver.accept(wanted)
    except HeptarmError as error:
        refused = error  # a rejected goal could not have the code
        return lambda client: _failed(refused)
    return partial(_follow, context, number)


def _follow(context: NodeContext, number: int, client: GoalClient) -> ActionResult:
    client.publish_feedback({"state": "MONITOR"})
    driver = context.driver
    while (result := driver.result(number, timeout=FEEDBACK_PERIOD)) is None:
        if client.is_cancel_requested():
            driver.cancel(number)
            result = driver.result(number, timeout=_BRAKING)
            break
    if result is None:
        return _ended(ActionResult(GoalOutcome.ABORTED, "the arm does not come to rest"), {})
    return _ended(ActionResult(result.outcome, result.text), {})


def _check_free(context: NodeContext, message: Any) -> None:
    """Refuse a trajectory on which bodies would touch.

    Raises:
        CollisionForeseen: they would.
    """
    names = context.driver.configuration.own(message.joint_names)
    order = [names.index(name) for name in context.joints if name in names]
    rows = [point.positions for point in message.points if len(point.positions) == len(names)]
    if len(order) != 7 or not rows:
        return  # the driver refuses or completes it
    path = np.vstack([context.arm.state.q_cmd, np.array([[row[k] for k in order] for row in rows])])
    touch = carried_model(context).first_on(path)
    if touch is not None:
        raise CollisionForeseen(
            f"{touch.clearance} after {touch.at:.0%} of the path",
            touch=touch,
            motion=0,
            parameter="trajectory",
            value=round(touch.clearance.distance, 4),
            hint="plan again",
        )


# ---------------------------------------------------------------------------------------- kinematics


def _forward(context: NodeContext, request: Any) -> Mapping[str, Any]:
    """Poses of links at joint positions."""
    start = start_of(context, request.robot_state)
    q = context.arm.state.q if start is None else start
    names = list(request.fk_link_names) or [context.driver.configuration.links[1]]
    found = []
    for name in names:
        message = class_of("geometry_msgs/PoseStamped", "msg")()
        message.header.frame_id = context.base
        message.header.stamp = context.ros.time(context.ros.now())
        message.pose = pose_message(context.ros, _link_at(context, name, q))
        found.append(message)
    return {"pose_stamped": found, "fk_link_names": names, "error_code": _error(_SUCCESS)}


def _link_at(context: NodeContext, name: str, q: Array) -> Pose:
    robot, prefix = context.arm.robot, context.driver.configuration.values["prefix"]
    numbers = {f"{prefix}link_{number}": number for number in range(1, 8)}
    if name in numbers:
        return Pose.from_matrix(forward(robot, q, link=numbers[name]))
    return Pose.from_matrix(forward(robot, q)) @ link_on_flange(context, name)


def _inverse(context: NodeContext, request: Any) -> Mapping[str, Any]:
    """Joint positions at which a link has a pose, near those of the request."""
    wanted = request.ik_request
    check_group(context, wanted.group_name)
    if len(wanted.pose_stamped_vector) or any(
        len(getattr(wanted.constraints, name))
        for name in ("joint_constraints", "position_constraints", "orientation_constraints")
    ):
        raise RequestRefused(
            "inverse kinematics must be asked for one pose without constraints",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    seed = start_of(context, wanted.robot_state)
    near = context.arm.state.q_cmd if seed is None else seed
    pose = stamped_in_base(context, wanted.pose_stamped)
    flange = pose @ link_on_flange(context, wanted.ik_link_name).inverse()
    robot = context.arm.robot
    found = _free(context, flange, near) if wanted.avoid_collisions else solve(robot, flange, near=near)
    return {"solution": _robot_state(context, found), "error_code": _error(_SUCCESS)}


def _free(context: NodeContext, flange: Pose, near: Array) -> Array:
    """The solution of the inverse kinematics nearest to joint positions at which no bodies touch."""
    robot, model = context.arm.robot, carried_model(context)
    first = solve(robot, flange, near=near)
    if not model.touching(first):
        return first
    angles = np.linspace(robot.q_min[2], robot.q_max[2], _ELBOWS + 2)[1:-1]
    e1, status = np.repeat(angles, 8), np.tile(np.arange(8), _ELBOWS)
    rows = solve_batch(robot, np.repeat(flange.matrix[None], len(e1), axis=0), e1=e1, status=status)
    rows = rows[np.isfinite(rows).all(axis=1)]
    for row in rows[np.abs(rows - near).max(axis=1).argsort(kind="stable")]:
        if inside(robot, row.tolist()) and not model.touching(row):
            return np.asarray(row)
    raise RequestRefused(
        f"bodies touch in every arm position that reaches the pose: {model.touching(first)[0]}",
        MoveItCode.NO_IK_SOLUTION,
    )


# ---------------------------------------------------------------------------------- Cartesian paths


def _cartesian(context: NodeContext, request: Any) -> Mapping[str, Any]:
    """Straight lines of a link from one pose to the next, as far as the arm can move along them."""
    check_group(context, request.group_name)
    start = start_of(context, request.start_state)
    begin = context.arm.state.q_cmd if start is None else start
    if keep_of(context, request.path_constraints) or not len(request.waypoints):
        raise RequestRefused(
            "a Cartesian path must have waypoints, and no constraints beside them",
            MoveItCode.INVALID_GOAL_CONSTRAINTS,
        )
    link = link_on_flange(context, request.link_name)
    stamped = class_of("geometry_msgs/PoseStamped", "msg")
    poses = [
        stamped_in_base(context, stamped(header=request.header, pose=waypoint))
        for waypoint in request.waypoints
    ]
    speed = (
        getattr(request, "max_velocity_scaling_factor", 0.0) or context.driver.configuration.values["speed"]
    )
    lines = _lines(context.arm.robot, link, begin, poses, request)
    steps = sum(count for _, count in lines)
    if request.avoid_collisions:
        lines = _free_lines(context, begin, lines)
    fraction = sum(len(points) for points, _ in lines) / steps
    return {
        "start_state": _robot_state(context, begin),
        "solution": {"joint_trajectory": _timed_lines(context, begin, lines, speed)},
        "fraction": fraction,
        "error_code": _error(_SUCCESS),
    }


#: Joint positions along a line, as far as the arm gets, each of shape (7,) [rad], and how many there should be.
_Line = tuple[list[Array], int]


def _lines(robot: RobotModel, link: Pose, begin: Array, poses: Sequence[Pose], request: Any) -> list[_Line]:
    """Follow the lines from pose to pose with the inverse kinematics."""
    inverse, q = PathInverse(robot, link), begin
    here = Pose.from_matrix(forward(robot, q)) @ link
    longest = min(request.max_step, _STEP) if request.max_step > 0.0 else _STEP
    jump = request.revolute_jump_threshold if request.revolute_jump_threshold > 0.0 else _JUMP
    lines: list[_Line] = []
    is_blocked = False
    for pose in poses:
        count = int(np.ceil(max(here.distance_to(pose) / longest, here.angle_to(pose) / _TURN, 1.0)))
        count = min(count, _MOST_POINTS)
        points: list[Array] = []
        for step in range(1, count + 1):
            between = here.interpolate(pose, step / count)
            found = None if is_blocked else _next(robot, inverse, between, q, jump)
            if found is None:
                is_blocked = True
                break
            q = found
            points.append(found)
        lines.append((points, count))
        here = pose
    return lines


def _next(robot: RobotModel, inverse: PathInverse, pose: Pose, q: Array, jump: float) -> Array | None:
    """Joint positions next to others; None: there are none without a jump."""
    try:
        found = inverse.joints(pose.xyz.tolist(), pose.quat.tolist(), q)
    except Unreachable:
        return None
    is_near = np.abs(found - q).max() <= jump
    return found if is_near and inside(robot, found.tolist()) else None


def _free_lines(context: NodeContext, begin: Array, lines: Sequence[_Line]) -> list[_Line]:
    """The lines as far as no bodies touch."""
    path = np.array([begin, *(q for points, _ in lines for q in points)])
    touch = carried_model(context).first_on(path)
    if touch is None:
        return list(lines)
    moved = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path, axis=0)).max(axis=1))])
    left = int(np.searchsorted(moved, touch.at * moved[-1])) - 1
    found: list[_Line] = []
    for points, count in lines:
        found.append((points[: max(0, left)], count))
        left -= len(points)
    return found


def _timed_lines(context: NodeContext, begin: Array, lines: Sequence[_Line], speed: float) -> dict[str, Any]:
    """Fields of a trajectory_msgs/JointTrajectory along lines, at rest between two of them."""
    motions = [spline_joints(points) for points, _ in lines if points]
    if not motions:
        return trajectory_fields(context, np.zeros(1), begin[None], np.zeros((1, 7)), np.zeros((1, 7)))
    preview = context.arm.plan(motions, speed=speed, start=begin, step=_PERIOD)
    return trajectory_fields(context, preview.t, preview.q, preview.dq, preview.ddq)


# --------------------------------------------------------------------------------------------- scene


def _get_scene(context: NodeContext, request: Any) -> ServiceResponse:
    """Report the world; all of it, whichever components are asked for."""
    return ServiceResponse(True, "", {"scene": scene_fields(context)})


def _apply_scene(context: NodeContext, request: Any) -> ServiceResponse:
    """Change the world."""
    with context.world.changing() as draft:
        replace_scene(context, draft, request.scene)
    return ServiceResponse(True, "the world has changed")


def _event(context: NodeContext, message: Any) -> None:
    """Stop the arm when the text is "stop"."""
    if message.data != "stop":
        raise CommandRejected(
            f"data must be 'stop', got {message.data!r}", parameter="data", value=message.data
        )
    context.driver.stop()


#: Topics of move_group besides those of the world, which the nodes always subscribe to.
TOPICS = (Topic("trajectory_execution_event", "std_msgs/String", _event, at_once=True),)
#: Services of move_group.
SERVICES = (
    Service(
        "plan_kinematic_path", "moveit_msgs/GetMotionPlan", _answering(_motion_plan, _RESPONSE), at_once=True
    ),
    Service("compute_ik", "moveit_msgs/GetPositionIK", _answering(_inverse), at_once=True),
    Service("compute_fk", "moveit_msgs/GetPositionFK", _answering(_forward), at_once=True),
    Service("compute_cartesian_path", "moveit_msgs/GetCartesianPath", _answering(_cartesian), at_once=True),
    Service("get_planning_scene", "moveit_msgs/GetPlanningScene", _get_scene, at_once=True),
    Service("apply_planning_scene", "moveit_msgs/ApplyPlanningScene", _apply_scene, at_once=True),
)
#: Actions of move_group; that of plans has another name in each ROS.
ACTIONS = (
    RosAction("move_action", "moveit_msgs/MoveGroup", _move_group),
    RosAction("move_group", "moveit_msgs/MoveGroup", _move_group),
    RosAction("execute_trajectory", "moveit_msgs/ExecuteTrajectory", _execute),
)
