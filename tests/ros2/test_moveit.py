"""pymoveit2, unmodified, plans and drives an arm on a machine without MoveIt: the parameter `moveit`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rclpy.callback_groups import ReentrantCallbackGroup

from heptarm.model.kinematics import forward
from heptarm.sim.collision import CollisionModel
from heptarm.values import shape
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.conformance.case import rests
from tests.ros2.peer import PATIENCE, Client, until

pymoveit2 = pytest.importorskip("pymoveit2")

HOME = np.radians([0, 30, 0, -90, 0, 60, 0]).tolist()
THERE = [np.radians(60.0), *HOME[1:]]
#: A wall between both: edges [m], position [m], turned about z by 30 degrees.
WALL, PLACE, TURN = (0.5, 0.02, 0.7), (0.5, 0.33, 0.35), (0.0, 0.0, np.sin(np.pi / 12), np.cos(np.pi / 12))


@pytest.fixture
def moveit(client: Client, request: pytest.FixtureRequest) -> Iterator[Any]:
    made = client.ros.do(
        pymoveit2.MoveIt2,
        node=client.ros.node,
        joint_names=list(client.joints),
        base_link_name="link_0",
        end_effector_name="flange",
        callback_group=ReentrantCallbackGroup(),
        use_move_group_action=request.param == "move_action",
    )
    client.ros.meet(f"{client.name}/plan")  # the node has discovered its clients, too
    made.max_velocity, made.allowed_planning_time = 0.6, 100.0
    yield made
    cleared = until(made.clear_all_collision_objects, "the world cannot be cleared")
    assert client.ros.wait(cleared, "the world is not cleared").success
    client.ros.do(made.destroy)


@pytest.mark.parametrize(
    "moveit", ["move_action", pytest.param("execute_trajectory", marks=pytest.mark.long)], indirect=True
)
def test_pymoveit2_plans_around_a_wall_and_drives(client: Client, moveit: Any) -> None:
    assert moveit.move_to_configuration(HOME, timeout_sec=PATIENCE) and moveit.wait_until_executed(PATIENCE)
    moveit.add_collision_box(id="wall", size=WALL, position=PLACE, quat_xyzw=TURN)
    until(
        lambda: moveit.update_planning_scene() and moveit.planning_scene.world.collision_objects,
        "the wall does not come",
    )
    begin = client.now()
    assert moveit.move_to_configuration(THERE, timeout_sec=PATIENCE), moveit.last_failure()
    assert moveit.wait_until_executed(PATIENCE), moveit.last_failure()
    rests(client)
    np.testing.assert_allclose(client.place().q, THERE, atol=0.01)
    world = CollisionModel("iiwa14")
    world.add("wall", shape.box(*WALL), at=Pose.of(PLACE, TURN))
    driven = np.array([q for _, q in client.track(begin)])
    assert world.first_on(np.array([HOME, THERE])) is not None, "straight there it would hit the wall"
    assert len(driven) > 50 and world.distances(driven[::5]).min() > 0.0


@pytest.mark.parametrize("moveit", ["move_action"], indirect=True)
def test_pymoveit2_drives_lines_and_asks_for_kinematics(client: Client, moveit: Any) -> None:
    assert moveit.move_to_configuration(HOME, timeout_sec=PATIENCE) and moveit.wait_until_executed(PATIENCE)
    there = Pose.from_matrix(forward(robot("iiwa14"), HOME))
    found = until(lambda: moveit.compute_fk(joint_state=HOME), "no forward kinematics")
    np.testing.assert_allclose(found.pose.position.z, there.xyz[2], atol=1e-6)
    wanted = there.xyz + [0.0, 0.05, 0.1]
    solved = until(
        lambda: moveit.compute_ik(position=wanted.tolist(), quat_xyzw=there.quat.tolist()), "no IK"
    )
    q = [dict(zip(solved.name, solved.position))[name] for name in client.joints]
    np.testing.assert_allclose(forward(robot("iiwa14"), q)[:3, 3], wanted, atol=1e-6)
    far = {
        "position": (there.xyz + [0.6, 0.0, 0.0]).tolist(),
        "quat_xyzw": there.quat.tolist(),
        "cartesian": True,
    }
    assert moveit.plan(**far, cartesian_fraction_threshold=0.9) is None, "out of reach"
    part = moveit.plan(**far, cartesian_fraction_threshold=0.1)
    ends = [forward(robot("iiwa14"), point.positions)[:3, 3] for point in (part.points[0], part.points[-1])]
    assert 0.06 < ends[1][0] - ends[0][0] < 0.54 and abs(ends[1] - ends[0])[1:].max() < 1e-3
    begin = client.now()
    pose = {"position": wanted.tolist(), "quat_xyzw": there.quat.tolist()}
    assert moveit.move_to_pose(**pose, cartesian=True, timeout_sec=PATIENCE), moveit.last_failure()
    assert moveit.wait_until_executed(PATIENCE), moveit.last_failure()
    rests(client)
    places = np.array([forward(robot("iiwa14"), q)[:3, 3] for _, q in client.track(begin)])
    np.testing.assert_allclose(places[-1], wanted, atol=2e-3)
    along = (wanted - there.xyz) / np.linalg.norm(wanted - there.xyz)
    assert np.linalg.norm(np.cross(places - there.xyz, along), axis=1).max() < 3e-3, "a straight line"
