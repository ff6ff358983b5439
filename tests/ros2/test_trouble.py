"""What goes wrong around a node: emergency stop, a client that dies, a cabinet that dies and comes back."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger

from heptarm.bridge.goal import Code, Goal, Outcome, Point
from tests.conformance.cases import rests, step, succeeds
from tests.conformance.stage import ROOT, Stage
from tests.ros2.peer import Client, NodeProcess, Ros, until


@pytest.fixture(scope="module")
def arena() -> Iterator[Stage]:
    """A cabinet for trouble."""
    running = Stage()
    yield running
    running.close()


@pytest.fixture(scope="module")
def tough(arena: Stage) -> Iterator[NodeProcess]:
    """A node that has to live through all of it."""
    running = NodeProcess(
        arena.target, name="tough", space="/trouble", diagnostics_rate=10.0, servo__watchdog=1.0
    )
    yield running
    assert running.process.poll() is None, f"the node has died:\n{running.said}"
    running.finish()


@pytest.fixture(scope="module")
def victim(ros: Ros, arena: Stage, tough: NodeProcess) -> Client:
    client = Client(ros, arena, "/trouble/tough")
    client.ready()
    return client


def test_an_emergency_stop_ends_a_goal_and_refuses_others(victim: Client, arena: Stage, ros: Ros) -> None:
    sent = victim.send(step(victim, time=3.0, size=3.0))
    victim.sleep(1.0)
    arena.do("press")
    ended = victim.result(sent)
    assert (ended.outcome, ended.code) == (Outcome.ABORTED, Code.INVALID_GOAL)
    assert "emergency stop" in ended.text
    rest = rests(victim)
    assert not victim.send(step(victim)).accepted
    answer = ros.call(Trigger, "/trouble/tough/recover", Trigger.Request())
    assert not answer.success and "emergency stop" in answer.message
    arena.do("release")
    until(
        lambda: ros.call(Trigger, "/trouble/tough/recover", Trigger.Request()).success, "it does not recover"
    )
    victim.sleep(0.5)
    assert np.abs(victim.place().q - rest).max() < 2e-3, "nothing goes on by itself"
    succeeds(victim, step(victim))


CHILD = """
import sys, time
from tests.conformance.stage import Stage
from tests.conformance.cases import step
from tests.ros2.peer import Client, Ros
import os, threading
threading.Timer(120, os._exit, (1,)).start()
client = Client(Ros("child"), None, "/trouble/tough")
try:
    client.ready()
except TimeoutError as error:
    sys.exit(str(error))
print(client.send(step(client, time=2.0)).accepted, flush=True)
time.sleep(100)
"""


def test_a_client_that_is_killed_leaves_a_node_that_serves_others(victim: Client) -> None:
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD], cwd=ROOT, stdout=subprocess.PIPE, text=True, env=os.environ
    )
    assert child.stdout is not None
    try:
        assert child.stdout.readline().strip() == "True"
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
    rests(victim)
    succeeds(victim, step(victim))


def tough_is(found: list[DiagnosticArray], level: bytes) -> bool:
    """Whether the node's newest diagnosis has that level."""
    mine = [one for array in found for one in array.status if one.name == "trouble/tough: arm"]
    return bool(mine) and mine[-1].level == level


def test_a_cabinet_that_dies_and_comes_back(
    victim: Client, arena: Stage, ros: Ros, tough: NodeProcess
) -> None:
    found = ros.collect(DiagnosticArray, "/diagnostics")
    sent = victim.send(step(victim, time=4.0))
    victim.sleep(0.5)
    arena.kill()
    ended = victim.result(sent)
    assert (ended.outcome, ended.code) == (Outcome.ABORTED, Code.INVALID_GOAL)
    assert ended.text
    until(lambda: tough_is(found, b"\x02"), "diagnostics tell of it")
    victim.sleep(1.0)  # what was on its way has come
    count = len(victim.states)
    victim.sleep(0.5)
    assert len(victim.states) == count, "old states are not repeated"
    here = tuple(victim.states[-1].position)
    assert not victim.send(Goal(victim.joints, (Point(1.0, here),))).accepted
    arena.restart()
    until(lambda: len(victim.states) > count, "states come again")
    until(lambda: tough_is(found, b"\x00"), "diagnostics are well again")
    succeeds(victim, step(victim))
    assert tough.process.poll() is None
    stamps = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in victim.states]
    assert all(a < b for a, b in zip(stamps, stamps[1:])), "no state twice"  # noqa: RUF007


def test_a_node_that_the_system_stops_for_a_while(victim: Client, tough: NodeProcess) -> None:
    """The cabinet brakes the arm, the goal ends, and the node goes on."""
    sent = victim.send(step(victim, time=6.0, size=3.0))
    victim.sleep(0.7)
    tough.process.send_signal(signal.SIGSTOP)
    time.sleep(2.0)
    tough.process.send_signal(signal.SIGCONT)
    ended = victim.result(sent)
    assert (ended.outcome, ended.code) == (Outcome.ABORTED, Code.INVALID_GOAL), ended
    rests(victim)
    succeeds(victim, step(victim))
