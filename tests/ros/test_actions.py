"""Properties of all actions: the limit of active goals, and that each goal ends."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import pytest

from heptarm.errors import CommandRejected, NotReady
from heptarm.ros.interface.action import MAX_GOALS, ActionDispatcher, ActionResult, GoalWork, RosAction
from heptarm.ros.interface.actions import ACTIONS, ask
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.gripper import gripper_command
from heptarm.ros.trajectory.goal import GoalOutcome

CLIENT: Any = SimpleNamespace(publish_feedback=lambda fields: None, is_cancel_requested=lambda: False)


def dispatcher() -> ActionDispatcher:
    driver: Any = SimpleNamespace(arm=None)
    ros: Any = SimpleNamespace()
    return ActionDispatcher(NodeContext(driver, ros))


def action(work: Any) -> RosAction:
    def begin(context: NodeContext, goal: object) -> GoalWork:
        if isinstance(work, CommandRejected):
            raise work
        return lambda client: work()

    return RosAction("~/anything", "heptarm_msgs/Anything", begin)


def test_active_goals_are_limited_to_the_threads() -> None:
    actions = dispatcher()
    row = action(lambda: ActionResult(GoalOutcome.SUCCEEDED, "done"))
    for _ in range(2 * MAX_GOALS):
        with pytest.raises(CommandRejected, match="invalid"):
            actions.begin(action(CommandRejected("invalid")), None)
    works = [actions.begin(row, None) for _ in range(MAX_GOALS)]
    with pytest.raises(NotReady, match=f"{MAX_GOALS} goals are active"):
        actions.begin(row, None)
    assert works[0](CLIENT).text == "done"
    actions.begin(row, None)


def test_an_internal_error_ends_the_goal(caplog: pytest.LogCaptureFixture) -> None:
    end = dispatcher().begin(action(lambda: 1 / 0), None)(CLIENT)
    assert end.outcome is GoalOutcome.ABORTED and "ZeroDivisionError" in end.text
    assert "ZeroDivisionError" in caplog.text
    result = end.fill(SimpleNamespace(success=True, message=""))
    assert not result.success and "internal error" in result.message


def test_an_internal_error_at_the_beginning_refuses_the_goal(caplog: pytest.LogCaptureFixture) -> None:
    def begin(context: NodeContext, goal: object) -> GoalWork:
        raise ValueError("cannot convert float NaN to integer")

    actions = dispatcher()
    for _ in range(2 * MAX_GOALS):
        with pytest.raises(NotReady, match="internal error of the node: ValueError"):
            actions.begin(RosAction("~/anything", "heptarm_msgs/Anything", begin), None)
    assert "ValueError" in caplog.text


def test_the_reason_of_a_failure_is_logged_where_the_result_has_no_text(
    caplog: pytest.LogCaptureFixture,
) -> None:
    row = action(lambda: ActionResult(GoalOutcome.ABORTED, "the gripper does not reach its end"))
    with caplog.at_level("WARNING", "heptarm.ros"):
        dispatcher().begin(row, None)(CLIENT)
    assert [one.getMessage() for one in caplog.records] == ["~/anything: the gripper does not reach its end"]


def test_names_of_actions_are_unique() -> None:
    assert len({row.name for row in ACTIONS}) == len(ACTIONS) == 13


def test_a_goal_of_the_gripper_reports_until_its_switches_confirm() -> None:
    reported = threading.Event()

    class Fingers:
        is_open = is_closed = holds_something = False

        def open(self) -> None:
            assert reported.wait(20.0)  # longer than a period of feedback
            self.is_open = True

    values = {"gripper.width": 0.08} | {
        f"gripper.{name}": name for name in ("open", "close", "is_open", "is_closed")
    }
    configuration = SimpleNamespace(configuration=SimpleNamespace(values=values))
    context: Any = SimpleNamespace(driver=configuration, gripper=Fingers(), check_active=lambda: None)
    goal = SimpleNamespace(command=SimpleNamespace(position=0.08))
    client: Any = SimpleNamespace(
        publish_feedback=lambda fields: reported.set(), is_cancel_requested=lambda: False
    )
    end = gripper_command(context, goal)(client)
    assert (end.outcome, end.text) == (GoalOutcome.SUCCEEDED, "open")
    assert end.fields["reached_goal"] and end.fields["position"] == 0.08


def test_the_operator_answers_a_goal_unless_it_is_cancelled() -> None:
    asked: list[tuple[str, ...]] = []
    answered = threading.Event()

    def pad_ask(text: str, *buttons: str, kind: str, timeout: float) -> str:
        asked.append((text, *buttons, kind))
        if text == "broken":
            raise CommandRejected("this cabinet has no dialogs")
        assert timeout == 600.0 and (text != "slow" or answered.wait(20.0))
        return buttons[-1]

    def goal(text: str) -> Any:
        return SimpleNamespace(text=text, buttons=["Yes", "No"], kind="", timeout=0.0)

    context: Any = SimpleNamespace(arm=SimpleNamespace(pad=SimpleNamespace(ask=pad_ask)))
    end = ask(context, goal("ready?"))(CLIENT)
    assert (end.outcome, end.text, end.fields) == (GoalOutcome.SUCCEEDED, "No", {"button": 1})
    end = ask(context, goal("broken"))(CLIENT)
    assert (end.outcome, end.fields) == (GoalOutcome.ABORTED, {"button": -1}) and "no dialogs" in end.text
    leaving: Any = SimpleNamespace(is_cancel_requested=lambda: True)
    end = ask(context, goal("slow"))(leaving)
    assert end.outcome is GoalOutcome.CANCELED and "stays on the smartPAD" in end.text
    answered.set()
    assert asked[0] == ("ready?", "Yes", "No", "question")
