"""Our definitions of control_msgs have upstream's check sums; otherwise no client could connect."""

from __future__ import annotations

import pytest
from control_msgs import msg, srv

SUMS = {
    "FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
    "FollowJointTrajectoryActionGoal": "cff5c1d533bf2f82dd0138d57f4304bb",
    "FollowJointTrajectoryGoal": "69636787b6ecbde4d61d711979bc7ecb",
    "FollowJointTrajectoryActionResult": "c4fb3b000dc9da4fd99699380efcc5d9",
    "FollowJointTrajectoryResult": "493383b18409bfb604b4e26c676401d2",
    "FollowJointTrajectoryActionFeedback": "d8920dc4eae9fc107e00999cce4be641",
    "FollowJointTrajectoryFeedback": "10817c60c2486ef6b33e97dcd87f4474",
    "JointTrajectoryControllerState": "10817c60c2486ef6b33e97dcd87f4474",
    "JointJog": "1685da700c8c2e1254afc92a5fb89c96",
    "GripperCommandAction": "950b2a6ebe831f5d4f4ceaba3d8be01e",
    "GripperCommand": "680acaff79486f017132a7f198d40f08",
    "JointTolerance": "f544fe9c16cf04547e135dd6063ff5be",
}


@pytest.mark.parametrize("name", SUMS)
def test_sum(name: str) -> None:
    assert getattr(msg, name)._md5sum == SUMS[name]


def test_sum_of_the_service() -> None:
    assert srv.QueryTrajectoryState._md5sum == "ec93cdecbd8062d761aa52b7c90cd44b"
