"""Services, actions and topics except trajectories, by the cases of `tests.conformance.surface` and `hands`."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rclpy.action import ActionClient

from tests.conformance import hands, paths, surface
from tests.conformance.stage import ROOT, Stage
from tests.ros2.peer import PATIENT, NodeProcess, Ros, to_duration
from tests.ros2.test_examples import run

NAME = "/surface/heptarm"


class Sent:
    """A goal of ROS 2."""

    def __init__(self, ros: Ros, client: ActionClient, goal: Any) -> None:
        self.reported: list[Any] = []
        self._ros = ros
        self._handle = ros.send_goal(client, goal, self.reported.append)
        assert self._handle.accepted
        self._result = self._handle.get_result_async()

    def cancel(self) -> None:
        assert self._ros.wait(self._handle.cancel_goal_async(), "cancelling is not answered").goals_canceling

    def end(self) -> Any:
        return self._ros.wait(self._result, "it does not end").result


class Client:
    """A probe of ROS 2; names are relative to that of a node, or to a namespace."""

    def __init__(self, ros: Ros, name: str = NAME) -> None:
        self._ros, self._name = ros, name
        self._publishers: dict[str, Any] = {}

    def _full(self, name: str) -> str:
        return name if name.startswith("/") else f"{self._name}/{name}"

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        one = found(kind, "srv")
        return self._ros.call(one, self._full(name), one.Request(**request))

    def send(self, name: str, kind: str, /, **goal: Any) -> Sent:
        one = found(kind, "action")
        return Sent(self._ros, self._ros.act(one, self._full(name)), one.Goal(**goal))

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        topic = f"/surface{name}" if name == "/joint_states" else self._full(name)
        return self._ros.collect(found(kind, "msg"), topic, latched=latched)

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        made = found(kind, "msg")(**message)
        if name not in self._publishers:
            self._publishers[name] = self._ros.publisher(
                type(made), self._full(name), latched=name == "/tf_static"
            )
        return lambda: self._publishers[name].publish(made)

    def make(self, kind: str, /, **fields: Any) -> Any:
        return found(kind, "msg")(**fields)

    def point(self, positions: list[float], seconds: float) -> Any:
        return self.make(
            "trajectory_msgs/JointTrajectoryPoint", positions=positions, time_from_start=to_duration(seconds)
        )

    def seconds(self, duration: Any) -> float:
        return float(duration.sec + duration.nanosec * 1e-9)

    def query(self) -> Any:
        answer = self.call("query_state", "control_msgs/QueryTrajectoryState")
        return answer if answer.success else None


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
    try:
        surface.ready(client)
    except BaseException:
        node.end()
        print(node.said)
        raise
    yield client
    node.finish()


CASES = surface.CASES | hands.CASES | paths.CASES
#: Every run has it with the node of ROS 1, and test_moveit does nearly the same.
IN_LONG_RUN = {"moveits_interface_plans_and_drives"}
assert CASES.keys() >= IN_LONG_RUN


@pytest.mark.parametrize(
    "case", [pytest.param(one, marks=[pytest.mark.long] if one in IN_LONG_RUN else []) for one in CASES]
)
def test_surface(probe: Client, arena: Stage, case: str) -> None:
    CASES[case](probe, arena)


def test_the_example_finds_the_table(probe: Client) -> None:
    script = str(ROOT / "examples" / "ros2" / "touch.py")
    found = run([sys.executable, script, "--ros-args", "-r", "__ns:=/surface"]).split()
    assert abs(float(found[3]) - surface.TABLE) < 3e-3, found
