"""Our definitions of other packages have upstream's check sums; otherwise no client could connect."""

from __future__ import annotations

import iiwa_msgs.msg
import iiwa_msgs.srv
import moveit_msgs.msg
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


#: As generated code of iiwa_stack's users has them.
IIWA_SUMS = {
    "msg.CartesianControlModeLimits": "36b3a99aeab262cf60ecef9129ccb529",
    "msg.CartesianPose": "92a9835b358c99d9efbecb11c25db23d",
    "msg.CartesianWrench": "b710d3269f35c0e4079ef3ef88f25c6c",
    "msg.ControlMode": "fbf6f4c74f01882c27df4152be6af2d9",
    "msg.DOF": "c1a133d87080cb4a84e23090e4a06363",
    "msg.DesiredForceControlMode": "da11717a4c7e94e66d2e956ead0bf6f3",
    "msg.JointPositionVelocity": "08519eea0692f4458e7be483616eb8cd",
    "msg.JointQuantity": "b9f90cf50b6e4af396f731df7da11689",
    "msg.SplineSegment": "ac36e232cb478b25636a98607933811b",
    "srv.ConfigureControlMode": "680a54772ae74cfe325dd171700c3d78",
    "srv.SetEndpointFrame": "422abb646a850d7c7d04073e2d2f950e",
    "srv.SetPTPCartesianSpeedLimits": "f4c42c9db5a373c4820a5b6872a3a795",
    "srv.SetPTPJointSpeedLimits": "e5ffdd082606e43192e0949ab1d5a1f3",
    "srv.SetSmartServoJointSpeedLimits": "960e33fb145e93219db644650cd367e4",
    "srv.SetSmartServoLinSpeedLimits": "ba27ded3da7c7c0e58e5316ff3ba3f60",
    "srv.SetSpeedOverride": "5cb6d9d155adc8ed76143d144d178f68",
    "srv.SetWorkpiece": "63c849990571529ad5b5c1483c88f899",
    "srv.TimeToDestination": "b71b59cce98847d0bd0310eb052e8f3f",
}


@pytest.mark.parametrize("name", IIWA_SUMS)
def test_sum_of_iiwa_stack(name: str) -> None:
    part, _, kind = name.partition(".")
    assert getattr(getattr(iiwa_msgs, part), kind)._md5sum == IIWA_SUMS[name]


def test_sums_of_moveit() -> None:
    """Each covers all the messages inside of it."""
    assert moveit_msgs.msg.CollisionObject._md5sum == "dbba710596087da521c07564160dfccb"
    assert moveit_msgs.msg.PlanningScene._md5sum == "acfc50bcfd6c7b978066bfa7c786002c"
