"""Programs written for other drivers: their topics and actions, as far as their types are standard."""

from __future__ import annotations

import math

import actionlib
import numpy as np
import pytest
import rospy
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from geometry_msgs.msg import Pose, Wrench
from heptarm_msgs.msg import Status
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from heptarm.ros.interface.names import PRESETS
from tests.conformance.stage import Stage
from tests.ros1.peer import NodeProcess, active, collect, publisher, until

JOINTS = [f"iiwa_joint_{i}" for i in range(1, 8)]


def started(stage: Stage, preset: str) -> tuple[NodeProcess, list[JointState]]:
    node = NodeProcess(stage.target, ns=f"/{preset}", names=preset)
    active(collect(f"/{preset}/heptarm/status", Status))
    name = next(entry.name for entry in PRESETS[preset].entries if entry.name.endswith("joint_states"))
    states = collect(f"/{preset}/{name}", JointState)
    until(lambda: states and states[-1].name == JOINTS, "no joint states come")
    return node, states


def arrives(states: list[JointState], joint: int, value: float) -> None:
    until(lambda: abs(states[-1].position[joint] - value) < 2e-3, f"joint {joint} does not arrive")


def test_a_program_for_libiiwa(ros: None, spare: Stage) -> None:
    node, states = started(spare, "libiiwa")
    poses = collect("/libiiwa/iiwa/state/end_effector_pose", Pose)
    wrenches = collect("/libiiwa/iiwa/state/end_effector_wrench", Wrench)
    until(lambda: poses and wrenches, "no pose comes")
    joint = publisher("/libiiwa/iiwa/command/joint", JointState)
    stop = publisher("/libiiwa/iiwa/command/stop", Empty)
    joint.publish(JointState(position=[math.nan] * 6 + [0.3]))  # NaN keeps
    arrives(states, 6, 0.3)
    joint.publish(JointState(name=["iiwa_joint_2"], position=[0.2]))
    arrives(states, 1, 0.2)
    height = poses[-1].position.z - 0.05
    target = Pose()
    target.position.x, target.position.y, target.position.z = math.nan, math.nan, height
    publisher("/libiiwa/iiwa/command/cartesian", Pose).publish(target)  # no orientation keeps it
    until(lambda: abs(poses[-1].position.z - height) < 2e-3, "the flange does not arrive")
    joint.publish(JointState(name=["iiwa_joint_1"], position=[2.8]))
    until(lambda: states[-1].velocity[0] > 0.1, "the arm does not set out")
    stop.publish(Empty())
    until(lambda: abs(states[-1].velocity[0]) < 1e-3, "the arm does not stop")
    assert states[-1].position[0] < 2.7
    follow("/libiiwa/iiwa_controller/follow_joint_trajectory", states)
    assert node.end() == 0, node.said


def test_a_program_for_iiwa_stack(ros: None, spare: Stage) -> None:
    node, states = started(spare, "iiwa_stack")
    controller = "/iiwa_stack/iiwa/PositionJointInterface_trajectory_controller"
    follow(f"{controller}/follow_joint_trajectory", states)
    there = list(states[-1].position)
    there[6] += 0.1
    publisher(f"{controller}/command", JointTrajectory).publish(
        JointTrajectory(
            joint_names=JOINTS,
            points=[JointTrajectoryPoint(positions=there, time_from_start=rospy.Duration.from_sec(0.5))],
        )
    )
    arrives(states, 6, there[6])
    assert node.end() == 0, node.said


def follow(name: str, states: list[JointState]) -> None:
    client = actionlib.SimpleActionClient(name, FollowJointTrajectoryAction)
    assert client.wait_for_server(rospy.Duration(60))
    goal = FollowJointTrajectoryGoal()
    goal.trajectory.joint_names = JOINTS
    there = np.array(states[-1].position) + 0.05
    goal.trajectory.points = [
        JointTrajectoryPoint(positions=there.tolist(), time_from_start=rospy.Duration.from_sec(0.6))
    ]
    client.send_goal(goal)
    assert client.wait_for_result(rospy.Duration(60))
    assert client.get_result().error_code == 0, client.get_result()
    arrives(states, 0, there[0])


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_name_a_topic_once(preset: str) -> None:
    names = [entry.name for entry in PRESETS[preset].entries]
    assert len(set(names)) == len(names)
