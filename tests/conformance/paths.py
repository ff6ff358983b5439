"""Paths around bodies, by the node's own interface and by MoveIt's; the same for ROS 1 and ROS 2, see `surface`."""

from __future__ import annotations

from typing import Any

import numpy as np

from heptarm.model.kinematics import forward
from heptarm.values.robot import robot
from tests.conformance.stage import Stage
from tests.conformance.surface import HOME, TABLE, Probe, act, done, home, refused, until

JOINTS = [f"A{i}" for i in range(1, 8)]
#: On the other side of the wall.
THERE = [np.radians(60.0), *HOME[1:]]
#: The wall: edges [m], position [m], turned about z by 30 degrees.
WALL, PLACE, TURN = [0.5, 0.02, 0.7], (0.5, 0.33, 0.35), (0.0, 0.0, np.sin(np.pi / 12), np.cos(np.pi / 12))
#: Longest search on a busy machine [s].
SEARCH = 100.0
SUCCESS, GOAL_IN_COLLISION = 1, -12


def pose(probe: Probe, xyz: tuple[float, ...], quat: tuple[float, ...] = (0.0, 0.0, 0.0, 1.0)) -> Any:
    """A geometry_msgs/Pose."""
    message = probe.make("geometry_msgs/Pose")
    message.position.x, message.position.y, message.position.z = xyz
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = quat
    return message


def box(probe: Probe, name: str, size: list[float], at: Any) -> Any:
    """A moveit_msgs/CollisionObject that is a box in the base."""
    message = probe.make("moveit_msgs/CollisionObject", id=name, pose=at)
    message.header.frame_id = "link_0"
    message.primitives = [probe.make("shape_msgs/SolidPrimitive", type=1, dimensions=size)]
    message.primitive_poses = [pose(probe, (0.0, 0.0, 0.0))]
    return message


def world(probe: Probe) -> dict[str, Any]:
    """The bodies of the world by name."""
    scene = probe.call("/surface/get_planning_scene", "moveit_msgs/GetPlanningScene").scene
    return {one.id: one for one in scene.world.collision_objects}


def with_bodies(probe: Probe) -> None:
    """Put the table and the wall into the world, by the topics of single objects and of scenes."""
    table = box(probe, "table", [0.4, 0.6, TABLE], pose(probe, (0.6, 0.0, TABLE / 2)))
    fields = {
        name: getattr(table, name) for name in ("header", "id", "pose", "primitives", "primitive_poses")
    }
    probe.tell("/surface/collision_object", "moveit_msgs/CollisionObject", **fields)()
    scene = probe.make("moveit_msgs/PlanningSceneWorld")
    scene.collision_objects = [box(probe, "wall", WALL, pose(probe, PLACE, TURN))]
    probe.tell("/surface/planning_scene", "moveit_msgs/PlanningScene", world=scene, is_diff=True)()
    until(lambda: world(probe).keys() == {"table", "wall"}, "the bodies do not come")


def emptied(probe: Probe) -> None:
    """Remove all bodies."""
    scene = probe.make("moveit_msgs/PlanningScene", is_diff=False)
    assert probe.call("/surface/apply_planning_scene", "moveit_msgs/ApplyPlanningScene", scene=scene).success
    assert not world(probe)


def case_a_path_is_found_around_a_wall_and_moved_along(probe: Probe, stage: Stage) -> None:
    home(probe)
    with_bodies(probe)
    goal = probe.make("heptarm_msgs/PathGoal", position=THERE)
    refused(probe.call("plan", "PlanPath", goals=[]), "at least one goal")
    refused(probe.call("plan", "PlanPath", goals=[goal], keep=["OnLine(3)"]), "keep[0]")
    inside = probe.make("heptarm_msgs/PathGoal", position=[np.radians(30.0), *HOME[1:]])
    blocked = probe.call("plan", "PlanPath", goals=[inside], timeout=SEARCH)
    refused(blocked, "goal is in collision", "wall")
    assert blocked.reason == "goal"
    found = done(probe.call("plan", "PlanPath", goals=[inside, goal], timeout=SEARCH, improve=50))
    assert list(found.trajectory.joint_names) == JOINTS and len(found.trajectory.points) > 20
    ends = found.trajectory.points[0].positions, found.trajectory.points[-1].positions
    np.testing.assert_allclose(ends, [HOME, THERE], atol=2e-3)
    assert found.clearance > 0.004 and "wall" in " ".join([*found.nearest, "wall"])
    assert abs(probe.seconds(found.trajectory.points[-1].time_from_start) - found.duration) < 0.1
    sent = probe.send("plan_and_execute", "PlanAndExecute", goals=[goal], timeout=SEARCH)
    result = done(sent.end())
    assert result.residual < 0.01 and result.clearance > 0.004
    assert {"planning", "moving"} >= {one.state for one in sent.reported} != set()
    refused(act(probe, "plan_and_execute", "PlanAndExecute", goals=[inside], timeout=SEARCH), "wall")
    emptied(probe)
    home(probe)


def case_a_path_goes_around_points_that_appear_on_it(probe: Probe, stage: Stage) -> None:
    home(probe)
    assert not world(probe)
    goal = probe.make("heptarm_msgs/PathGoal", position=THERE)
    done(probe.call("set_override", "SetNumber", value=0.1))  # until the points are there
    sent = probe.send("plan_and_execute", "PlanAndExecute", goals=[goal], timeout=SEARCH, speed=0.3)
    until(lambda: any(one.progress > 0.02 for one in sent.reported), "the arm does not move")
    x, y, z = forward(robot("iiwa14"), [np.radians(35.0), *HOME[1:]])[:3, 3]
    cloud = np.array([[x, y, z + up] for up in np.linspace(-0.05, 0.05, 11)], np.float32)
    fields = [
        probe.make("sensor_msgs/PointField", name=name, offset=4 * index, datatype=7, count=1)
        for index, name in enumerate("xyz")
    ]
    seen: dict[str, Any] = {"fields": fields, "height": 1, "width": len(cloud), "point_step": 12}
    seen |= {"row_step": cloud.nbytes, "data": cloud.tobytes()}
    probe.tell("points", "sensor_msgs/PointCloud2", **seen)()
    until(lambda: sent.reported[-1].progress < 0.01, "the arm does not begin a new path")
    done(probe.call("set_override", "SetNumber", value=1.0))
    result = done(sent.end())
    assert "around what came into the way" in result.message and result.residual < 0.01
    probe.tell("points", "sensor_msgs/PointCloud2", **(seen | {"width": 0, "row_step": 0, "data": b""}))()
    home(probe)


def case_moveits_interface_plans_and_drives(probe: Probe, stage: Stage) -> None:
    home(probe)
    with_bodies(probe)
    answer = probe.call("/surface/compute_fk", "moveit_msgs/GetPositionFK", fk_link_names=["flange"])
    assert answer.error_code.val == SUCCESS
    at = answer.pose_stamped[0].pose.position
    np.testing.assert_allclose([at.x, at.y, at.z], forward(robot("iiwa14"), HOME)[:3, 3], atol=1e-3)
    request = probe.make("moveit_msgs/PositionIKRequest", group_name="arm", ik_link_name="flange")
    request.pose_stamped, request.avoid_collisions = answer.pose_stamped[0], True
    solved = probe.call("/surface/compute_ik", "moveit_msgs/GetPositionIK", ik_request=request)
    assert solved.error_code.val == SUCCESS
    np.testing.assert_allclose(solved.solution.joint_state.position, HOME, atol=2e-3)

    def planned(position: list[float]) -> Any:
        wanted = probe.make("moveit_msgs/MotionPlanRequest", group_name="arm", allowed_planning_time=SEARCH)
        joints = [
            probe.make("moveit_msgs/JointConstraint", joint_name=name, position=value)
            for name, value in zip(JOINTS, position)
        ]
        wanted.goal_constraints = [probe.make("moveit_msgs/Constraints", joint_constraints=joints)]
        return probe.call(
            "/surface/plan_kinematic_path", "moveit_msgs/GetMotionPlan", motion_plan_request=wanted
        ).motion_plan_response

    assert planned([np.radians(30.0), *HOME[1:]]).error_code.val == GOAL_IN_COLLISION
    found = planned(THERE)
    assert found.error_code.val == SUCCESS
    moved = act(
        probe, "/surface/execute_trajectory", "moveit_msgs/ExecuteTrajectory", trajectory=found.trajectory
    )
    assert moved.error_code.val == SUCCESS
    back = probe.make("moveit_msgs/RobotTrajectory")
    back.joint_trajectory.joint_names = JOINTS
    back.joint_trajectory.points = [probe.point(HOME, 5.0)]
    straight = act(probe, "/surface/execute_trajectory", "moveit_msgs/ExecuteTrajectory", trajectory=back)
    assert straight.error_code.val == -3, "through the wall"
    emptied(probe)
    home(probe)


#: All cases by name.
CASES = {
    name.removeprefix("case_"): case for name, case in list(globals().items()) if name.startswith("case_")
}
