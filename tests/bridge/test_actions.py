"""What all actions share: how many goals are taken, and that each of them ends."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from heptarm.bridge.action import Action, Ended, Work
from heptarm.bridge.actions import ACTIONS, MOST, Actions
from heptarm.bridge.goal import Outcome
from heptarm.errors import CommandRejected, NotReady

CLIENT: Any = SimpleNamespace(tell=lambda fields: None, has_cancelled=lambda: False)


def actions() -> Actions:
    driver: Any = SimpleNamespace(arm=None)
    ros: Any = SimpleNamespace()
    return Actions(driver, ros)


def doing(what: Any) -> Action:
    def begin(offer: Actions, goal: object) -> Work:
        if isinstance(what, CommandRejected):
            raise what
        return lambda client: what()

    return Action("~/anything", "heptarm_msgs/Anything", begin)


def test_no_more_goals_are_taken_than_there_are_threads() -> None:
    offered = actions()
    row = doing(lambda: Ended(Outcome.SUCCEEDED, "done"))
    for _ in range(2 * MOST):
        with pytest.raises(CommandRejected, match="senseless"):
            offered.begin(doing(CommandRejected("senseless")), None)
    works = [offered.begin(row, None) for _ in range(MOST)]
    with pytest.raises(NotReady, match=f"{MOST} goals are under way"):
        offered.begin(row, None)
    assert works[0](CLIENT).text == "done"
    offered.begin(row, None)


def test_a_fault_of_the_nodes_ends_the_goal(caplog: pytest.LogCaptureFixture) -> None:
    ended = actions().begin(doing(lambda: 1 / 0), None)(CLIENT)
    assert ended.outcome is Outcome.ABORTED and "ZeroDivisionError" in ended.text
    assert "ZeroDivisionError" in caplog.text
    result = ended.fill(SimpleNamespace(success=True, message=""))
    assert not result.success and "the node failed" in result.message


def test_every_action_has_a_name_of_its_own() -> None:
    assert len({row.name for row in ACTIONS}) == len(ACTIONS) == 9
