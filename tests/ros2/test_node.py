"""The node: life cycle, parameters, states, commands, several of them, and a clean end."""

from __future__ import annotations

import importlib.util
import math
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, WrenchStamped
from heptarm_msgs.msg import RobotState, Status
from lifecycle_msgs.msg import Transition
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters, SetParametersAtomically
from rclpy.qos import ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

import heptarm as ha
from heptarm.ros.node import parameters
from tests.conformance.case import (
    TOUCH,
    arrives,
    goal,
    long,
    newest,
    point,
    rests,
    step,
    succeeds,
    under_way,
)
from tests.conformance.stage import Stage
from tests.conformance.streams import streamed
from tests.long import longer
from tests.ros2.peer import PATIENCE, Client, NodeProcess, Ros, fresh, parameter, until

Start = Callable[..., NodeProcess]


def seconds(message: JointState) -> float:
    return float(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9)


# ------------------------------------------------------------------------------------------- life


@pytest.fixture
def sleeper(spare: Stage, ros: Ros, nodes: Start) -> Client:
    """A client of a node that does nothing by itself."""
    nodes(spare.target, name="sleeper", space="/alone", autostart=False)
    return Client(ros, spare, "/alone/sleeper")


def test_the_life_cycle_from_unconfigured_and_back(sleeper: Client, spare: Stage) -> None:
    assert sleeper.life() == "unconfigured"
    assert sleeper.change(Transition.TRANSITION_CONFIGURE)
    assert sleeper.life() == "inactive"
    until(lambda: sleeper.states, "states come from configuring on")
    assert not sleeper.send(step(sleeper)).accepted, "nothing moves before it is active"
    assert sleeper.change(Transition.TRANSITION_ACTIVATE)
    assert sleeper.life() == "active"
    succeeds(sleeper, step(sleeper))
    assert sleeper.change(Transition.TRANSITION_DEACTIVATE)
    assert sleeper.change(Transition.TRANSITION_CLEANUP)
    assert sleeper.life() == "unconfigured"
    with ha.connect(spare.target, watchdog=5.0, timeout=30.0) as arm:
        assert arm.in_control, "the node has let go of the robot"
        sleeper.change(Transition.TRANSITION_CONFIGURE)
        assert sleeper.life() == "unconfigured", "another client controls the robot"
    assert sleeper.change(Transition.TRANSITION_CONFIGURE)
    assert sleeper.life() == "inactive"


def test_it_waits_for_a_cabinet_and_starts_by_itself(ros: Ros, spare: Stage, nodes: Start) -> None:
    spare.kill()
    node = nodes(spare.target, name="early", space="/alone")
    node.waits_for("wait, the next attempt is in 2 s")
    spare.restart()
    client = Client(ros, spare, "/alone/early")
    client.ready()


@pytest.mark.parametrize("number", [pytest.param(signal.SIGINT, marks=pytest.mark.long), signal.SIGTERM])
def test_asked_to_end_in_mid_air_it_leaves_the_arm_at_rest(
    ros: Ros, spare: Stage, nodes: Start, number: int
) -> None:
    node = nodes(spare.target, name="short", space="/alone")
    client = Client(ros, spare, "/alone/short")
    client.ready()
    here = client.place().q
    assert client.send(long(client)).accepted
    under_way(client, here, 0.03)
    assert node.end(number) == 0, node.said
    with ha.connect(spare.target, watchdog=5.0, timeout=30.0) as arm:
        assert arm.in_control
        assert np.abs(newest(arm).q - here).max() > 0.01, "it was under way"
        assert np.abs(newest(arm).dq).max() < 0.05


# ------------------------------------------------------------------------------------- parameters


def test_every_parameter_is_described(client: Client, ros: Ros) -> None:
    names = list(ros.call(ListParameters, "/heptarm/list_parameters", ListParameters.Request()).result.names)
    ours = [*parameters.PARAMETERS, *parameters.joint_parameters([f"A{i}" for i in range(1, 8)])]
    assert {one.name for one in ours} <= set(names)
    request = DescribeParameters.Request(names=[one.name for one in ours])
    reported = ros.call(DescribeParameters, "/heptarm/describe_parameters", request).descriptors
    for one, descriptor in zip(ours, reported):
        assert descriptor.description == one.text
        if isinstance(one.default, float):
            assert descriptor.floating_point_range[0].to_value == one.high
        for choice in one.choices:
            assert choice in descriptor.additional_constraints


def test_an_integer_is_a_number_as_users_write_it(ros: Ros, spare: Stage, nodes: Start) -> None:
    nodes(spare.target, name="whole", space="/alone", autostart=False, state_rate=200, execution="servo")
    whole = Client(ros, spare, "/alone/whole")

    def value(name: str) -> float:
        request = GetParameters.Request(names=[name])
        return float(ros.call(GetParameters, "/alone/whole/get_parameters", request).values[0].double_value)

    assert value("state_rate") == 200.0
    assert whole.set(state_rate=50, start_tolerance=1)
    assert value("state_rate") == 50.0 and value("start_tolerance") == 1.0
    assert not whole.set(state_rate="fast") and not whole.set(state_rate=1000) and value("state_rate") == 50.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"joint_names": ["A1", "A1"]}, "joint_names must have seven different names, got A1, A1"),
        *longer(
            [],
            [
                ({"state_rate": 1000}, "state_rate must be in [1, 500], got 1000"),
                ({"target": "sim://iiwa99"}, "target must be an address or a simulator"),
                ({"state_rate": "fast"}, "state_rate must be a number, got 'fast'"),
                ({"execution": "magic"}, "execution must be one of 'servo', 'spline', 'fri', got 'magic'"),
                ({"joint_names": "A"}, "joint_names must be a list of strings, got 'A'"),
            ],
        ),
    ],
)
def test_a_parameter_that_cannot_be_ends_the_node_with_one_line(
    spare: Stage, values: dict[str, Any], words: str
) -> None:
    node = NodeProcess(spare.target, name="wrong", space="/alone", **values)
    assert node.process.wait(PATIENCE) == 1
    assert words in node.said and "Traceback" not in node.said
    assert len(node.said.strip().splitlines()) == 1, node.said


def test_parameters_that_count_later_are_refused_while_connected(client: Client) -> None:
    assert not client.set(prefix="left_")
    assert not client.set(state_rate=1e9)


def test_parameters_that_are_set_together_apply_together_or_not_at_all(client: Client, ros: Ros) -> None:
    def atomically(**values: float) -> bool:
        given = [parameter(name, value) for name, value in values.items()]
        request = SetParametersAtomically.Request(parameters=given)
        kind, name = SetParametersAtomically, "/heptarm/set_parameters_atomically"
        return bool(ros.call(kind, name, request).result.successful)

    def start_tolerance() -> float:
        request = GetParameters.Request(names=["start_tolerance"])
        return float(ros.call(GetParameters, "/heptarm/get_parameters", request).values[0].double_value)

    assert not atomically(start_tolerance=0.2, max_deceleration_on_cancel=99.0)
    assert start_tolerance() == 0.05
    assert not atomically(start_tolerance=0.2, state_rate=50.0), "one of them cannot change now"
    assert start_tolerance() == 0.05
    try:
        assert atomically(start_tolerance=0.2, max_deceleration_on_cancel=3.0)
        assert start_tolerance() == 0.2
    finally:
        assert atomically(start_tolerance=0.05, max_deceleration_on_cancel=2.0)


def test_quality_of_service_may_be_overridden(ros: Ros, spare: Stage, nodes: Start) -> None:
    override = {"qos_overrides./quality/heptarm/wrench.publisher.reliability": "best_effort"}
    nodes(spare.target, space="/quality", **override)
    client = Client(ros, spare, "/quality/heptarm")
    reliable = ReliabilityPolicy.RELIABLE

    def kinds(topic: str) -> set[ReliabilityPolicy]:
        return {p.qos_profile.reliability for p in ros.node.get_publishers_info_by_topic(topic)}

    for _ in range(2):  # also after the node was configured again
        until(lambda: client.status and client.status[-1].active, "the node is not active")
        until(lambda: kinds("/quality/heptarm/wrench") == {ReliabilityPolicy.BEST_EFFORT}, "no override")
        assert kinds("/quality/joint_states") == {reliable}
        for step_of_life in ("DEACTIVATE", "CLEANUP", "CONFIGURE", "ACTIVATE"):
            assert client.change(getattr(Transition, f"TRANSITION_{step_of_life}"))


def test_a_node_without_a_simulator_reports_how_to_start_one(nodes: Start) -> None:
    if importlib.util.find_spec("mujoco") is not None:
        pytest.skip("this Python has a simulator")
    nodes("sim://iiwa14", space="/alone").waits_for("heptarm sim --port 30001")


def test_streams_and_replaced_trajectories_leave_no_warnings(client: Client, node: NodeProcess) -> None:
    begin = len(node.said)
    here, last = streamed(client, rate=100.0)
    arrives(client, last)
    client.topic(goal(client, point(5.0, here)))
    client.sleep(0.3)
    client.topic(goal(client, point(1.0, here)))
    arrives(client, here)
    assert "WARN" not in node.said[begin:], node.said[begin:]


# ----------------------------------------------------------------------------------------- states


def test_joint_states_are_complete_ordered_and_stamped_by_this_machine(client: Client, ros: Ros) -> None:
    before, start = client.now(), len(client.states)
    until(
        lambda: len(client.states) > start + 50 and seconds(client.states[-1]) >= before, "joint states come"
    )
    found = client.states[start:]
    for message in found:
        assert tuple(message.name) == client.joints
        for values in (message.position, message.velocity, message.effort):
            assert len(values) == 7 and all(math.isfinite(value) for value in values)
    stamps = [seconds(message) for message in found]
    assert all(a < b for a, b in zip(stamps, stamps[1:])), "none twice"  # noqa: RUF007
    assert before <= stamps[-1] <= client.now()


def test_states_are_reliable_as_moveit_needs_them(client: Client, ros: Ros) -> None:
    publishers = ros.node.get_publishers_info_by_topic("/joint_states")
    assert publishers and all(p.qos_profile.reliability is ReliabilityPolicy.RELIABLE for p in publishers)


def test_pose_wrench_torques_and_the_full_state(client: Client, ros: Ros) -> None:
    poses = ros.collect(PoseStamped, "/heptarm/pose")
    wrenches = ros.collect(WrenchStamped, "/heptarm/wrench")
    torques = ros.collect(JointState, "/heptarm/external_torques")
    full = ros.collect(RobotState, "/heptarm/state")
    until(lambda: poses and wrenches and torques and full, "all of them come")
    pose, state = poses[-1], full[-1]
    assert pose.header.frame_id == wrenches[-1].header.frame_id == "link_0"
    turn = pose.pose.orientation
    assert abs(np.linalg.norm([turn.x, turn.y, turn.z, turn.w]) - 1.0) < 1e-6
    assert 0.2 < pose.pose.position.z < 1.3, "metres"
    np.testing.assert_allclose(state.position, client.place().q, atol=5e-3)
    assert len(torques[-1].effort) == 7 and not torques[-1].position


def test_diagnostics_say_that_it_is_ready(client: Client, ros: Ros) -> None:
    found = ros.collect(DiagnosticArray, "/diagnostics")
    mine = until(
        lambda: [one for array in found for one in array.status if one.name == "heptarm: arm"], "they come"
    )
    assert mine[-1].level == b"\x00" and mine[-1].message == "ready"
    assert mine[-1].hardware_id
    assert {value.key for value in mine[-1].values} >= {"connected", "active", "operation mode"}


def test_the_status_is_kept_for_late_subscribers(client: Client, ros: Ros) -> None:
    found = ros.collect(Status, "/heptarm/status", latched=True)
    until(lambda: found, "it comes without a change")
    assert found[-1].connected and found[-1].active and found[-1].operation_mode == Status.MODE_AUT


# --------------------------------------------------------------------------------------- commands


def publish(client: Client, kind: type, name: str, message: object) -> None:
    client.ros.publisher(kind, name).publish(message)


def joint_state(client: Client, q: np.ndarray) -> JointState:
    return JointState(name=list(client.joints), position=[float(value) for value in q])


def test_a_joint_command_moves_and_a_stop_stops(client: Client, ros: Ros) -> None:
    here = client.place().q
    there = here + 0.2 * np.eye(7)[6] * (-1 if here[6] > 0 else 1)
    publish(client, JointState, "/heptarm/command/joint", joint_state(client, there))
    until(lambda: np.abs(client.place().q - there).max() < TOUCH, "it gets there")
    ros.find(Trigger, "/heptarm/stop")  # to find it takes time
    publish(client, JointState, "/heptarm/command/joint", joint_state(client, here - 10.0 * (there - here)))
    until(lambda: np.abs(client.place().q - there).max() > 0.05, "it is under way")
    answer = ros.call(Trigger, "/heptarm/stop", Trigger.Request())
    assert answer.success and answer.message
    assert np.abs(rests(client) - there).max() < 2.0
    stop = ros.publisher(Empty, "/heptarm/stop")
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    stop.publish(Empty())
    assert client.result(sent).code != 0
    rests(client)


def test_pose_and_line_commands(client: Client, ros: Ros) -> None:
    poses = ros.collect(PoseStamped, "/heptarm/pose")
    for name, travel in (("lin", 0.03), ("pose", -0.03)):
        rests(client)
        goal = fresh(ros, poses)
        z = goal.pose.position.z = goal.pose.position.z + travel
        publish(client, PoseStamped, f"/heptarm/command/{name}", goal)
        until(lambda: abs(poses[-1].pose.position.z - z) < 2e-3, f"{name} gets there")  # noqa: B023
    rests(client)


def test_a_pose_in_another_frame_is_refused(client: Client, node: NodeProcess) -> None:
    message = PoseStamped()
    message.header.frame_id = "moon"
    message.pose.orientation.w = 1.0
    publish(client, PoseStamped, "/heptarm/command/pose", message)
    node.waits_for("got 'moon'")


def test_servo_topics_and_their_watchdog(client: Client) -> None:
    here = client.place().q
    sign = -1.0 if here[6] > 0 else 1.0
    publisher = client.ros.publisher(JointState, "/heptarm/servo/velocity")
    message = JointState(name=[client.joints[6]], velocity=[sign * 0.2])

    def away() -> bool:
        publisher.publish(message)
        return bool(sign * (client.place().q[6] - here[6]) > 0.1)

    until(away, "it does not follow")
    rest = rests(client)  # silence
    assert np.abs((rest - here)[:6]).max() < 5e-3
    publisher = client.ros.publisher(JointState, "/heptarm/servo/joint")

    def back() -> bool:
        publisher.publish(joint_state(client, here))
        return bool(np.abs(client.place().q - here).max() < TOUCH)

    until(back, "it is back")
    rests(client)


def test_a_goal_after_a_servo_topic_starts_from_rest(client: Client) -> None:
    here = client.place().q
    publisher = client.ros.publisher(JointState, "/heptarm/servo/joint")
    for _ in range(10):
        publisher.publish(joint_state(client, here))
        client.sleep(0.02)
    succeeds(client, step(client))


# ------------------------------------------------------------------------------------ several of them


@pytest.fixture
def small() -> Iterator[Stage]:
    """An iiwa 7."""
    running = Stage("--model", "iiwa7")
    yield running
    running.close()


def test_two_arms_by_namespace_and_prefix(ros: Ros, spare: Stage, small: Stage, nodes: Start) -> None:
    clients = []
    for side, stage in (("left", spare), ("right", small)):
        nodes(stage.target, space=f"/{side}", prefix=f"{side}_")
        clients.append(Client(ros, stage, f"/{side}/heptarm", f"{side}_"))
    for client in clients:
        client.ready()
    places = [client.place().q for client in clients]
    succeeds(clients[0], step(clients[0]))
    assert np.abs(clients[0].place().q - places[0]).max() > 0.05
    assert np.abs(clients[1].place().q - places[1]).max() < 2e-3, "the other arm is another"


_DESTROYED = """
import os, signal
from rclpy.executors import InvalidHandle
from rclpy.node import Node
from rclpy.waitable import NumberOfEntities, Waitable
from heptarm_ros2.process import run

class Destroyed(Waitable):
    times = 0
    def __enter__(self):
        return self
    def __exit__(self, *error):
        pass
    def get_num_entities(self):
        return NumberOfEntities()
    def add_to_wait_set(self, wait_set):
        Destroyed.times += 1
        if Destroyed.times < 4:
            raise InvalidHandle("cannot use Destroyable because destruction was requested")
    def is_ready(self, wait_set):
        return False
    def take_data(self):
        return None
    async def execute(self, data):
        pass

def make():
    node = Node("cleaned_up")
    node.add_waitable(Destroyed(node.default_callback_group))
    node.create_timer(0.05, lambda: Destroyed.times > 5 and os.kill(os.getpid(), signal.SIGINT))
    return node

run(make, [], threads=2)
"""


def test_what_is_destroyed_while_the_executor_collects_it_does_not_end_the_node() -> None:
    """rclpy leaves destroyed handles out, but not the events of a publisher: a race of a clean-up with the executor."""
    done = subprocess.run(
        [sys.executable, "-c", _DESTROYED], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


_CRASHES_AT_EXIT = """
import os, signal
from rclpy.node import Node
from heptarm_ros2.process import run

class Crash:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGSEGV)

crash = Crash()

def make():
    node = Node("leaving")
    node.create_timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT))
    return node

run(make, [], threads=2)
"""


def test_what_crashes_while_python_takes_it_apart_does_not_fail_a_node_that_has_ended_in_order() -> None:
    """What is left of rclpy does so at times: SIGSEGV in the garbage collector, after everything was closed."""
    done = subprocess.run(
        [sys.executable, "-c", _CRASHES_AT_EXIT], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
