"""A substitute for the `ros2` command, which is in no wheel, so that documented commands run as written."""

from __future__ import annotations

import importlib
import shlex
import time
from collections.abc import Callable
from typing import Any

import yaml
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.qos import DurabilityPolicy

from tests.retry import retry
from tests.ros2.peer import Ros, until


def find(name: str) -> type:
    """The type of "package/kind/Name"."""
    package, kind, last = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind}"), last)  # type: ignore[no-any-return]


def fill(message: Any, values: dict[str, Any]) -> Any:
    """A message with the values of a YAML mapping."""
    for name, value in values.items():
        now = getattr(message, name)
        if isinstance(value, dict):
            fill(now, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            kind = message.get_fields_and_field_types()[name].removeprefix("sequence<").split(">")[0]
            package, last = kind.split("/")
            setattr(message, name, [fill(find(f"{package}/msg/{last}")(), one) for one in value])
        else:
            setattr(
                message,
                name,
                [float(v) if isinstance(v, (int, float)) else v for v in value]
                if isinstance(value, list)
                else value,
            )
    return message


def topic(ros: Ros, verb: str, name: str, *rest: str) -> object:
    if verb == "pub":
        message = fill(find(rest[0])(), yaml.safe_load(rest[1]) if len(rest) > 1 else {})
        ros.publisher(find(rest[0]), name).publish(message)
        time.sleep(1.0)  # no sooner does the tool end and the next command begin
        return "published"
    known: list[str] = until(
        lambda: dict(ros.node.get_topic_names_and_types()).get(name), f"there is no {name}"
    )
    latched = any(
        one.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL
        for one in ros.node.get_publishers_info_by_topic(name)
    )
    found = ros.collect(find(known[0]), name, latched=latched)
    until(lambda: found, f"nothing comes on {name}")
    return found[0]


def service(ros: Ros, verb: str, name: str, kind: str, values: str = "{}") -> object:
    assert verb == "call"
    request = fill(find(kind).Request(), yaml.safe_load(values))  # type: ignore[attr-defined]

    def late(answer: Any) -> str:
        refused = name.endswith("/fri/open") and not isinstance(answer, Exception) and not answer.success
        return "FRI answers came late" if refused else ""

    answer = retry(lambda: ros.call(find(kind), name, request), late)
    if not answer.success:
        raise AssertionError(answer.message)
    return answer


def action(ros: Ros, verb: str, name: str, kind: str, values: str) -> object:
    assert verb == "send_goal"
    client = ros.act(find(kind), name)
    goal = fill(find(kind).Goal(), yaml.safe_load(values))  # type: ignore[attr-defined]
    handle = ros.send_goal(client, goal)
    if not handle.accepted:
        raise AssertionError("rejected")
    return ros.wait(handle.get_result_async(), "it does not end").result


def param(ros: Ros, verb: str, node: str, name: str, value: str = "") -> object:
    if verb == "get":
        request = GetParameters.Request(names=[name])
        return ros.call(GetParameters, f"{node}/get_parameters", request).values[0]
    given = yaml.safe_load(value)
    kinds = {
        bool: (ParameterType.PARAMETER_BOOL, "bool_value"),
        float: (ParameterType.PARAMETER_DOUBLE, "double_value"),
        str: (ParameterType.PARAMETER_STRING, "string_value"),
    }
    number, field = kinds[type(given)]
    parameter = Parameter(name=name, value=ParameterValue(type=number, **{field: given}))
    answer = ros.call(SetParameters, f"{node}/set_parameters", SetParameters.Request(parameters=[parameter]))
    if not answer.results[0].successful:
        raise AssertionError(answer.results[0].reason)
    return "Set parameter successful"


def lifecycle(ros: Ros, verb: str, node: str, name: str) -> object:
    assert verb == "set"
    number = getattr(Transition, f"TRANSITION_{name.upper()}")
    request = ChangeState.Request(transition=Transition(id=number))
    if not ros.call(ChangeState, f"{node}/change_state", request).success:
        raise AssertionError("refused")
    return "Transitioning successful"


VERBS: dict[str, Callable[..., object]] = {
    "topic": topic,
    "service": service,
    "action": action,
    "param": param,
    "lifecycle": lifecycle,
}


def run(ros: Ros, text: str) -> list[str]:
    """Run the `ros2` commands of a script, which may span lines inside quotes; other lines are skipped."""
    said, command = [], ""
    for line in text.splitlines():
        if command or line.startswith("ros2 "):
            command += line + "\n"
            if command.count('"') % 2 == 0:
                words = [word for word in shlex.split(command) if word != "--once"]
                said.append(str(VERBS[words[1]](ros, *words[2:])))
                command = ""
    return said
