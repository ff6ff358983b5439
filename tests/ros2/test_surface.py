"""Services, actions and topics beside trajectories, by the cases of `tests.conformance.surface`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rclpy.action import ActionClient

from tests.conformance import surface
from tests.conformance.stage import Stage
from tests.ros2.peer import PATIENT, NodeProcess, Ros, to_duration, until

NAME = "/surface/heptarm"


class Client:
    """A probe of ROS 2."""

    def __init__(self, ros: Ros) -> None:
        self._ros = ros
        self._actions: dict[str, ActionClient] = {}
        self._publishers: dict[str, Any] = {}

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        one = found(kind, "srv")
        return self._ros.call(one, f"{NAME}/{name}", one.Request(**request))

    def start(self, name: str, kind: str, /, **goal: Any) -> Callable[[], Any]:
        one = found(kind, "action")
        if name not in self._actions:
            self._actions[name] = ActionClient(self._ros.node, one, f"{NAME}/{name}")
        client = self._actions[name]
        until(client.server_is_ready, f"there is no {name}")
        handle = self._ros.wait(client.send_goal_async(one.Goal(**goal)), "no answer")
        assert handle.accepted
        return lambda: self._ros.wait(handle.get_result_async(), f"{name} does not end").result

    def act(self, name: str, kind: str, /, **goal: Any) -> Any:
        return self.start(name, kind, **goal)()

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        topic = f"/surface{name}" if name == "/joint_states" else full(name)
        return self._ros.collect(found(kind, "msg"), topic, latched=latched)

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        made = found(kind, "msg")(**message)
        if name not in self._publishers:
            self._publishers[name] = self._ros.node.create_publisher(type(made), full(name), 1)
        one = self._publishers[name]
        until(one.get_subscription_count, f"nobody listens to {name}")
        return lambda: one.publish(made)

    def make(self, kind: str, /, **fields: Any) -> Any:
        return found(kind, "msg")(**fields)

    def point(self, positions: list[float], seconds: float) -> Any:
        return self.make(
            "trajectory_msgs/JointTrajectoryPoint", positions=positions, time_from_start=to_duration(seconds)
        )

    def query(self) -> Any:
        answer = self.call("query_state", "control_msgs/QueryTrajectoryState")
        return answer if answer.success else None


def full(name: str) -> str:
    return name if name.startswith("/") else f"{NAME}/{name}"


def found(kind: str, part: str) -> Any:
    package, _, name = kind.rpartition("/")
    return getattr(importlib.import_module(f"{package or 'heptarm_msgs'}.{part}"), name)


@pytest.fixture(scope="module")
def arena(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    running = surface.stage(tmp_path_factory.mktemp("project"))
    yield running
    running.close()


@pytest.fixture(scope="module")
def probe(ros: Ros, arena: Stage) -> Iterator[Client]:
    node = NodeProcess(arena.target, space="/surface", **(PATIENT | surface.PARAMETERS))
    client = Client(ros)
    surface.ready(client)
    yield client
    node.finish()


@pytest.mark.parametrize("case", surface.CASES)
def test_surface(probe: Client, arena: Stage, case: str) -> None:
    surface.CASES[case](probe, arena)
