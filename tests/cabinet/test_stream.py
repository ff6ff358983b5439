"""The byte stream: any split or merge is legal, and a client that does not read delays no other."""

from __future__ import annotations

import random
import socket
import time
from collections.abc import Callable

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run

Connect = Callable[..., Peer]


@pytest.mark.parametrize("size", [1, 7, 25, 26, 27, 1000])
def test_frames_may_be_cut_anywhere(connect: Connect, size: int) -> None:
    peer = connect()
    stream = b"".join(peer.pack(wire.Ping(sent=k)) + peer.pack(wire.Stop(), 100 + k) for k in range(20))
    for at in range(0, len(stream), size):
        peer.socket.sendall(stream[at : at + size])
        if size < 10 and at % 100 == 0:
            time.sleep(0.0005)
    assert isinstance(peer.answer(119), wire.Accepted)
    assert [pong.sent for pong in peer.all(wire.Pong)] == list(range(20))
    assert [frame.request for frame, _ in peer.seen if frame.request] == [100 + k for k in range(20)]


def test_frames_are_numbered_without_a_gap(connect: Connect) -> None:
    peer = connect()
    peer.ask(wire.Subscribe(groups=wire.Groups.JOINTS, rate=500.0))
    for _ in range(50):
        peer.ask(wire.Stop())
    assert [frame.seq for frame, _ in peer.seen] == list(range(len(peer.seen)))


def test_a_body_of_the_largest_size_is_taken_and_a_larger_one_is_not(connect: Connect) -> None:
    peer = connect()
    body = b"\0" * wire.MAX_BODY
    peer.socket.sendall(wire.HEADER.pack(wire.MAGIC, wire.MAJOR, 0, 900, len(body), 1, 1, 0) + body)
    assert peer.answer(1).code == Code.UNKNOWN_MESSAGE
    peer.socket.sendall(wire.HEADER.pack(wire.MAGIC, wire.MAJOR, 0, 900, len(body) + 1, 2, 2, 0))
    assert peer.wait_for(wire.Goodbye).code == Code.BAD_FRAME


def test_a_client_that_does_not_read_is_closed_and_holds_up_nobody(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    every = wire.Groups(63)
    with Peer(cabinet.port, name="slow") as slow, Peer(cabinet.port, name="quick") as quick:
        slow.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.send(wire.Subscribe(groups=every, rate=1000.0), 1)
        quick.ask(wire.Subscribe(groups=every, rate=200.0))
        deadline = time.monotonic() + 60.0
        rounds = 0
        while "ha-reader-1" in cabinet.threads():
            assert time.monotonic() < deadline
            assert isinstance(quick.ask(wire.Stop()), wire.Accepted)
            rounds += 1
            time.sleep(0.05)
        assert (
            rounds > 3
        )  # the one that does not read is closed after two seconds; the other is answered meanwhile
        before = len(quick.all(wire.State))
        quick.wait(lambda *_: len(quick.all(wire.State)) - before > 100)
        stamps = [state.joints.stamp for state in quick.all(wire.State) if state.joints is not None]
        assert stamps == sorted(set(stamps))


def test_every_state_that_was_due_is_sent_or_reported_as_missed(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make()
    with Peer(cabinet.port, name="slow") as slow, Peer(cabinet.port, name="quick") as quick:
        slow.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 32768)
        slow.send(wire.Subscribe(groups=wire.Groups(63), rate=1000.0), 1)
        for _ in range(20):  # it does not read for a second
            quick.ask(wire.Stop())
            time.sleep(0.05)
        slow.wait_for(wire.StatesMissed)
        slow.read_for(0.5)
        slow.ask(wire.Subscribe(groups=wire.Groups(0), rate=0.0))
        stamps = [state.joints.stamp for state in slow.all(wire.State) if state.joints is not None]
        missed = sum(event.count for event in slow.all(wire.StatesMissed))
        assert missed > 0
        # stamps are those of the readings, up to a period after a state was due
        assert len(stamps) + missed == pytest.approx((stamps[-1] - stamps[0]) / 1e6 + 1.0, abs=3.0)


def test_requests_without_reading_the_answers_end_that_client_only(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make(heartbeat=10.0)  # the other client sends nothing meanwhile
    with Peer(cabinet.port) as rude, Peer(cabinet.port) as other:
        rude.socket.settimeout(10)
        with pytest.raises(OSError):
            for _ in range(2000):
                rude.socket.sendall(b"".join(rude.pack(wire.Stop(), 1 + k) for k in range(1000)))
        assert isinstance(other.ask(wire.Stop()), wire.Accepted)
    assert cabinet.errors() == []


def test_a_program_of_a_thousand_items_in_one_frame(connect: Connect) -> None:
    peer = connect()
    peer.take_control()
    accepted = peer.ask(run(*[ptp(0.0001 * (k % 2)) for k in range(1000)]))
    assert isinstance(accepted, wire.Accepted)
    finished = peer.wait_for(wire.MotionFinished, timeout=20)
    assert (finished.id, finished.item, finished.cause) == (accepted.id, 999, wire.Cause.FINISHED)
    assert [event.item for event in peer.all(wire.ItemReached)] == list(range(999))
    peer.ask(wire.ReleaseControl())


def test_answers_come_in_the_order_of_the_requests(connect: Connect) -> None:
    peer = connect()
    peer.ask(wire.Subscribe(groups=wire.Groups(63), rate=1000.0))
    numbers = random.Random(1).sample(range(1, 2**32), 300)
    for number in numbers:
        peer.send(wire.Stop(), number)
    peer.answer(numbers[-1])
    assert [frame.request for frame, message in peer.seen[1:] if frame.request > 1] == numbers
