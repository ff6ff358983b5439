"""Single motions as actions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose, PoseStamped
from heptarm_msgs.action import MoveJoints, MovePose

from tests.conformance.case import rests
from tests.ros2.peer import Client, Ros, fresh, until

HOME = np.radians([0, 30, 0, -90, 0, 60, 0]).tolist()


class Moves:
    """A client of one action."""

    def __init__(self, ros: Ros, kind: Any, name: str) -> None:
        self.ros, self.kind = ros, kind
        self.reported: list[float] = []
        self._client = ros.act(kind, name)

    def start(self, **goal: Any) -> Any:
        handle = self.ros.send_goal(
            self._client, self.kind.Goal(**goal), lambda one: self.reported.append(one.progress)
        )
        assert handle.accepted
        return handle

    def end(self, handle: Any) -> tuple[int, Any]:
        answer = self.ros.wait(handle.get_result_async(), "the motion does not end")
        return answer.status, answer.result


@pytest.fixture
def joints(ros: Ros, client: Client) -> Moves:
    return Moves(ros, MoveJoints, f"{client.name}/move_joints")


def test_a_motion_of_joints_a_line_and_an_arc(ros: Ros, client: Client, joints: Moves) -> None:
    status, result = joints.end(joints.start(position=HOME, speed=0.5))
    assert status == GoalStatus.STATUS_SUCCEEDED and result.success and result.residual < 1e-3
    until(lambda: joints.reported and joints.reported[-1] == 1.0, "the end is not reported")
    assert joints.reported == sorted(joints.reported)
    assert np.abs(rests(client) - HOME).max() < 2e-3
    seen = ros.collect(PoseStamped, f"{client.name}/pose")
    poses = Moves(ros, MovePose, f"{client.name}/move_pose")
    goal = fresh(ros, seen)
    via = PoseStamped(pose=Pose(orientation=goal.pose.orientation))
    place = goal.pose.position
    via.pose.position.x, via.pose.position.y, via.pose.position.z = place.x, place.y + 0.05, place.z - 0.05
    goal.pose.position.y += 0.1
    status, result = poses.end(poses.start(path=MovePose.Goal.CIRC, pose=goal, via=via))
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    rests(client)
    assert abs(fresh(ros, seen).pose.position.y - goal.pose.position.y) < 2e-3


def test_cancelling_brakes_and_a_senseless_motion_is_aborted_in_words(
    ros: Ros, client: Client, joints: Moves
) -> None:
    here = rests(client)
    handle = joints.start(joint_names=["A1"], position=[here[0] + 2.0], speed=0.3)
    until(lambda: client.place().dq[0] > 0.1, "the arm does not set out")
    ros.wait(handle.cancel_goal_async(), "no answer")
    status, result = joints.end(handle)
    assert status == GoalStatus.STATUS_CANCELED and not result.success
    assert rests(client)[0] < here[0] + 1.9
    status, result = joints.end(joints.start(joint_names=["elbow"], position=[0.0]))
    assert status == GoalStatus.STATUS_ABORTED and "elbow" in result.message
