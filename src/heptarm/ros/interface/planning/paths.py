"""The service `plan` and the action `plan_and_execute`: requests to `Arm.find_path`, and its paths as messages."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import nan
from typing import Any, cast

import numpy as np

from heptarm.arm.motion.following import FollowedPath
from heptarm.errors import HeptarmError, NoPath, ShapeError
from heptarm.planning.constraints import constraint_from_text
from heptarm.planning.search import STATES, TIMEOUT
from heptarm.ros.interface.action import (
    ActionResult,
    GoalClient,
    GoalWork,
    ended,
    result_of_failed_task,
    wait_for_task,
)
from heptarm.ros.interface.conditions import condition_of, reaction_of
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.motions import positions, stamped_pose
from heptarm.ros.interface.service import ServiceResponse
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.values.checks import Array
from heptarm.values.motion.planned_path import Path, Region
from heptarm.values.pose import Pose

#: Time between two points of a trajectory [s], and the most points that one has.
_STEP, _MOST_POINTS = 0.02, 1000


def plan(context: NodeContext, request: Any) -> ServiceResponse:
    """Find a path around the bodies of the world."""
    find = _search(context, request)
    try:
        path = find(None)
    except NoPath as error:
        return ServiceResponse(False, str(error), {"reason": error.reason, "clearance": nan})
    fields = {**_fields(path), "trajectory": timed(context, path, speed=_speed(context, request))}
    return ServiceResponse(True, str(path), fields)


def plan_and_execute(context: NodeContext, goal: Any) -> GoalWork:
    """Find a path around the bodies of the world, move along it, and around what comes into the way."""
    context.check_active()
    until, then = condition_of(goal.until), reaction_of(goal.then)  # refused now, not after the search
    find = _search(context, goal)

    def work(client: GoalClient) -> ActionResult:
        client.publish_feedback({"state": "planning"})
        try:
            path = find(client.is_cancel_requested)
        except NoPath as error:
            return _not_found(error, client)
        except HeptarmError as error:
            return ActionResult(GoalOutcome.ABORTED, str(error), {"clearance": nan})
        driver = context.driver
        follow = partial(
            context.arm.follow,
            path,
            speed=_speed(context, goal),
            until=driver.guard if until is None else until,
            then=then,
        )
        return _moved(context, path, follow, client)

    return work


def _moved(
    context: NodeContext, path: Path, follow: Callable[..., FollowedPath], client: GoalClient
) -> ActionResult:
    """Move along a path in a task, which watches the world.

    Args:
        context: of the node.
        path: begins where the arm rests.
        follow: `Arm.follow` along it.
        client: of the goal.
    """
    done = deque([0.0], maxlen=1)
    try:
        task = context.driver.run_task("the path", partial(follow, on_progress=done.append))
    except HeptarmError as error:
        return ActionResult(GoalOutcome.ABORTED, str(error), _fields(path))

    def report() -> None:
        client.publish_feedback({"state": "moving", "progress": done[-1]})

    failure = wait_for_task(task, client, report)
    if failure is not None:
        why = {"reason": failure.reason} if isinstance(failure, NoPath) else {}
        return replace(result_of_failed_task(task, client, failure), fields={**_fields(path), **why})
    found: FollowedPath = task.result()
    result = ended(found.result, cancelled=client.is_cancel_requested())
    last = found.detours[-1].path if found.detours else path
    count = len(found.detours)
    around = f", {count} times around what came into the way" if count else ""
    fields = {name: value for name, value in result.fields.items() if name != "item"}
    return replace(result, text=result.text + around, fields={**_fields(last), **fields})


def _not_found(error: NoPath, client: GoalClient) -> ActionResult:
    fields = {"reason": error.reason, "clearance": nan}
    if client.is_cancel_requested():
        return ActionResult(GoalOutcome.CANCELED, "cancelled during the search; nothing has moved", fields)
    return ActionResult(GoalOutcome.ABORTED, str(error), fields)


def _search(context: NodeContext, request: Any) -> Callable[[Callable[[], bool] | None], Path]:
    """Check a request; the function that is returned searches, until its argument returns true.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    goals = [_goal(context, goal, f"goals[{index}]") for index, goal in enumerate(request.goals)]
    if not goals:
        raise ShapeError("goals must have at least one goal, got none", parameter="goals")
    keep = [constraint_from_text(one, f"keep[{index}]") for index, one in enumerate(request.keep)]
    world, speed = context.world.model, _speed(context, request)

    def find(stop: Callable[[], bool] | None) -> Path:
        return context.arm.find_path(
            goals,
            avoid=world,
            keep=keep,
            speed=speed,
            tcp_speed=request.tcp_speed or None,
            timeout=request.timeout or TIMEOUT,
            states=request.states or STATES,
            improve=request.improve,
            seed=request.seed,
            stop=stop,
        )

    return find


def _goal(context: NodeContext, message: Any, name: str) -> Array | Pose | Region:
    """Convert a heptarm_msgs/PathGoal."""
    region = [*message.box, message.cone, message.turn]
    if len(message.position):
        if any(region):
            raise ShapeError(
                f"{name} has joint positions and a region around a pose, which exclude each other",
                parameter=name,
                hint="give one",
            )
        return positions(context.driver, message.joint_names, message.position)
    pose = stamped_pose(message.pose, context.driver)
    if not any(region):
        return pose
    return Region.of(pose, box=list(message.box) or (0.0, 0.0, 0.0), cone=message.cone, turn=message.turn)


def _speed(context: NodeContext, request: Any) -> float:
    return cast(float, request.speed or context.driver.configuration.values["speed"])


def _fields(path: Path) -> dict[str, Any]:
    near = path.clearance
    return {
        "duration": path.duration,
        "clearance": nan if near is None else near.distance,
        "nearest": [] if near is None else [near.first, near.second],
    }


# -------------------------------------------------------------------------------------- trajectories


def timed(context: NodeContext, path: Path, *, speed: float) -> dict[str, Any]:
    """Fields of the trajectory_msgs/JointTrajectory of a path, as fast as the arm moves along it at a speed."""
    step = max(_STEP, path.duration / _MOST_POINTS)
    preview = context.arm.plan(path, speed=speed, start=path.start, step=step)
    return trajectory_fields(context, preview.t, preview.q, preview.dq, preview.ddq)


def trajectory_fields(context: NodeContext, t: Array, q: Array, dq: Array, ddq: Array) -> dict[str, Any]:
    """Fields of a trajectory_msgs/JointTrajectory that begins and ends at rest.

    Args:
        context: of the node.
        t: times, shape (n,) [s].
        q: positions, shape (n, 7) [rad].
        dq: velocities, shape (n, 7) [rad/s].
        ddq: accelerations, shape (n, 7) [rad/s²].
    """
    ros, moving = context.ros, np.ones(len(t))
    moving[-1] = 0.0
    rows = zip(t.tolist(), q.tolist(), (moving[:, None] * dq).tolist(), (moving[:, None] * ddq).tolist())
    points = [
        ros.point(
            positions=place,
            velocities=velocity,
            accelerations=acceleration,
            time_from_start=ros.duration(time),
        )
        for time, place, velocity, acceleration in rows
    ]
    return {"joint_names": context.joints, "points": points}
