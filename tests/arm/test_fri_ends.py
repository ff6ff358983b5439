"""Ends of FRI sessions with a scripted cabinet; the messages over UDP are real."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

import heptarm as ha
from heptarm.fri.protocol.messages import SessionState
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer, Served
from tests.fri_loop.controller import Controller

OFFERED = ("hold", "fri", "fri_monitor", "fri_position")
States = wire.FriSessionState


@pytest.fixture
def peer() -> Iterator[Peer]:
    cabinet = Peer(capabilities=OFFERED)
    yield cabinet
    cabinet.close()


@contextmanager
def speaking(peer: Peer, *, number: int, state: SessionState) -> Iterator[dict[str, Any]]:
    """The peer accepts a session and sends messages as a controller does, from its start to its end."""
    heard: dict[str, Any] = {"running": threading.Event()}

    def accept(client: Served, request: int) -> None:
        (asked,) = (one for one in peer.seen if isinstance(one, wire.FriOpen))
        heard["asked"] = asked
        client.say(wire.Accepted(id=number), request)
        heard["controller"] = Controller(asked.port, state=state, period_ms=5)
        heard["running"].set()
        if asked.command is not wire.FriCommandMode.MONITOR:
            client.say(wire.MotionStarted(id=number, item=0))
        client.say(changed(number, States(int(state)), wire.FriQuality.GOOD))

    peer.expect(wire.FriOpen, accept)
    done = threading.Event()

    def run() -> None:
        if heard["running"].wait(30.0):
            with heard["controller"].running():
                done.wait(60.0)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield heard
    finally:
        heard["running"].set()
        done.set()
        thread.join()


def changed(number: int, state: States, quality: wire.FriQuality, code: int = 0, text: str = "") -> Any:
    return wire.FriChanged(session=number, state=state, quality=quality, code=code, text=text)


def end_of(
    peer: Peer, quality: wire.FriQuality, cause: wire.Cause, *, code: int, text: str
) -> Callable[[], None]:
    """The last events of session 7, in the cabinet's order: the session, then the motion."""

    def say() -> None:
        peer.tell(changed(7, States.IDLE, quality, code, text))
        peer.tell(peer.finished(7, cause, code=code, text=text))

    return say


@pytest.mark.parametrize(
    ("quality", "cause", "code", "text", "kind"),
    [
        ("GOOD", "SAFETY", Code.SAFETY_STOP, "the emergency stop was pressed", ha.MotionAborted),
        ("GOOD", "FAILED", Code.EXECUTION_FAILED, "Illegal axis delta: A7", ha.MotionAborted),
        ("FAIR", "FAILED", Code.EXECUTION_FAILED, "FRI connection quality is FAIR", ha.QualityLost),
        ("POOR", "STOPPED", 0, "red button", ha.MotionAborted),
        ("GOOD", "LOST", 0, "its controller fell silent", ha.ConnectionLost),
    ],
)
def test_what_ended_an_overlay_rises_at_the_end_of_the_block(
    peer: Peer, quality: str, cause: str, code: int, text: str, kind: type[ha.HeptarmError]
) -> None:
    say = end_of(peer, wire.FriQuality[quality], wire.Cause[cause], code=int(code), text=text)
    with (
        speaking(peer, number=7, state=SessionState.COMMANDING_ACTIVE) as heard,
        peer.arm(timeout=20.0, watchdog=5.0) as arm,
    ):
        with (
            pytest.raises(kind, match=text) as error,
            arm.fri("position", period_ms=5, realtime=False, port=0, host="127.0.0.1") as rt,
        ):
            assert heard["asked"].port == rt.client.port and heard["asked"].period == 0.005
            threading.Timer(0.1, say).start()
            assert not rt.wait(30.0)
        assert type(error.value) is kind and error.value.code == int(code)


def test_the_guards_part_in_a_bad_end_is_reported(peer: Peer) -> None:
    with (
        speaking(peer, number=7, state=SessionState.COMMANDING_ACTIVE),
        peer.arm(timeout=20.0, watchdog=5.0) as arm,
    ):
        say = end_of(peer, wire.FriQuality.GOOD, wire.Cause.FAILED, code=0, text="Illegal axis delta")
        with (
            pytest.raises(ha.MotionAborted, match=r"the guard had limited: A1: .* limited in") as error,
            arm.fri("position", period_ms=5, realtime=False, port=0, host="127.0.0.1") as rt,
        ):
            for s in rt:
                rt.command(q=s.q_ipo + 0.5)
                if s.t > 0.2:
                    break
            say()
            rt.wait(30.0)
        assert len(error.value.history) > 5


@pytest.mark.parametrize(
    ("quality", "text", "kind"),
    [
        ("POOR", "has not answered well", ha.QualityLost),
        ("GOOD", "", ha.StreamError),
    ],
)
def test_a_monitor_that_the_cabinet_ends(peer: Peer, quality: str, text: str, kind: type[Exception]) -> None:
    with (
        speaking(peer, number=9, state=SessionState.MONITORING_READY),
        peer.arm(timeout=20.0, watchdog=5.0) as arm,
        pytest.raises(kind, match=text or "ended by the cabinet"),
        arm.fri("monitor", realtime=False, port=0, host="127.0.0.1") as rt,
    ):
        assert rt.next() is not None
        peer.tell(changed(9, States.IDLE, wire.FriQuality[quality], 0, text))
        assert not rt.wait(30.0)
        peer.tell(
            changed(9, States.MONITORING_READY, wire.FriQuality.GOOD)
        )  # late event: the session stays ended
        assert rt.next() is None


def test_a_monitor_ends_with_the_control(peer: Peer) -> None:
    with (
        speaking(peer, number=9, state=SessionState.MONITORING_READY),
        peer.arm(timeout=20.0, watchdog=5.0) as arm,
        pytest.raises(ha.StreamError, match="no longer controls the robot"),
        arm.fri("monitor", realtime=False, port=0, host="127.0.0.1") as rt,
    ):
        peer.tell(wire.ControlChanged(session=0, controller="", text="silent for 500 ms"))
        peer.tell(changed(9, States.IDLE, wire.FriQuality.GOOD))
        assert not rt.wait(30.0)


def test_a_link_that_breaks_ends_the_session(peer: Peer) -> None:
    with speaking(peer, number=7, state=SessionState.COMMANDING_ACTIVE):
        arm = peer.arm(timeout=20.0, watchdog=5.0)
        with (
            pytest.raises(ha.ConnectionLost),
            arm.fri("position", period_ms=5, realtime=False, port=0, host="127.0.0.1") as rt,
        ):
            peer.drop()
            assert not rt.wait(30.0)
        arm.close()


def test_a_cabinet_without_the_option_reports_which(peer: Peer) -> None:
    peer.changes["capabilities"] = ("ptp", "hold")
    with (
        peer.arm(timeout=20.0, watchdog=5.0) as arm,
        pytest.raises(ha.CommandRejected, match="install the option Sunrise.FRI"),
    ):
        arm.fri("monitor")
    peer.changes["capabilities"] = OFFERED
    with (
        peer.arm(timeout=20.0, watchdog=5.0) as arm,
        pytest.raises(ha.CommandRejected, match="no FRI sessions of kind 'torque'"),
    ):
        arm.fri("torque")
