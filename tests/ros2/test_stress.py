"""The node under stress: many subscribers, preemptions and malformed goals, its own death, jumps of the clock."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from control_msgs.action import FollowJointTrajectory
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

import heptarm as ha
from tests.conformance.case import long, newest, rests, step, succeeds, under_way
from tests.conformance.stage import Stage
from tests.conformance.stress import preempted_without_growth, refused_in_flight, status
from tests.ros2.peer import PATIENT, Client, NodeProcess, Ros, stamp, to_duration, to_time, until

Start = Callable[..., NodeProcess]


@pytest.mark.parametrize(
    ("count", "seconds"),
    [(50, 2.5), pytest.param(3000, 300.0, marks=[pytest.mark.long, pytest.mark.timeout(900)])],
)
def test_preemptions_one_after_the_other(
    client: Client, node: NodeProcess, count: int, seconds: float
) -> None:
    """Fifty in a moment; with LONG=1 ten in each second for five minutes."""
    preempted_without_growth(client, node.process.pid, count=count, seconds=seconds)


@pytest.mark.parametrize(
    "count", [200, pytest.param(10_000, marks=[pytest.mark.long, pytest.mark.timeout(1800)])]
)
def test_malformed_goals_twenty_in_flight(client: Client, node: NodeProcess, count: int) -> None:
    refused_in_flight(client, node.process.pid, count=count)


@pytest.mark.long  # how much a processor can serve
@pytest.mark.parametrize(
    "seconds", [3.0, pytest.param(300.0, marks=[pytest.mark.long, pytest.mark.timeout(900)])]
)
def test_twenty_subscribers_at_200_hz(ros: Ros, spare: Stage, nodes: Start, seconds: float) -> None:
    node = nodes(spare.target, name="busy", space="/crowd", state_rate=200.0)
    client = Client(ros, spare, "/crowd/busy")
    client.ready()
    counts = [0] * 20
    context = Ros("crowd")
    try:
        for number in range(20):

            def count(_: JointState, number: int = number) -> None:
                counts[number] += 1

            context.do(context.node.create_subscription, JointState, "/crowd/joint_states", count, 1)
        until(lambda: min(counts) > 0, "not every subscriber receives states")
        memory, first = status(node.process.pid, "VmRSS"), list(counts)
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            succeeds(client, step(client, time=1.0, size=0.5))

        def received() -> list[int]:
            return [after - before for before, after in zip(first, counts)]

        # a busy machine delivers them later, but all subscribers are served alike
        until(lambda: min(received()) > 0.2 * 200.0 * seconds, "messages do not come")
        until(
            lambda: min(found := received()) > 0.5 * max(found), "some come to few subscribers", timeout=5.0
        )
        assert 1024 * (status(node.process.pid, "VmRSS") - memory) < 30e6
    finally:
        context.close()


def test_a_node_that_is_killed_in_mid_goal_and_its_successor(ros: Ros, spare: Stage) -> None:
    values = PATIENT | {"watchdog": 2.0}
    node = NodeProcess(spare.target, name="mortal", space="/fate", **values)
    client = Client(ros, spare, "/fate/mortal")
    successor = None
    try:
        client.ready()
        here = client.place().q
        assert client.send(long(client)).accepted
        under_way(client, here, 0.03)
        node.end(signal.SIGKILL)
        with ha.connect(spare.target, control=False, watchdog=5.0, timeout=30.0) as arm:
            moved = newest(arm).q
            until(lambda: np.abs(newest(arm).dq).max() < 1e-3, "the cabinet does not brake the arm")
            assert np.abs(newest(arm).q - moved).max() < 1.0
        successor = NodeProcess(spare.target, name="mortal", space="/fate", **values)
        heir = Client(ros, spare, "/fate/mortal")
        heir.ready()
        rests(heir)
        succeeds(heir, step(heir))
    finally:
        node.end(signal.SIGKILL)
        if successor is not None:
            successor.finish()


@pytest.fixture
def simulated(ros: Ros) -> Iterator[list[float]]:
    """A simulated clock [s] in the first entry of a list, published at 50 Hz."""
    now, over = [1e6], threading.Event()  # jumps go further back than forth
    publisher = ros.do(ros.node.create_publisher, Clock, "/clock", 1)

    def run() -> None:
        while not over.wait(0.02):
            now[0] += 0.02
            publisher.publish(Clock(clock=to_time(now[0])))

    thread = threading.Thread(target=run)
    thread.start()
    yield now
    over.set()
    thread.join()
    ros.do(ros.node.destroy_publisher, publisher)


@pytest.mark.parametrize("rounds", [1, pytest.param(40, marks=[pytest.mark.long, pytest.mark.timeout(1800)])])
def test_jumps_of_the_clock(
    ros: Ros, spare: Stage, nodes: Start, simulated: list[float], rounds: int
) -> None:
    nodes(spare.target, space="/jump", use_sim_time=True)
    states = ros.collect(JointState, "/jump/joint_states")
    action = ros.act(FollowJointTrajectory, "/jump/heptarm/follow_joint_trajectory")
    near = lambda: bool(states) and abs(stamp(states[-1]) - simulated[0]) < 2.0  # noqa: E731
    until(near, "states do not have the simulated time")
    for jump in (3600.0, -4000.0, 0.0) * rounds:
        goal = FollowJointTrajectory.Goal()
        goal.trajectory.joint_names = list(states[-1].name)
        there = list(states[-1].position)
        there[6] += -0.1 if there[6] > 0 else 0.1
        goal.trajectory.points.append(JointTrajectoryPoint(positions=there, time_from_start=to_duration(1.0)))
        handle = None
        while handle is None or not handle.accepted:  # the node may not be active yet
            handle = ros.send_goal(action, goal)
        time.sleep(0.3)
        simulated[0] += jump
        answer = ros.wait(handle.get_result_async(), "the goal does not end")
        assert answer.result.error_code == 0, answer.result.error_string
        until(near, "states do not follow the clock")
