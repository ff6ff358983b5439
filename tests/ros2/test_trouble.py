"""Faults around a node: emergency stop, a killed client, a killed and restarted cabinet."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import Trigger

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import braked, long, quiet, rests, stays, step, succeeds, under_way
from tests.conformance.stage import ROOT, Stage
from tests.ros2.peer import PATIENT, Client, NodeProcess, Ros, stamp, until


@pytest.fixture(scope="module")
def tough(spare: Stage) -> Iterator[NodeProcess]:
    """A node that has to survive all of them."""
    running = NodeProcess(spare.target, name="tough", space="/trouble", diagnostics_rate=10.0, **PATIENT)
    yield running
    assert running.process.poll() is None, f"the node has died:\n{running.said}"
    running.finish()


@pytest.fixture(scope="module")
def victim(ros: Ros, spare: Stage, tough: NodeProcess) -> Client:
    client = Client(ros, spare, "/trouble/tough")
    client.ready()
    return client


def test_an_emergency_stop_ends_a_goal_and_refuses_others(victim: Client, spare: Stage, ros: Ros) -> None:
    here = victim.place().q
    sent = victim.send(long(victim))
    under_way(victim, here)
    spare.do("press")
    ended = victim.result(sent)
    assert (ended.outcome, ended.code) == (GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL)
    assert "emergency stop" in ended.text
    rest = rests(victim)
    assert not victim.send(step(victim)).accepted
    answer = ros.call(Trigger, "/trouble/tough/recover", Trigger.Request())
    assert not answer.success and "emergency stop" in answer.message
    spare.do("release")
    until(
        lambda: ros.call(Trigger, "/trouble/tough/recover", Trigger.Request()).success, "it does not recover"
    )
    stays(victim, rest)  # nothing continues by itself
    succeeds(victim, step(victim))


CHILD = """
import sys, time
from tests.conformance.stage import Stage
from tests.conformance.case import step
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
    """Whether the newest diagnosis of the node has this level."""
    mine = [one for array in found for one in array.status if one.name == "trouble/tough: arm"]
    return bool(mine) and mine[-1].level == level


def test_a_cabinet_that_dies_and_comes_back(
    victim: Client, spare: Stage, ros: Ros, tough: NodeProcess
) -> None:
    found = ros.collect(DiagnosticArray, "/diagnostics")
    here = victim.place().q
    sent = victim.send(long(victim))
    under_way(victim, here)
    spare.kill()
    killed = victim.now()
    ended = victim.result(sent)
    assert (ended.outcome, ended.code) == (GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL)
    assert ended.text
    until(lambda: tough_is(found, b"\x02"), "diagnostics tell of it")
    until(lambda: quiet(victim), "old states are repeated")
    assert not victim.send(TrajectoryGoal(victim.joints, (TrajectoryPoint(1.0, tuple(here)),))).accepted
    spare.restart()
    until(lambda: stamp(victim.states[-1]) > killed, "states come again")
    until(lambda: tough_is(found, b"\x00"), "diagnostics are well again")
    succeeds(victim, step(victim))
    assert tough.process.poll() is None
    stamps = [stamp(message) for message in victim.states]
    assert all(a < b for a, b in zip(stamps, stamps[1:])), "no state twice"  # noqa: RUF007


def test_a_node_that_the_system_stops_for_a_while(victim: Client, spare: Stage, tough: NodeProcess) -> None:
    """The cabinet brakes the arm, the goal ends, and the node continues."""
    here = victim.place().q
    sent = victim.send(step(victim, time=9.0, size=6.0))
    under_way(victim, here)
    tough.process.send_signal(signal.SIGSTOP)
    braked(spare)
    tough.process.send_signal(signal.SIGCONT)
    ended = victim.result(sent)
    assert (ended.outcome, ended.code) == (GoalOutcome.ABORTED, ErrorCode.INVALID_GOAL), ended
    victim.ready()
    rests(victim)
    succeeds(victim, step(victim))
