"""The client is bypassed: every bad value of the schema as a raw message to the application in a virtual cabinet."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
import sample_bodies
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import Target
from heptarm.wire import messages as wire
from heptarm.wire.messages import Message
from tests.cabinet.peer import NONCE, Closed, Peer, is_of
from tests.schema.spoiling import SPEC, Case, cases

PATIENCE = 30.0
#: Bytes that no body has at its end.
RUBBISH = b"\xff\xff\xff\xff\xff"


@pytest.fixture(scope="module")
def cabinet() -> Iterator[PrivateCabinet]:
    cases()  # takes a while, in which nobody would answer the cabinet
    running = PrivateCabinet.start(Target(model="iiwa14", options=(("speed", "3"),)))
    yield running
    running.close()


@pytest.fixture
def peer(cabinet: PrivateCabinet) -> Iterator[Peer]:
    """In control; afterwards motions, tools and lamps are as before, and the cabinet works."""
    with Peer(cabinet.port, name="bypass") as peer:
        peer.take_control()
        before = picture(cabinet)
        yield peer
        assert picture(cabinet) == before
        assert not peer.all(wire.MotionStarted)
        peer.ask(wire.ReleaseControl())
    with ha.connect(f"sim://{cabinet.host}:{cabinet.port}", timeout=PATIENCE, watchdog=5.0) as arm:
        assert arm.move(ha.ptp(arm.state.q_cmd + 0.01)).arrived


def picture(cabinet: PrivateCabinet) -> tuple[object, ...]:
    """The state that a refused request might have changed."""
    with ha.connect(f"sim://{cabinet.host}:{cabinet.port}", control=False, timeout=PATIENCE) as arm:
        arm.subscribe(groups=("joints", "motion", "safety", "mode", "io"))
        state = arm.wait_until(
            lambda s: s.groups.io is not None and s.groups.mode is not None, timeout=PATIENCE
        )
        assert state.motion is not None and state.groups.mode is not None
        motion, control = state.motion, state.groups.mode
        reported = (motion.id, motion.queued, motion.override, control.mode, control.tool, control.workpiece)
        return (
            *reported,
            control.frame,
            tuple(state.io.items()),
            tuple(np.round(state.q, 4)),
            arm.controller,
        )


def requests(kind: str) -> list[Case]:
    """Bad messages of a kind that clients send."""
    return [
        case for case in cases() if SPEC.messages[type(case.message).__name__].kind == kind and _ours(case)
    ]


def _ours(case: Case) -> bool:
    return SPEC.messages[type(case.message).__name__].source == "client"


def test_each_bad_request_is_refused_with_code_and_place(peer: Peer) -> None:
    every = requests("request")
    assert len({case.field for case in every}) > 100
    for case in every:
        answer = peer.ask(case.message)
        assert isinstance(answer, wire.Rejected), (case, answer)
        assert (answer.code, answer.parameter) == (case.bad.code, case.path), (
            case.field,
            case.bad.why,
            answer,
        )
        assert answer.text


def test_each_body_that_is_none_is_refused(peer: Peer) -> None:
    for message in SPEC.messages.values():
        if (message.source, message.kind) != ("client", "request"):
            continue
        whole = sample_bodies.body(SPEC, message.name, "whole")
        for body in (whole[:-1], whole + RUBBISH):
            if len(body) == len(RUBBISH) or not whole:
                continue  # no fields: nothing can be missing, and more is of a later version
            answer = peer.ask(Raw(message.id, body))
            assert isinstance(answer, wire.Rejected) and answer.code == wire_code("bad_body"), (
                message.name,
                answer,
            )


class Raw:
    """A body as it is."""

    def __init__(self, number: int, body: bytes) -> None:
        self.TYPE = number
        self._body = body

    def encode(self) -> bytes:
        return self._body


def wire_code(name: str) -> int:
    return next(int(error["code"]) for error in SPEC.errors if error["name"] == name)


@pytest.mark.parametrize("kind", [wire.ServoJoints, wire.ServoJointsVelocity, wire.ServoPose])
def test_each_bad_target_is_counted_and_reported(cabinet: PrivateCabinet, kind: type[Message]) -> None:
    with Peer(cabinet.port, name="bypass") as peer:
        peer.take_control()
        for case in requests("oneway"):
            if not isinstance(case.message, kind):
                continue
            number = peer.ask(wire.ServoOpen(watchdog=2.0)).id
            peer.wait_for(wire.MotionStarted, is_of(number), timeout=PATIENCE)
            peer.send(dataclasses.replace(case.message, servo=number))
            assert isinstance(peer.ask(wire.ServoClose(servo=number)), wire.Accepted)
            status = peer.wait_for(wire.ServoStatus, is_of(number), timeout=PATIENCE)
            assert (status.refused, status.applied, status.code) == (1, 0, case.bad.code), (case, status)
            peer.wait_for(wire.MotionFinished, is_of(number), timeout=PATIENCE)


def test_a_bad_hello_gets_no_session(cabinet: PrivateCabinet) -> None:
    for case in requests("handshake"):
        if not isinstance(case.message, wire.Hello):
            continue
        with Peer(cabinet.port, hello=False) as peer:
            peer.send(dataclasses.replace(case.message, major=wire.MAJOR))
            answer = peer.next(PATIENCE)
            assert isinstance(answer, wire.Refusal) and answer.code == case.bad.code, (case, answer)
            with pytest.raises(Closed):
                peer.next(PATIENCE)
    with Peer(cabinet.port, hello=False) as peer:
        peer.send(wire.Proof(mac=NONCE))
        assert peer.next(PATIENCE).code == wire_code("unexpected_message")
