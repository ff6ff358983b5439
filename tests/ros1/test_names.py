"""Programs written for other drivers, with those drivers' own types."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

import numpy as np
import pytest
import rospy
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from heptarm_msgs.msg import Status
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from heptarm.ros.interface.names import PRESETS
from tests.conformance import iiwa_stack, names
from tests.conformance.stage import ROOT, Stage
from tests.ros1.peer import NodeProcess, SimpleClient, active, collect, publisher, until
from tests.ros1.test_examples import run
from tests.ros1.test_surface import Client

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


@pytest.fixture
def other(ros: None, spare: Stage, request: pytest.FixtureRequest) -> Iterator[Client]:
    """A node with the names of the driver that the test is for."""
    node = NodeProcess(spare.target, ns="/other", names=request.param, speed=0.6)
    yield Client("/other")
    assert node.end() == 0, node.said


@pytest.mark.long  # every run has it with the node of ROS 2
@pytest.mark.parametrize("other", ["libiiwa"], indirect=True)
def test_a_program_for_libiiwa(other: Client) -> None:
    names.a_program_for_libiiwa(other)
    names.servo_of_libiiwa(other)
    states = other.listen("iiwa/state/joint_states", "sensor_msgs/JointState")
    until(lambda: states, "no states come")
    follow("/other/iiwa_controller/follow_joint_trajectory", states)


@pytest.mark.long  # every run has it with the node of ROS 2
@pytest.mark.parametrize("other", ["lbr_stack"], indirect=True)
def test_a_program_for_lbr_stack(other: Client) -> None:
    names.a_program_for_lbr_stack(other)


@pytest.mark.parametrize("other", ["iiwa_stack"], indirect=True)
def test_a_program_for_iiwa_stacks_own_interface(other: Client) -> None:
    iiwa_stack.a_program_for_iiwa_stack(other)
    iiwa_stack.actions_of_iiwa_stack(other)
    iiwa_stack.control_modes_of_iiwa_stack(other)
    a_snippet_runs("/other")


def a_snippet_runs(space: str) -> None:
    """The guide's program for iiwa_stack, as it is; it receives the node's namespace as every ROS program does."""
    text = (ROOT / "docs" / "guide" / "migration.md").read_text(encoding="utf-8")
    source = text.partition("```python no-run\n")[2].partition("```")[0]
    moved = [f"{name}:={space}{name}" for name in re.findall(r"/iiwa/\w+/\w+", source)]
    assert len(moved) == 2 and run([sys.executable, "-c", source, *moved]).strip() == "there"


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
    client = SimpleClient(name, FollowJointTrajectoryAction)
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
    given = [entry.name for entry in PRESETS[preset].entries]
    assert len(set(given)) == len(given)
