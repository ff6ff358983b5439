"""The node under stress: many subscribers, preemptions and malformed goals, its own death, jumps of the clock."""

from __future__ import annotations

import select
import signal
import socket
import struct
import threading
import time
import xmlrpc.client
from collections.abc import Iterator
from typing import Any

import actionlib
import numpy as np
import pytest
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

import heptarm as ha
from tests.conformance.case import long, newest, rests, step, succeeds, under_way
from tests.conformance.stage import Stage
from tests.conformance.stress import preempted_without_growth, refused_in_flight, status
from tests.ros1.peer import Client, NodeProcess, collect, stamp, until


@pytest.mark.long  # every run has it with the node of ROS 2
@pytest.mark.parametrize(
    ("count", "seconds"),
    [(50, 2.5), pytest.param(3000, 300.0, marks=[pytest.mark.long, pytest.mark.timeout(900)])],
)
def test_preemptions_one_after_the_other(
    client: Client, node: NodeProcess, count: int, seconds: float
) -> None:
    """Fifty in a moment; with LONG=1 ten in each second for five minutes."""
    preempted_without_growth(client, node.process.pid, count=count, seconds=seconds)


@pytest.mark.long  # every run has it with the node of ROS 2
@pytest.mark.parametrize(
    "count", [200, pytest.param(10_000, marks=[pytest.mark.long, pytest.mark.timeout(1800)])]
)
def test_malformed_goals_twenty_in_flight(client: Client, node: NodeProcess, count: int) -> None:
    refused_in_flight(client, node.process.pid, count=count)


@pytest.fixture
def crowd(ros: None, spare: Stage) -> Iterator[NodeProcess]:
    """A node that publishes at 200 Hz."""
    node = NodeProcess(spare.target, ns="/crowd", state_rate=200.0)
    yield node
    assert node.end() == 0, node.said


class Crowd:
    """Subscribers of their own connections; those of one node would share one.

    Args:
        node: that publishes.
        topic: of joint states.
        count: how many.

    Attributes:
        received: messages so far, by subscriber.
    """

    def __init__(self, node: str, topic: str, count: int) -> None:
        self.received = [0] * count
        self._over = threading.Event()
        server = xmlrpc.client.ServerProxy(rosgraph.Master("/crowd").lookupNode(node))
        self._sockets = [self._connect(server, topic, f"/crowd/member{number}") for number in range(count)]
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _connect(self, server: xmlrpc.client.ServerProxy, topic: str, name: str) -> socket.socket:
        answer: Any = server.requestTopic(name, topic, [["TCPROS"]])
        _, _, (_, host, port) = answer
        fields = {
            "callerid": name,
            "topic": topic,
            "md5sum": JointState._md5sum,
            "type": JointState._type,
            "tcp_nodelay": "1",
        }
        rows = [f"{key}={value}".encode() for key, value in fields.items()]
        header = b"".join(struct.pack("<I", len(row)) + row for row in rows)
        connection = socket.create_connection((str(host), int(str(port))))
        connection.sendall(struct.pack("<I", len(header)) + header)
        return connection

    def _run(self) -> None:
        """Count messages: each has its length before it, and so has the header."""
        received = {one: b"" for one in self._sockets}
        began: set[socket.socket] = set()
        while not self._over.is_set():
            readable, _, _ = select.select(self._sockets, [], [], 0.1)
            for one in readable:
                data = received[one] + one.recv(65536)
                while len(data) >= 4 and len(data) >= 4 + (size := struct.unpack_from("<I", data)[0]):
                    data = data[4 + size :]
                    if one in began:
                        self.received[self._sockets.index(one)] += 1
                    began.add(one)
                received[one] = data

    def close(self) -> None:
        """End them."""
        self._over.set()
        self._thread.join()
        for one in self._sockets:
            one.close()


@pytest.mark.long  # how much a processor can serve
@pytest.mark.parametrize("seconds", [3.0, pytest.param(300.0, marks=pytest.mark.timeout(900))])
def test_twenty_subscribers_at_200_hz(spare: Stage, crowd: NodeProcess, seconds: float) -> None:
    client = Client(spare, "/crowd/heptarm")
    client.ready()
    members = Crowd("/crowd/heptarm", "/crowd/joint_states", 20)
    try:
        until(lambda: min(members.received) > 0, "not every subscriber receives states")
        memory, first = status(crowd.process.pid, "VmRSS"), list(members.received)
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            succeeds(client, step(client, time=1.0, size=0.5))

        def received() -> list[int]:
            return [after - before for before, after in zip(first, members.received)]

        # a busy machine delivers them later, but all subscribers are served alike
        until(lambda: min(received()) > 0.2 * 200.0 * seconds, "messages do not come")
        until(
            lambda: min(found := received()) > 0.5 * max(found), "some come to few subscribers", timeout=5.0
        )
        assert 1024 * (status(crowd.process.pid, "VmRSS") - memory) < 30e6
    finally:
        members.close()


@pytest.mark.long  # every run has it with the node of ROS 2
def test_a_node_that_is_killed_in_mid_goal_and_its_successor(ros: None, spare: Stage) -> None:
    node = NodeProcess(spare.target, ns="/fate", watchdog=2.0)
    successor = None
    try:
        client = Client(spare, "/fate/heptarm")
        client.ready()
        here = client.place().q
        assert client.send(long(client)).accepted
        under_way(client, here, 0.03)
        node.end(signal.SIGKILL)
        with ha.connect(spare.target, control=False, watchdog=5.0, timeout=30.0) as arm:
            moved = newest(arm).q
            until(lambda: np.abs(newest(arm).dq).max() < 1e-3, "the cabinet does not brake the arm")
            assert np.abs(newest(arm).q - moved).max() < 1.0
        successor = NodeProcess(spare.target, ns="/fate", watchdog=2.0)
        heir = Client(spare, "/fate/heptarm")
        heir.ready()
        rests(heir)
        succeeds(heir, step(heir))
    finally:
        node.end(signal.SIGKILL)
        if successor is not None:
            assert successor.end() == 0, successor.said


@pytest.fixture
def simulated(ros: None, spare: Stage) -> Iterator[list[float]]:
    """A simulated clock [s] in the first entry of a list, published at 50 Hz, and a node that lives by it."""
    now, over = [1e6], threading.Event()  # jumps go further back than forth
    publisher = rospy.Publisher("/clock", Clock, queue_size=1)

    def run() -> None:
        while not over.wait(0.02):
            now[0] += 0.02
            publisher.publish(Clock(clock=rospy.Time.from_sec(now[0])))

    thread = threading.Thread(target=run)
    thread.start()
    rospy.set_param(
        "/use_sim_time", True
    )  # nodes ask for it when they start; this process has started before
    node = NodeProcess(spare.target, ns="/jump")
    try:
        states = collect("/jump/joint_states", JointState)
        until(lambda: states, "the node does not start")
        rospy.delete_param("/use_sim_time")
        yield now
    finally:
        code = node.end()
        over.set()
        thread.join()
        publisher.unregister()
        assert code == 0, node.said


@pytest.mark.long  # every run has it with the node of ROS 2
@pytest.mark.parametrize("rounds", [1, pytest.param(40, marks=[pytest.mark.long, pytest.mark.timeout(1800)])])
def test_jumps_of_the_clock(simulated: list[float], rounds: int) -> None:
    states = collect("/jump/joint_states", JointState)
    client = actionlib.ActionClient("/jump/heptarm/follow_joint_trajectory", FollowJointTrajectoryAction)
    assert client.wait_for_server(rospy.Duration(60))
    near = lambda: bool(states) and abs(stamp(states[-1]) - simulated[0]) < 2.0  # noqa: E731
    until(near, "states do not have the simulated time")
    for jump in (3600.0, -4000.0, 0.0) * rounds:
        goal = FollowJointTrajectoryGoal()
        goal.trajectory.joint_names = list(states[-1].name)
        there = list(states[-1].position)
        there[6] += -0.1 if there[6] > 0 else 0.1
        goal.trajectory.points = [JointTrajectoryPoint(positions=there, time_from_start=rospy.Duration(1))]

        def accepted(goal: FollowJointTrajectoryGoal = goal) -> actionlib.ClientGoalHandle | None:
            """The goal; none while the node is not active yet."""
            one = client.send_goal(goal)
            until(lambda: one.get_goal_status() != GoalStatus.PENDING, "no answer")
            return None if one.get_goal_status() == GoalStatus.REJECTED else one

        handle = until(accepted, "the node does not accept goals")
        time.sleep(0.3)
        simulated[0] += jump
        until(lambda: handle.get_comm_state() == actionlib.CommState.DONE, "the goal does not end")  # noqa: B023
        assert handle.get_result().error_code == 0, handle.get_result().error_string
        until(near, "states do not follow the clock")
