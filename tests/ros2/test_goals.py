"""Goals of FollowJointTrajectory, without a server: results find their goal in every order."""

from __future__ import annotations

import importlib
import threading
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest
from control_msgs.action import FollowJointTrajectory
from rclpy.action import GoalResponse

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalResult

MODULE: Any = importlib.import_module("heptarm_ros2.trajectory")
PATIENCE = 10.0


def ended(number: int) -> GoalResult:
    return GoalResult(number, GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL, "stopped")


class Driver:
    """Accepts a goal once an earlier one has its result; `early`: the new one ends before it is accepted."""

    now = 0.0

    def __init__(self) -> None:
        self.action: Any = None
        self.early = False
        self.results: dict[int, GoalResult] = {}

    def accept(self, goal: object) -> int:
        last = threading.Thread(target=self.action.on_result, args=(ended(1),), daemon=True)
        last.start()
        last.join(PATIENCE)
        assert not last.is_alive(), "the result of another goal waits"
        if self.early:
            self.results[2] = ended(2)
            self.action.on_result(ended(2))
        return 2

    def result(self, number: int, *, timeout: float) -> GoalResult | None:
        return self.results.get(number)


@pytest.mark.parametrize("early", [False, True])
def test_a_result_waits_for_no_goal_that_is_being_accepted(
    monkeypatch: pytest.MonkeyPatch, early: bool
) -> None:
    monkeypatch.setattr(MODULE.messages, "action_goal", lambda *_, **__: None)
    driver = Driver()
    action: Any = MODULE.TrajectoryAction.__new__(MODULE.TrajectoryAction)
    driver.action, driver.early = action, early
    action._driver, action._ros = driver, None
    action._node = SimpleNamespace(executor=None, get_logger=MagicMock())
    action._lock, action._numbers, action._results, action._handles = threading.Lock(), {}, {}, {}
    assert action._on_goal(FollowJointTrajectory.Goal()) == GoalResponse.ACCEPT
    assert action._results[2].done() == early
    if not early:
        action.on_result(ended(2))
    assert action._results[2].result().text == "stopped"
