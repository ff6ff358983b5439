"""FRI sessions in the cabinet's core: opened, commanded, ended, and the outcome of one that nobody answers."""

from __future__ import annotations

from typing import Any

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run

States = wire.FriSessionState


def controller(port: int) -> Peer:
    peer = Peer(port)
    peer.take_control()
    return peer


def fri(**fields: Any) -> wire.FriOpen:
    settings = {"host": "127.0.0.1", "period": 0.005, "command": wire.FriCommandMode.POSITION, "timeout": 2.0}
    return wire.FriOpen(**{**settings, **fields})


def opened(peer: Peer, **fields: Any) -> int:
    answer = peer.ask(fri(**fields))
    assert isinstance(answer, wire.Accepted), answer
    return int(answer.id)


def states(peer: Peer, session: int) -> list[wire.FriSessionState]:
    return [event.state for event in peer.all(wire.FriChanged) if event.session == session]


def test_a_session_with_an_overlay_runs_as_a_motion_until_it_is_closed(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        session = opened(peer)
        peer.wait_for(wire.MotionStarted, lambda event: event.id == session)
        busy = peer.ask(fri())
        assert isinstance(busy, wire.Rejected) and busy.code == Code.BUSY
        assert isinstance(peer.ask(wire.FriClose(session=session)), wire.Accepted)
        end = peer.wait_for(wire.MotionFinished, lambda event: event.id == session)
        assert end.cause is wire.Cause.CANCELLED
        seen = states(peer, session)
        assert seen == [
            States.MONITORING_WAIT,
            States.MONITORING_READY,
            States.COMMANDING_WAIT,
            States.IDLE,
        ]


def test_without_an_answering_client_it_fails_in_words(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        session = opened(peer, period=0.1, timeout=0.2)
        end = peer.wait_for(wire.MotionFinished, lambda event: event.id == session)
        assert (end.cause, end.code) == (wire.Cause.FAILED, Code.NOT_READY)
        assert "no FRI client answered from 127.0.0.1:30200 within 0.2 s" in end.text
        assert isinstance(peer.ask(run(ptp(0.1))), wire.Accepted)  # and everything continues


def test_an_overlay_that_fails_ends_the_motion_with_the_robots_words(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        session = opened(peer, period=0.009)
        end = peer.wait_for(wire.MotionFinished, lambda event: event.id == session)
        assert (end.cause, end.text) == (wire.Cause.FAILED, "illegal axis delta")
        idle = [event for event in peer.all(wire.FriChanged) if event.session == session][-1]
        assert (idle.state, idle.text) == (States.IDLE, "illegal axis delta")


def test_a_stop_while_it_waits_for_its_client(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        session = opened(peer, period=0.1, timeout=10.0)
        peer.wait_for(wire.FriChanged, lambda event: event.session == session)
        peer.ask(wire.Stop())
        assert peer.wait_for(wire.MotionFinished, lambda e: e.id == session).cause is wire.Cause.STOPPED


def test_a_session_that_monitors_runs_beside_motions_and_ends_with_its_controller(
    cabinet: FakeCabinet,
) -> None:
    with Peer(cabinet.port) as watching:
        peer = controller(cabinet.port)
        session = opened(peer, command=wire.FriCommandMode.MONITOR)
        assert isinstance(peer.ask(run(ptp(0.2))), wire.Accepted)
        peer.wait_for(wire.FriChanged, lambda e: e.session == session and e.state is States.MONITORING_READY)
        assert isinstance(peer.ask(wire.FriClose(session=session)), wire.Accepted)
        peer.wait_for(wire.FriChanged, lambda e: e.session == session and e.state is States.IDLE)
        again = peer.ask(wire.FriClose(session=session))
        assert isinstance(again, wire.Rejected) and again.code == Code.UNKNOWN_MOTION
        session = opened(peer, command=wire.FriCommandMode.MONITOR)
        peer.close()
        watching.wait_for(wire.FriChanged, lambda e: e.session == session and e.state is States.IDLE)


def test_a_monitor_that_nobody_answers_ends_by_itself(cabinet: FakeCabinet) -> None:
    with controller(cabinet.port) as peer:
        session = opened(peer, command=wire.FriCommandMode.MONITOR, period=0.1, timeout=0.2)
        end = peer.wait_for(wire.FriChanged, lambda e: e.session == session and e.state is States.IDLE)
        assert end.code == Code.NOT_READY and "no FRI client answered" in end.text


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"command": wire.FriCommandMode.POSE}, Code.UNSUPPORTED),
        ({"command": wire.FriCommandMode.MONITOR, "port": 1}, Code.EXECUTION_FAILED),
        ({"period": 0.5}, Code.OUT_OF_RANGE),
        ({"io": ("Flange.Door",)}, Code.UNKNOWN_NAME),
        ({"io": ("Flange.Lamp", "Flange.Lamp")}, Code.UNKNOWN_NAME),
        ({"io": ("Cell.Offset",)}, Code.UNSUPPORTED),
        ({"io": ("Flange.Lamp",) * 11}, Code.BAD_LENGTH),
        ({"host": ""}, Code.BAD_LENGTH),
        ({"timeout": float("nan")}, Code.NOT_FINITE),
    ],
)
def test_what_cannot_be_is_refused(cabinet: FakeCabinet, fields: dict[str, Any], code: Code) -> None:
    with controller(cabinet.port) as peer:
        answer = peer.ask(fri(**fields))
        assert isinstance(answer, wire.Rejected) and answer.code == code
