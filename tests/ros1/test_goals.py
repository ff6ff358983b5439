"""Goals of FollowJointTrajectory, without a node: every one is answered."""

from __future__ import annotations

import importlib
import threading
from typing import Any
from unittest.mock import MagicMock

from control_msgs.msg import FollowJointTrajectoryGoal

MODULE: Any = importlib.import_module("heptarm_ros1.trajectory")


def test_an_error_that_nobody_expects_rejects_the_goal() -> None:
    action: Any = MODULE.TrajectoryAction.__new__(MODULE.TrajectoryAction)
    action._lock, action._handles = threading.Lock(), {}
    action._driver = MagicMock(now=0.0)
    action._driver.accept.side_effect = ValueError("cannot convert float NaN to integer")
    handle = MagicMock()
    handle.get_goal.return_value = FollowJointTrajectoryGoal()
    action._on_goal(handle)
    handle.set_accepted.assert_not_called()
    result, text = handle.set_rejected.call_args.args
    assert "internal error of the node: ValueError" in text and result.error_string == text
    assert result.error_code == result.INVALID_GOAL
