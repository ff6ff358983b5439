"""Services: their effects on the arm, and their texts when they fail."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, Quaternion
from heptarm_msgs.srv import AttachTool, GetNames, SetJointImpedance, SetNumber, SetText
from std_srvs.srv import Trigger

from heptarm.ros.interface.services import SERVICES
from tests.conformance.case import rests, step, succeeds
from tests.ros2.peer import Client, Ros, until


@pytest.fixture
def ask(ros: Ros, client: Client) -> Iterator[Callable[..., Any]]:
    """Calls a service, which must succeed."""

    def call(name: str, kind: Any = Trigger, /, *, refused: bool = False, **request: Any) -> Any:
        answer = ros.call(kind, f"{client.name}/{name}", kind.Request(**request))
        assert answer.success is not refused, answer.message
        return answer

    yield call
    mode = f"{client.name}/mode/position"
    until(lambda: ros.call(Trigger, mode, Trigger.Request()).success, "a motion is still under way")


def test_every_service_answers_success_and_message() -> None:
    for row in SERVICES:
        package, _, name = row.type.partition("/")
        response = getattr(importlib.import_module(f"{package}.srv"), name).Response
        assert {"success", "message"} <= set(response.get_fields_and_field_types()), row.name


def test_a_goal_runs_under_joint_impedance_and_a_wrong_stiffness_is_refused(
    client: Client, ask: Callable[..., Any]
) -> None:
    assert "JointImpedance" in ask("mode/joint_impedance", SetJointImpedance, stiffness=[1500.0]).message
    succeeds(client, step(client))
    answer = ask("mode/joint_impedance", SetJointImpedance, refused=True, stiffness=[9000.0] * 7)
    assert "9000" in answer.message and "5000" in answer.message


def test_a_pause_holds_a_goal_and_a_resume_lets_it_go_on(client: Client, ask: Callable[..., Any]) -> None:
    for name in ("mode/position", "pause", "resume"):
        client.ros.find(Trigger, f"{client.name}/{name}")
    sent = client.send(step(client, time=20.0, size=6.0))
    until(lambda: client.feedback(sent), "the goal does not begin")
    assert "stop it first" in ask("mode/position", refused=True).message  # after two seconds
    assert client.cancel(sent)
    client.result(sent)
    rests(client)
    sent = client.send(step(client, time=3.0))
    until(lambda: client.feedback(sent), "the goal does not begin")
    ask("pause")
    rests(client)
    ask("resume")
    assert client.result(sent).code == 0


def test_tools_control_and_lists(client: Client, ask: Callable[..., Any]) -> None:
    rests(client)
    tip = Pose(position=Point(z=0.12), orientation=Quaternion(w=1.0))
    ask("attach_tool", AttachTool, name="gripper", mass=1.2, com=Point(z=0.06), tcp=tip)
    assert "gripper" in ask("tools", GetNames).names
    ask("detach_tool")
    assert "broom" in ask("attach_tool", AttachTool, refused=True, name="broom", known=True).message
    ask("set_speed", SetNumber, value=0.3)
    ask("set_speed", SetNumber, value=1.0)
    ask("release_control")
    assert "in control" in ask("take_control").message
    ask("stop_as", SetText, value="fast")
    assert "servo" in ask("capabilities", GetNames).names
