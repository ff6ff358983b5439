"""The core and the safety of the robot: what a stop ends, what cannot start, and what a recovery does."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.peer import Peer, ptp, run

Connect = Callable[..., Peer]
Bits = wire.SafetyBits


@pytest.fixture
def peer(connect: Connect) -> Iterator[Peer]:
    peer = connect()
    peer.take_control()
    tidy(peer)
    end(peer, peer.ask(run(ptp())))
    yield peer
    tidy(peer)
    peer.ask(wire.Cancel(id=0))
    peer.ask(wire.ReleaseControl())


def say(peer: Peer, what: str) -> None:
    answer = peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text=f"operator: {what}"))
    assert isinstance(answer, wire.Accepted), answer


def tidy(peer: Peer) -> None:
    say(peer, "release")
    say(peer, "AUT")
    assert isinstance(peer.ask(wire.Recover()), wire.Accepted)


def reported(peer: Peer, where: Callable[[wire.SafetyChanged], bool]) -> wire.SafetyChanged:
    return peer.wait_for(wire.SafetyChanged, where)


def end(peer: Peer, accepted: wire.Accepted) -> wire.MotionFinished:
    assert isinstance(accepted, wire.Accepted), accepted
    return peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)


STOPS = [
    ("emergency stop", Bits.EMERGENCY_STOP, "emergency stop was pressed", "release the emergency stop"),
    ("safeguard", Bits.OPERATOR_SAFETY_OPEN, "safeguard was opened", "close the safeguard"),
    ("safety stop", Bits.PROTECTIVE_STOP, "safety function", "remove the cause of the safety stop"),
]


@pytest.mark.parametrize(("what", "bit", "why", "step"), STOPS)
def test_a_stop_ends_everything_and_nothing_begins(
    peer: Peer, what: str, bit: Bits, why: str, step: str
) -> None:
    running = peer.ask(run(ptp(2.0)))
    waiting = peer.ask(run(ptp(0.0)))
    peer.wait_for(wire.MotionStarted, lambda e: e.id == running.id)
    say(peer, what)
    for one in (running, waiting):
        finished = end(peer, one)
        assert (finished.cause, finished.code) == (wire.Cause.SAFETY, Code.SAFETY_STOP)
        assert why in finished.text
    assert why in reported(peer, lambda e: bool(e.bits & bit)).text
    for refused in (peer.ask(run(ptp(0.1))), peer.ask(wire.ServoOpen())):
        assert isinstance(refused, wire.Rejected) and refused.code == Code.NEEDS_OPERATOR
        assert step in refused.text
    if bit is not Bits.PROTECTIVE_STOP:
        left = peer.ask(wire.Recover())
        assert isinstance(left, wire.Rejected) and left.code == Code.NEEDS_OPERATOR and step in left.text
        say(peer, "release")
        held = peer.ask(run(ptp(0.1)))
        assert isinstance(held, wire.Rejected) and held.code == Code.SAFETY_STOP
    assert isinstance(peer.ask(wire.Recover()), wire.Accepted)
    assert end(peer, peer.ask(run(ptp(0.0)))).cause == wire.Cause.FINISHED
    assert (
        "ready"
        in reported(peer, lambda e: e.bits & (Bits.READY_TO_MOVE | Bits.PAUSED) == Bits.READY_TO_MOVE).text
    )


def test_an_enabling_switch_pauses_motions_and_ends_what_is_led_from_outside(peer: Peer) -> None:
    say(peer, "enable")
    say(peer, "T1")
    assert isinstance(peer.ask(wire.Recover()), wire.Accepted)
    running = peer.ask(run(ptp(1.5)))
    peer.wait_for(wire.MotionStarted, lambda e: e.id == running.id)
    say(peer, "release")
    reported(peer, lambda e: e.mode == wire.OperationMode.T1 and not e.bits & Bits.ENABLING_SWITCH)
    peer.read_for(0.2)
    assert not [e for e in peer.all(wire.MotionFinished) if e.id == running.id]
    left = peer.ask(wire.Recover())
    assert isinstance(left, wire.Rejected) and "enabling switch" in left.text and "T1" in left.text
    say(peer, "enable")
    assert isinstance(peer.ask(wire.Recover()), wire.Accepted)
    assert end(peer, running).cause == wire.Cause.FINISHED

    servo = peer.ask(wire.ServoOpen(watchdog=2.0))
    peer.wait_for(wire.MotionStarted, lambda e: e.id == servo.id)
    say(peer, "release")
    ended = end(peer, servo)
    assert (ended.cause, ended.code) == (wire.Cause.SAFETY, Code.SAFETY_STOP)
    assert "enabling switch" in ended.text


def test_what_was_accepted_just_before_a_stop_was_seen_needs_an_operator(peer: Peer) -> None:
    say(peer, "T1")  # seen a little later; until then programs are accepted, and wait
    accepted = peer.ask(run(ptp(0.3)))
    if isinstance(accepted, wire.Rejected):  # noticed in time
        assert accepted.code == Code.NEEDS_OPERATOR
        return
    moved = [e for e in peer.all(wire.MotionStarted) if e.id == accepted.id]
    finished = end(peer, accepted)
    assert not moved and (finished.cause, finished.code) == (wire.Cause.FAILED, Code.NEEDS_OPERATOR)


def test_a_new_controller_does_not_end_a_stop(peer: Peer, connect: Connect) -> None:
    say(peer, "emergency stop")
    reported(peer, lambda e: bool(e.bits & Bits.EMERGENCY_STOP))
    say(peer, "release")
    peer.ask(wire.ReleaseControl())
    other = connect()
    other.take_control()
    held = other.ask(run(ptp(0.1)))
    assert isinstance(held, wire.Rejected) and held.code == Code.SAFETY_STOP
    assert isinstance(other.ask(wire.Recover()), wire.Accepted)
    assert end(other, other.ask(run(ptp(0.0)))).cause == wire.Cause.FINISHED
    other.ask(wire.ReleaseControl())
    peer.take_control()


@pytest.mark.parametrize("kind", list(wire.StopKind))
def test_every_kind_of_stop_is_taken_again_and_again(peer: Peer, kind: wire.StopKind) -> None:
    running, waiting = peer.ask(run(ptp(1.0))), peer.ask(run(ptp(0.9)))
    peer.wait_for(wire.MotionStarted, lambda e: e.id == running.id)
    for _ in range(3):
        assert isinstance(peer.ask(wire.Stop(kind=kind)), wire.Accepted)
    first, second = end(peer, running), end(peer, waiting)
    finishes = kind is wire.StopKind.AFTER_MOTION
    assert first.cause == (wire.Cause.FINISHED if finishes else wire.Cause.STOPPED)
    assert second.cause == wire.Cause.STOPPED and math.isnan(second.residual)
