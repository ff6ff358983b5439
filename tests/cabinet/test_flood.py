"""Nobody is shut out: connections without a session are few and brief; who has to act always has a place."""

from __future__ import annotations

import os
import socket
import struct
import time
from collections.abc import Callable
from contextlib import ExitStack

import pytest

from bench.trust.flood import Flood
from heptarm.arm.link.halt import halt
from heptarm.errors import ConnectFailed
from heptarm.io import tcp
from heptarm.io.clock import RealClock
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.frames import pack
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Busy, Closed, Peer, ptp, run

Make = Callable[..., FakeCabinet]
pytestmark = pytest.mark.alone


def stop(cabinet: FakeCabinet) -> None:
    halt(
        lambda: tcp.connect("127.0.0.1", cabinet.port, timeout=30.0),
        wire.StopKind.PATH,
        clock=RealClock(),
        timeout=30.0,
    )


@pytest.mark.parametrize("key", ["", "a key that the one who stops does not know"])
def test_anyone_stops_the_arm_without_a_session(make: Make, key: str) -> None:
    cabinet = make(key=key)
    with Peer(cabinet.port, key=key) as controller:
        controller.take_control()
        motion = controller.ask(run(ptp(2.0)))
        controller.wait_for(wire.MotionStarted, lambda event: event.id == motion.id)
        stop(cabinet)
        ended = controller.wait_for(wire.MotionFinished, lambda event: event.id == motion.id)
        assert ended.cause == wire.Cause.STOPPED
        assert isinstance(
            controller.ask(wire.SetOverride(value=0.5)), wire.Accepted
        )  # it is still in control
    assert cabinet.errors() == []


def test_a_stop_of_another_version_is_executed(make: Make) -> None:
    cabinet = make()
    frame = bytearray(pack(wire.Halt.TYPE, wire.Halt().encode(), seq=0))
    frame[2] = 9
    with Peer(cabinet.port, hello=False) as peer:
        peer.socket.sendall(frame)
        assert isinstance(peer.next(), wire.Halted)
        assert peer.is_closed()


def test_the_allow_list_holds_for_a_stop_too(make: Make) -> None:
    with pytest.raises(ConnectFailed, match="allow-list") as error:
        stop(make(allow="10.0.0.1"))
    assert error.value.code == Code.NOT_ALLOWED


def test_connections_that_are_reset_at_once_hold_nobody_up(make: Make) -> None:
    """A port scan from a host that is not on the allow-list delays no one, and leaves no open sockets."""
    cabinet = make(allow="10.0.0.1", heartbeat=20.0)
    folder = f"/proc/{cabinet.process.pid}/fd"
    before = len(os.listdir(folder))
    began = time.monotonic()
    for _ in range(200):
        with socket.create_connection(("127.0.0.1", cabinet.port), timeout=30.0) as scan:
            scan.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    with pytest.raises(ConnectFailed, match="allow-list"):  # of the last in the row, so all were accepted
        stop(cabinet)
    assert time.monotonic() - began < 5.0
    assert "not accepted" not in cabinet.log.read_text()
    deadline = time.monotonic() + 30.0
    while len(os.listdir(folder)) > before + 10:
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert cabinet.errors() == []


def test_a_hundred_observers_and_always_a_place_to_act(make: Make) -> None:
    cabinet = make(heartbeat=20.0)
    with ExitStack() as stack:
        observers = [stack.enter_context(Peer(cabinet.port, name=f"o{number}")) for number in range(100)]
        guest = stack.enter_context(Peer(cabinet.port, name="guest"))
        controller = stack.enter_context(Peer(cabinet.port, name="controller"))
        controller.take_control()
        assert isinstance(guest.ask(wire.Stop()), wire.Accepted)
        assert guest.wait_for(wire.Goodbye).code == Code.TOO_MANY_CLIENTS
        assert guest.is_closed()
        motion = controller.ask(run(ptp(0.02)))  # its place lasts
        for peer in (controller, observers[0], observers[-1]):
            assert peer.wait_for(wire.MotionFinished, lambda event: event.id == motion.id)
        observers[0].close()
        deadline = time.monotonic() + 30.0
        while True:  # the cabinet may not have noticed yet that a place is free
            late = stack.enter_context(Peer(cabinet.port, name="late"))
            late.read_for(2.5)
            if not late.all(wire.Goodbye):
                break
            assert time.monotonic() < deadline
        assert isinstance(late.ask(wire.Stop()), wire.Accepted)
    assert cabinet.errors() == []


def test_the_oldest_guest_goes_first(make: Make) -> None:
    cabinet = make(heartbeat=20.0)
    with ExitStack() as stack:
        for number in range(100):
            stack.enter_context(Peer(cabinet.port, name=f"o{number}"))
        guests = [stack.enter_context(Peer(cabinet.port, name=f"g{number}")) for number in range(110)]
        controller = guests[-1]
        controller.take_control()
        assert guests[0].wait_for(wire.Goodbye).code == Code.TOO_MANY_CLIENTS
        for number in range(10):  # none of these displaces it
            stack.enter_context(Peer(cabinet.port, name=f"h{number}"))
        controller.read_for(2.5)
        assert isinstance(controller.ask(wire.SetOverride(value=0.5)), wire.Accepted)
    assert cabinet.errors() == []


def test_connections_leave_room_for_other_files(make: Make) -> None:
    cabinet = make(heartbeat=20.0, files=200)
    with ExitStack() as stack:
        controller = stack.enter_context(Peer(cabinet.port, name="controller"))
        controller.take_control()
        for number in range(300):  # more than the operating system allows
            stack.enter_context(Peer(cabinet.port, name=f"o{number}"))
        open_files = len(os.listdir(f"/proc/{cabinet.process.pid}/fd"))
        assert open_files < 200 - 32
        motion = controller.ask(run(ptp(0.02)))
        assert controller.wait_for(wire.MotionFinished, lambda event: event.id == motion.id)
        stop(cabinet)
    assert cabinet.errors() == []
    assert "not accepted" not in cabinet.log.read_text()


@pytest.mark.parametrize(("key", "greets"), [("", True), ("k" * 32, False)], ids=["open", "with a key"])
def test_a_flood_keeps_nobody_from_controlling_and_stopping(make: Make, key: str, greets: bool) -> None:
    cabinet = make(key=key, heartbeat=20.0)
    with Flood(cabinet.port, held=400, rate=200.0, greets=greets) as flood:
        assert flood.is_ready
        with _new_controller(cabinet, key) as controller:
            motion = controller.ask(run(ptp(2.5)))
            controller.wait_for(wire.MotionStarted, lambda event: event.id == motion.id)
            for _ in range(3):
                stop(cabinet)
            ended = controller.wait_for(wire.MotionFinished, lambda event: event.id == motion.id)
            assert ended.cause == wire.Cause.STOPPED
        with _new_controller(cabinet, key) as following:
            assert isinstance(following.ask(wire.SetOverride(value=0.5)), wire.Accepted)
    assert cabinet.errors() == []
    deadline = time.monotonic() + 30.0
    while any("reader" in name for name in cabinet.threads()):
        assert time.monotonic() < deadline, cabinet.threads()
        time.sleep(0.05)
    assert cabinet.close() == []


def _new_controller(cabinet: FakeCabinet, key: str) -> Peer:
    """A new client takes control; it may have to try again, since it waits among others."""
    deadline = time.monotonic() + 30.0
    while True:
        peer = Peer(cabinet.port, hello=False)
        try:
            peer.greet(key=key, name="next")
            peer.take_control()
            return peer
        except (AssertionError, Busy, Closed, OSError):
            peer.close()
            assert time.monotonic() < deadline
