"""Faults: power cuts, emergency stops, killed clients, wrong parameters."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import braked, long, quiet, rests, step
from tests.conformance.stage import Stage
from tests.ros1.peer import PATIENCE, Client, NodeProcess, call, collect, until

CLIENT = """
import actionlib, rospy, sys
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectoryPoint
rospy.init_node("victim", anonymous=True)
here = rospy.wait_for_message("/joint_states", JointState)
goal = FollowJointTrajectoryGoal()
goal.trajectory.joint_names = here.name
there = [q + 0.1 for q in here.position]
goal.trajectory.points = [JointTrajectoryPoint(positions=there, time_from_start=rospy.Duration(2.0))]
client = actionlib.SimpleActionClient("/heptarm/follow_joint_trajectory", FollowJointTrajectoryAction)
client.wait_for_server()
client.send_goal(goal, feedback_cb=lambda _: print("moving", flush=True))
rospy.spin()
"""


def test_a_killed_client_leaves_a_node_that_lives(client: Client) -> None:
    here = rests(client)
    victim = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(CLIENT)], stdout=subprocess.PIPE, text=True
    )
    assert victim.stdout is not None and victim.stdout.readline() == "moving\n"
    victim.send_signal(signal.SIGKILL)
    victim.wait()
    victim.stdout.close()
    # its goal is finished, as upstream's servers do
    until(lambda: np.abs(client.place().q - here - 0.1).max() < 0.012, "the goal is not finished")
    rests(client)
    assert client.result(client.send(step(client, size=-1.0))).code is ErrorCode.SUCCESSFUL


@pytest.fixture(scope="module")
def spare_node(ros: None, spare: Stage) -> Iterator[NodeProcess]:
    """A node of another arm, for tests that may damage it."""
    node = NodeProcess(spare.target, ns="/other", prefix="other_", diagnostics_rate=10.0)
    yield node
    assert node.end() == 0, node.said


@pytest.fixture(scope="module")
def other(spare: Stage, spare_node: NodeProcess) -> Client:
    """A client of it."""
    client = Client(spare, name="/other/heptarm", prefix="other_")
    client.ready()
    return client


def test_an_emergency_stop_ends_the_goal(other: Client) -> None:
    sent = other.send(long(other))
    until(lambda: other.feedback(sent), "the goal does not begin")
    other.stage.do("press")
    ended = other.result(sent)
    assert ended.outcome is GoalOutcome.ABORTED and ended.code is ErrorCode.INVALID_GOAL
    until(lambda: other.status[-1].emergency_stop, "the status does not tell")
    refused = other.send(step(other))
    assert not refused.accepted and refused.code is ErrorCode.INVALID_GOAL
    other.stage.do("release")
    until(lambda: not other.status[-1].emergency_stop, "the status does not tell")
    until(lambda: call("/other/heptarm/recover", Trigger).success, "the arm does not recover")
    until(lambda: other.status[-1].ready_to_move, "the status does not tell")
    rests(other)
    assert other.result(other.send(step(other))).code is ErrorCode.SUCCESSFUL


@pytest.mark.long  # every run has it with the node of ROS 2
def test_a_cabinet_without_power_and_back(other: Client) -> None:
    reports = collect("/diagnostics", DiagnosticArray)
    sent = other.send(long(other))
    until(lambda: other.feedback(sent), "the goal does not begin")
    other.stage.kill()
    ended = other.result(sent)
    assert ended.outcome is GoalOutcome.ABORTED and ended.code is ErrorCode.INVALID_GOAL
    until(lambda: not other.status[-1].connected, "the status does not tell")
    until(lambda: any(one.status[0].level == 2 for one in reports), "diagnostics do not tell")
    until(lambda: quiet(other), "old states are repeated")
    refused = other.send(step_anywhere(other))
    assert not refused.accepted
    other.stage.restart()
    until(lambda: other.status[-1].connected, "the node does not reconnect")
    rests(other)
    times = [message.header.stamp.to_nsec() for message in other.states]
    assert len(set(times)) == len(times)
    assert other.result(other.send(step(other))).code is ErrorCode.SUCCESSFUL


@pytest.mark.long  # every run has it with the node of ROS 2
def test_a_node_that_the_system_stops_for_a_while(
    other: Client, spare: Stage, spare_node: NodeProcess
) -> None:
    """The cabinet brakes the arm, the goal ends, and the node continues."""
    sent = other.send(step(other, time=9.0, size=6.0))
    until(lambda: other.feedback(sent), "the goal does not begin")
    spare_node.process.send_signal(signal.SIGSTOP)
    braked(spare)
    spare_node.process.send_signal(signal.SIGCONT)
    ended = other.result(sent)
    assert (ended.outcome, ended.code) == (GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL), ended
    other.ready()
    rests(other)
    assert other.result(other.send(step(other))).code is ErrorCode.SUCCESSFUL


def step_anywhere(client: Client) -> TrajectoryGoal:
    return TrajectoryGoal(client.joints, (TrajectoryPoint(5.0, (0.0,) * 7),))


@pytest.mark.long  # every run has it with the node of ROS 2
def test_without_a_cabinet_it_waits_and_a_wrong_parameter_ends_it_with_one_line(
    ros: None, spare: Stage
) -> None:
    lonely = NodeProcess("127.0.0.1:9", name="lonely")
    wrong = NodeProcess(spare.target, name="wrong", servo__rate=-3)
    twice = NodeProcess(spare.target, name="twice", joint_names="[A1, A1, A3, A4, A5, A6, A7]")
    lonely.waits_for("wait, the next attempt is in 2 s")
    assert lonely.end() == 0, lonely.said
    for node, words in (
        (wrong, "servo.rate must be in [1, 500], got -3"),
        (twice, "joint_names must have seven different names"),
    ):
        assert node.process.wait(PATIENCE) == 1
        assert words in node.said and "Traceback" not in node.said, node.said


def test_the_arm_comes_to_rest_when_the_node_ends(other: Client, spare_node: NodeProcess) -> None:
    sent = other.send(long(other))
    until(lambda: other.feedback(sent), "the goal does not begin")
    assert spare_node.end(signal.SIGTERM) == 0, spare_node.said
    ended = other.result(sent)
    assert ended.outcome is GoalOutcome.ABORTED, ended
