"""Services, actions and topics except trajectories, by the cases of `tests.conformance.surface` and `hands`."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from typing import Any

import actionlib
import pytest
import rospy

from tests.conformance import hands, paths, surface
from tests.conformance.stage import ROOT, Stage
from tests.ros1.peer import NodeProcess, call, collect, publisher, until
from tests.ros1.test_examples import run

NAME = "/surface/heptarm"


class Sent:
    """A goal of ROS 1."""

    def __init__(self, client: actionlib.ActionClient, goal: Any) -> None:
        self.reported: list[Any] = []
        self._handle = client.send_goal(goal, feedback_cb=lambda _, feedback: self.reported.append(feedback))

    def cancel(self) -> None:
        self._handle.cancel()

    def end(self) -> Any:
        done = actionlib.CommState.DONE
        until(lambda: self._handle.get_comm_state() == done, "it does not end")
        return self._handle.get_result()


class Client:
    """A probe of ROS 1; names are relative to that of a node, or to a namespace."""

    def __init__(self, name: str = NAME) -> None:
        self._name = name
        self._publishers: dict[str, rospy.Publisher] = {}

    def _full(self, name: str) -> str:
        return name if name.startswith("/") else f"{self._name}/{name}"

    def call(self, name: str, kind: str, /, **request: Any) -> Any:
        return call(self._full(name), found(kind, "srv"), **request)

    def send(self, name: str, kind: str, /, **goal: Any) -> Sent:
        client = actionlib.ActionClient(self._full(name), found(f"{kind}Action", "msg"))
        assert client.wait_for_action_server_to_start(rospy.Duration(60))
        return Sent(client, found(f"{kind}Goal", "msg")(**goal))

    def listen(self, name: str, kind: str, /, *, latched: bool = False) -> list[Any]:
        return collect(f"/surface{name}" if name == "/joint_states" else self._full(name), found(kind, "msg"))

    def tell(self, name: str, kind: str, /, **message: Any) -> Callable[[], None]:
        made = found(kind, "msg")(**message)
        if name not in self._publishers:
            self._publishers[name] = publisher(self._full(name), type(made))
        return lambda: self._publishers[name].publish(made)

    def make(self, kind: str, /, **fields: Any) -> Any:
        return found(kind, "msg")(**fields)

    def point(self, positions: list[float], seconds: float) -> Any:
        duration = rospy.Duration.from_sec(seconds)
        return self.make(
            "trajectory_msgs/JointTrajectoryPoint", positions=positions, time_from_start=duration
        )

    def seconds(self, duration: Any) -> float:
        return float(duration.to_sec())

    def query(self) -> Any:
        try:
            return self.call("query_state", "control_msgs/QueryTrajectoryState")
        except rospy.ServiceException:  # the type has no field for that
            return None


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
    try:
        surface.ready(client)
    except BaseException:
        node.end()
        print(node.said)
        raise
    yield client
    assert node.end() == 0, node.said


CASES = surface.CASES | hands.CASES | paths.CASES
#: What the node of ROS 2 shows in every run with the same part of both; here one topic, service and action stay.
IN_LONG_RUN = {
    "a_guard_ends_commands_and_servo_topics",
    "a_servo_topic_follows_lines",
    "a_twist_moves_the_flange_and_silence_ends_it",
    "somebody_taps_the_arm",
    "the_arm_is_guided_by_hand",
    "the_state_of_the_controller_agrees_with_itself",
    "triggers_write_outputs_and_notify",
    "a_collision_guard_stops_motions_and_makes_compliant",
    "a_path_is_found_around_a_wall_and_moved_along",
    "a_trajectory_is_taught_and_replayed",
    "an_fri_session_is_opened_commanded_and_closed",
    "forward_controllers_are_followed",
    "modes_with_all_their_parameters",
    "signals_are_listed_written_and_published",
    "splines_and_programs",
    "the_arm_touches_once_and_twice",
}
assert CASES.keys() >= IN_LONG_RUN


@pytest.mark.parametrize(
    "case", [pytest.param(one, marks=[pytest.mark.long] if one in IN_LONG_RUN else []) for one in CASES]
)
def test_surface(probe: Client, arena: Stage, case: str) -> None:
    CASES[case](probe, arena)


@pytest.mark.long  # every run has it with the node of ROS 2
def test_the_example_finds_the_table(probe: Client) -> None:
    found = run([sys.executable, str(ROOT / "examples" / "ros1" / "touch.py"), "__ns:=/surface"]).split()
    assert abs(float(found[3]) - surface.TABLE) < 3e-3, found
