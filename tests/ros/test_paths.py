"""The action `plan_and_execute` on a virtual cabinet, without ROS: what comes into the way while the arm moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.planning import scene
from heptarm.ros.interface.planning.paths import plan_and_execute
from heptarm.ros.node.driver import Driver
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.values.motion.ptp import ptp
from tests.conftest import RunningCabinet
from tests.ros.test_planning import cloud

HERE, THERE = np.radians([-40, 50, 0, -80, 0, 50, 0]), np.radians([40, 50, 0, -80, 0, 50, 0])


class Client:
    """Lets the arm creep until it has begun to move, then calls a function, and lets it go on at full speed."""

    def __init__(self, context: NodeContext, *, at_first: Callable[[Client], None]) -> None:
        self._arm, self._at_first = context.arm, at_first
        self.states, self._is_first, self._is_cancelled = list[str](), True, False
        self._arm.set_override(0.05)

    def publish_feedback(self, fields: Mapping[str, Any]) -> None:
        """Take feedback."""
        self.states.append(fields["state"])
        if self._is_first and fields.get("progress", 0.0) > 0.001:
            self._is_first = False
            self._at_first(self)
            self._arm.set_override(1.0)

    def cancel(self) -> None:
        """Request to cancel the goal."""
        self._is_cancelled = True

    def is_cancel_requested(self) -> bool:
        """Whether the goal is to be cancelled."""
        return self._is_cancelled


@pytest.fixture
def context(cabinet: RunningCabinet) -> Iterator[NodeContext]:
    driver = Driver(
        NodeConfiguration.of({"target": cabinet.target, "speed": 0.2, "watchdog": 5.0}), MagicMock()
    )
    driver.activate()
    driver.start(ptp(HERE), speed=1.0).wait()
    yield NodeContext(driver, MagicMock())
    driver.close()


def goal(**fields: Any) -> Any:
    """A goal to the other side."""
    there = SimpleNamespace(position=THERE.tolist(), joint_names=[], box=[], cone=0.0, turn=0.0)
    given: dict[str, Any] = {"goals": [there], "keep": [], "speed": 0.0, "tcp_speed": 0.0, "timeout": 60.0}
    given |= {"states": 0, "improve": 0, "seed": 0, "until": "", "then": ""}
    return SimpleNamespace(**given | fields)


def test_the_arm_goes_around_points_that_appear_on_its_path(context: NodeContext) -> None:
    middle = forward(context.arm.robot, np.radians([15, 50, 0, -80, 0, 50, 0]))[:3, 3]
    client = Client(context, at_first=lambda _: scene.points(context, cloud([middle])))
    result = plan_and_execute(context, goal())(client)
    assert result.outcome is GoalOutcome.SUCCEEDED and "around what came into the way" in result.text
    assert {"planning", "moving"} == set(client.states) and result.fields["residual"] < 0.01
    assert abs(context.arm.state.q - THERE).max() < 2e-3


def test_where_there_is_no_way_any_more_or_the_goal_is_cancelled_the_arm_rests(context: NodeContext) -> None:
    there = forward(context.arm.robot, THERE)[:3, 3]
    client = Client(context, at_first=lambda _: scene.points(context, cloud([there])))
    result = plan_and_execute(context, goal())(client)
    assert result.outcome is GoalOutcome.ABORTED and result.fields["reason"] == "goal", result
    scene.points(context, cloud(np.zeros((0, 3))))
    client = Client(context, at_first=Client.cancel)
    result = plan_and_execute(context, goal())(client)
    assert result.outcome is GoalOutcome.CANCELED, result
    assert abs(context.arm.wait_for_rest(timeout=60.0).q - THERE).max() > 0.1
