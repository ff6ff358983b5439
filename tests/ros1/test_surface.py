"""Services, actions and topics beside trajectories, by the cases of `tests.conformance.surface`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from typing import Any

import actionlib
import pytest
import rospy

from tests.conformance import surface
from tests.conformance.stage import Stage
from tests.ros1.peer import NodeProcess, call, collect, publisher

NAME = "/surface/heptarm"


class Client:
    """A probe of ROS 1."""

    def __init__(self) -> None:
        self._publishers: dict[str, rospy.Publisher] = {}

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        return call(f"{NAME}/{name}", found(kind, "srv"), **request)

    def start(self, name: str, kind: str, /, **goal: Any) -> Callable[[], Any]:
        client = actionlib.SimpleActionClient(f"{NAME}/{name}", found(f"{kind}Action", "msg"))
        assert client.wait_for_server(rospy.Duration(60))
        client.send_goal(found(f"{kind}Goal", "msg")(**goal))

        def end() -> Any:
            assert client.wait_for_result(rospy.Duration(60))
            return client.get_result()

        return end

    def act(self, name: str, kind: str, /, **goal: Any) -> Any:
        return self.start(name, kind, **goal)()

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        return collect(f"/surface{name}" if name == "/joint_states" else full(name), found(kind, "msg"))

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        made = found(kind, "msg")(**message)
        if name not in self._publishers:
            self._publishers[name] = publisher(full(name), type(made))
        return lambda: self._publishers[name].publish(made)

    def make(self, kind: str, /, **fields: Any) -> Any:
        return found(kind, "msg")(**fields)

    def point(self, positions: list[float], seconds: float) -> Any:
        duration = rospy.Duration.from_sec(seconds)
        return self.make(
            "trajectory_msgs/JointTrajectoryPoint", positions=positions, time_from_start=duration
        )

    def query(self) -> Any:
        try:
            return self.call("query_state", "control_msgs/QueryTrajectoryState")
        except rospy.ServiceException:  # the type has no field for that
            return None


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
def probe(ros: None, arena: Stage) -> Iterator[Client]:
    node = NodeProcess(arena.target, ns="/surface", **surface.PARAMETERS)
    client = Client()
    surface.ready(client)
    yield client
    assert node.end() == 0, node.said


@pytest.mark.parametrize("case", surface.CASES)
def test_surface(probe: Client, arena: Stage, case: str) -> None:
    surface.CASES[case](probe, arena)
