"""Services: their effects on the arm, and their texts when they fail."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose, Quaternion
from heptarm_msgs.srv import (
    AttachTool,
    AttachWorkpiece,
    GetNames,
    SetCartesianImpedance,
    SetJointImpedance,
    SetNumber,
    SetSineImpedance,
    SetText,
)
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from heptarm.ros.interface.services import SERVICES
from tests.conformance.case import rests, step, succeeds
from tests.ros1.peer import Client, call, publisher, until


def ask(name: str, kind: Any = Trigger, /, **request: object) -> str:
    answer = call(f"/heptarm/{name}", kind, **request)
    assert answer.success, answer.message
    return str(answer.message)


@pytest.fixture(autouse=True)
def as_it_was(client: Client) -> Iterator[None]:
    yield
    until(lambda: call("/heptarm/mode/position", Trigger).success, "a motion is still under way")


def test_every_service_answers_success_and_message() -> None:
    for row in SERVICES:
        package, _, name = row.type.partition("/")
        if package == "control_msgs":  # of ROS 1's own, and without these
            continue
        response = getattr(importlib.import_module(f"{package}.srv"), name)._response_class
        assert {"success", "message"} <= set(response.__slots__), row.name


def test_a_goal_runs_under_joint_impedance_and_a_wrong_stiffness_is_refused(client: Client) -> None:
    assert "JointImpedance" in ask("mode/joint_impedance", SetJointImpedance, stiffness=[1500.0], damping=[])
    succeeds(client, step(client))
    answer = call("/heptarm/mode/joint_impedance", SetJointImpedance, stiffness=[9000.0] * 7, damping=[0.7])
    assert not answer.success and "9000" in answer.message and "5000" in answer.message


def test_cartesian_and_sine_impedance_hold_the_arm(client: Client) -> None:
    here = rests(client)
    empty: dict[str, list[float]] = {
        name: [] for name in ("nullspace", "additional_force", "max_force", "max_velocity", "max_deviation")
    }
    stiffness = [4000.0] * 3 + [300.0] * 3
    ask(
        "mode/cartesian_impedance",
        SetCartesianImpedance,
        stiffness=stiffness,
        damping=[0.7],
        max_force_stops=False,
        frame="",
        **empty,
    )
    joint = publisher("/heptarm/command/joint", JointState)
    joint.publish(JointState(name=["A7"], position=[here[6] + 0.2]))
    until(lambda: abs(client.place().q[6] - here[6] - 0.2) < 0.05, "the arm does not arrive")
    rests(client)
    ask(
        "mode/sine_impedance",
        SetSineImpedance,
        stiffness=stiffness,
        damping=[],
        amplitude=[0, 0, 20.0, 0, 0, 0],
        frequency=[0, 0, 2.0, 0, 0, 0],
        phase=[],
        bias=[],
        force_limit=[],
        position_limit=[],
        rise_time=0.0,
        hold_time=[1.0],
        fall_time=0.0,
    )
    joint.publish(JointState(name=["A7"], position=[here[6]]))
    until(lambda: abs(client.place().q[6] - here[6]) < 0.05, "the arm does not arrive")


def test_a_mode_waits_for_rest_or_reports_that_something_runs(client: Client) -> None:
    sent = client.send(step(client, time=20.0, size=6.0))
    until(lambda: client.feedback(sent), "the goal does not begin")
    answer = call("/heptarm/mode/joint_impedance", SetJointImpedance, stiffness=[1500.0], damping=[])
    assert not answer.success and "stop it first" in answer.message
    client.cancel(sent)
    client.result(sent)
    rests(client)


def test_a_pause_holds_a_goal_and_a_resume_lets_it_go_on(client: Client) -> None:
    sent = client.send(step(client, time=3.0))
    until(lambda: client.feedback(sent), "the goal does not begin")
    ask("pause")
    until(lambda: client.status[-1].paused, "the status does not tell")
    rests(client)
    ask("resume")
    assert client.result(sent).code == 0


def test_tools_come_and_go(client: Client) -> None:
    rests(client)
    tip = Pose(Point(0.0, 0.0, 0.12), Quaternion(0.0, 0.0, 0.0, 1.0))
    gripper = {"name": "gripper", "mass": 1.2, "com": Point(0.0, 0.0, 0.06), "frame": ""}
    ask("attach_tool", AttachTool, known=False, tcp=tip, **gripper)
    assert "gripper" in call("/heptarm/tools", GetNames).names
    ask("attach_workpiece", AttachWorkpiece, name="cube", mass=0.3, com=Point())
    ask("detach_workpiece")
    safe = ask("attach_workpiece", AttachWorkpiece, name="cube", mass=0.3, com=Point(), safety=True)
    assert "as the safety workpiece" in safe
    ask("detach_workpiece")
    answer = call("/heptarm/attach_workpiece", AttachWorkpiece, name="ball", known=True, com=Point())
    assert not answer.success and "no workpiece template ball" in answer.message
    ask("detach_tool")
    answer = call("/heptarm/attach_tool", AttachTool, known=True, tcp=Pose(), **{**gripper, "name": "broom"})
    assert not answer.success and "broom" in answer.message
    assert not call("/heptarm/detach_workpiece", Trigger).success


def test_speed_control_and_lists(client: Client) -> None:
    ask("set_speed", SetNumber, value=0.3)
    answer = call("/heptarm/set_speed", SetNumber, value=3.0)
    assert not answer.success and "3" in answer.message
    ask("set_speed", SetNumber, value=1.0)
    ask("release_control")
    assert "in control" in ask("take_control")
    ask("stop_as", SetText, value="fast")
    assert "servo" in " ".join(call("/heptarm/capabilities", GetNames).names)
    call("/heptarm/frames", GetNames)
    assert np.isfinite(client.place().q).all()
