"""Single motions as actions: progress, arrival, cancellation, preemption, refusal."""

from __future__ import annotations

import numpy as np
import pytest
import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped
from heptarm_msgs.msg import MoveJointsAction, MoveJointsGoal, MovePoseAction, MovePoseGoal

from tests.conformance.case import rests
from tests.ros1.peer import Client, SimpleClient, collect, fresh, until

HOME = np.radians([0, 30, 0, -90, 0, 60, 0]).tolist()
LONG = rospy.Duration(60)


@pytest.fixture
def joints(client: Client) -> SimpleClient:
    return SimpleClient("/heptarm/move_joints", MoveJointsAction)


@pytest.fixture
def poses(client: Client) -> SimpleClient:
    return SimpleClient("/heptarm/move_pose", MovePoseAction)


def test_a_motion_of_joints_reports_how_far_it_is(client: Client, joints: SimpleClient) -> None:
    reported: list[float] = []
    goal = MoveJointsGoal(position=HOME, speed=0.5)
    joints.send_goal(goal, feedback_cb=lambda feedback: reported.append(feedback.progress))
    assert joints.wait_for_result(LONG)
    assert joints.get_state() == GoalStatus.SUCCEEDED and joints.get_result().success
    assert joints.get_result().residual < 1e-3
    # actionlib drops feedback that arrives after the result, by another path
    assert reported == sorted(reported) and 0.0 < reported[-1] <= 1.0
    assert np.abs(rests(client) - HOME).max() < 2e-3


def test_lines_and_arcs(client: Client, joints: SimpleClient, poses: SimpleClient) -> None:
    joints.send_goal_and_wait(MoveJointsGoal(position=HOME, speed=0.5), LONG)
    rests(client)
    seen = collect("/heptarm/pose", PoseStamped)
    down, there = MovePoseGoal(path=MovePoseGoal.LIN, pose=fresh(seen)), MovePoseGoal(path=MovePoseGoal.CIRC)
    down.pose.pose.position.z -= 0.05
    assert poses.send_goal_and_wait(down, LONG) == GoalStatus.SUCCEEDED, poses.get_result()
    rests(client)
    low = fresh(seen)
    count = len(seen)
    there.pose, there.via = fresh(seen), fresh(seen)
    there.pose.pose.position.y += 0.1
    there.via.pose.position.y += 0.05
    there.via.pose.position.z += 0.05
    assert poses.send_goal_and_wait(there, LONG) == GoalStatus.SUCCEEDED, poses.get_result()
    rests(client)
    assert abs(fresh(seen).pose.position.y - low.pose.position.y - 0.1) < 2e-3
    top = max(one.pose.position.z for one in seen[count:])
    assert abs(top - there.via.pose.position.z) < 3e-3


def test_cancelling_brakes_on_the_path(client: Client, joints: SimpleClient) -> None:
    here = rests(client)
    joints.send_goal(MoveJointsGoal(joint_names=["A1"], position=[here[0] + 2.0], speed=0.3))
    until(lambda: client.place().dq[0] > 0.1, "the arm does not set out")
    joints.cancel_goal()
    assert joints.wait_for_result(LONG)
    assert joints.get_state() == GoalStatus.PREEMPTED and not joints.get_result().success
    assert rests(client)[0] < here[0] + 1.9


def test_another_motion_takes_the_place_and_a_trajectory_too(client: Client, joints: SimpleClient) -> None:
    here = rests(client)
    other = SimpleClient("/heptarm/move_joints", MoveJointsAction)
    joints.send_goal(MoveJointsGoal(joint_names=["A1"], position=[here[0] - 2.0], speed=0.3))
    until(lambda: client.place().dq[0] < -0.1, "the arm does not set out")
    state = other.send_goal_and_wait(MoveJointsGoal(joint_names=["A1"], position=[here[0]]), LONG)
    assert state == GoalStatus.SUCCEEDED, other.get_result()
    assert joints.wait_for_result(LONG) and joints.get_state() == GoalStatus.PREEMPTED
    rests(client)


@pytest.mark.parametrize(
    ("names", "values", "speed", "word"),
    [
        (["elbow"], [0.0], 0.0, "elbow"),
        (["A1"], [9.0], 0.0, "A1"),
        (["A1"], [0.1], 3.0, "speed"),
    ],
)
def test_a_senseless_motion_is_rejected_in_words(
    joints: SimpleClient, names: list[str], values: list[float], speed: float, word: str
) -> None:
    goal = MoveJointsGoal(joint_names=names, position=values, speed=speed)
    assert joints.send_goal_and_wait(goal, LONG) == GoalStatus.REJECTED
    assert not joints.get_result().success and word in joints.get_result().message
