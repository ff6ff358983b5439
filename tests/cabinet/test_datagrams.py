"""Datagrams in the core: what counts, what is ignored, and what happens when TCP, UDP or both are held up."""

from __future__ import annotations

import logging
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.motion.servo import JointServo
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.datagrams import Datagrams
from heptarm.wire.frames import pack
from heptarm.wire.key import datagram_tags
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run
from tests.cabinet.test_servo import finish, opened, reached, target
from tests.relay import DatagramRelay, Relay

KEY = "a key that nobody in the middle has"
PATIENCE = 30.0


@pytest.fixture(scope="module", params=["", KEY], ids=["no key", "key"])
def keyed(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[FakeCabinet, str]]:
    log = tmp_path_factory.mktemp("datagrams") / "log"
    with FakeCabinet(log=log, key=request.param) as cabinet:
        yield cabinet, request.param
        assert cabinet.is_alive()
        assert cabinet.errors() == []


def until(condition: Callable[[], object], what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"not within {PATIENCE:g} s: {what}"
        time.sleep(0.005)


class Line:
    """A controller with datagrams, by hand."""

    def __init__(
        self, cabinet: FakeCabinet, key: str, *, name: str = "controller", host: str = "127.0.0.1"
    ) -> None:
        self.port = cabinet.port
        self.peer = Peer(cabinet.port, key=key, name=name)
        self.codec = self.peer.open_datagrams()
        self.socket = self.bound(host)

    @staticmethod
    def bound(host: str) -> socket.socket:
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        sock.bind((host, 0))
        sock.settimeout(0.05)
        return sock

    def pack(self, message: wire.Message, *, request: int = 0, age: float = 0.0) -> bytes:
        return self.codec.pack(message, time=time.monotonic_ns() - round(age * 1e9), request=request)

    def throw(self, data: bytes, *, by: socket.socket | None = None) -> None:
        (by or self.socket).sendto(data, ("127.0.0.1", self.port))

    def send(self, message: wire.Message, *, request: int = 0, age: float = 0.0) -> bytes:
        data = self.pack(message, request=request, age=age)
        self.throw(data)
        return data

    def counts(self) -> wire.DatagramStatistics:
        answer = self.peer.ask(wire.GetDatagramStatistics())
        assert isinstance(answer, wire.DatagramStatistics)
        return answer

    def counted(self, **least: int) -> None:
        """Waits until the cabinet has counted at least so many."""
        until(
            lambda: all(getattr(self.counts(), name) >= number for name, number in least.items()), str(least)
        )

    def follow(self, servo: int, a7: float, number: int, *, age: float = 0.0) -> bytes:
        return self.send(target(servo, a7), request=number, age=age)

    def __enter__(self) -> Line:
        self.peer.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self.socket.close()
        self.peer.__exit__(None, None, None)


# ------------------------------------------------------------------------------------ what counts


def test_targets_are_followed_the_newest_wins_by_whatever_path(keyed: tuple[FakeCabinet, str]) -> None:
    with Line(*keyed) as line:
        line.peer.take_control()
        servo = opened(line.peer)
        line.follow(servo, 0.1, 1)
        reached(line.peer, 0.1)
        line.follow(servo, 0.3, 3)
        reached(line.peer, 0.3)
        line.peer.send(target(servo, 0.2), 2)  # a copy over TCP that was held up
        line.peer.send(target(servo, 0.3), 3)
        line.follow(servo, 0.25, 3)
        line.counted(accepted=3)
        line.peer.send(target(servo, 0.4), 4)
        reached(line.peer, 0.4)
        line.peer.ask(wire.ServoClose(servo=servo))
        assert finish(line.peer, servo).q[6] == 0.4
        seen = [one for one in line.peer.all(wire.ServoStatus) if one.servo == servo][-1]
        assert (seen.targets, seen.refused, seen.late) == (3, 0, 0)


def test_replayed_forged_late_and_strange_ones_are_ignored_and_counted(
    keyed: tuple[FakeCabinet, str],
) -> None:
    with Line(*keyed) as line, ExitStack() as stack:
        line.peer.take_control()
        servo = opened(line.peer)
        first = line.follow(servo, 0.1, 1)
        line.follow(servo, 0.2, 2)
        reached(line.peer, 0.2)
        before, since = line.counts(), len(line.peer.seen)
        for _ in range(3):
            line.throw(first)  # replayed
        line.counted(old=before.old + 3)
        line.follow(servo, 0.5, 50, age=11.0)  # older than the watchdog time of this controller
        line.counted(late=before.late + 1)
        good = line.pack(target(servo, 0.6), request=60)
        line.throw(good[:-1] + bytes([good[-1] ^ 1]))
        guess = Datagrams(line.peer.welcome.session, "client", *datagram_tags(None, os.urandom(32)))
        line.throw(guess.pack(target(servo, 0.6), time=time.monotonic_ns(), request=60))
        line.counted(forged=before.forged + 2)
        bare = pack(wire.ServoJoints.TYPE, target(servo, 0.6).encode(), seq=9, time=time.monotonic_ns())
        line.throw(bytes(4) + bare)  # of no session
        line.throw(line.pack(target(servo, 0.6), request=60)[:40])
        elsewhere = stack.enter_context(Line.bound("127.0.0.2"))
        line.throw(
            line.pack(target(servo, 0.6), request=60), by=elsewhere
        )  # of this session, from another address
        line.counted(strange=before.strange + 2, damaged=before.damaged + 1)
        line.follow(servo, 0.3, 3)
        reached(line.peer, 0.3)
        states = [one for _, one in line.peer.seen[since:] if isinstance(one, wire.State)]
        assert not [one for one in states if one.joints is not None and one.joints.q[6] > 0.31]
        line.peer.ask(wire.ServoClose(servo=servo))
        finish(line.peer, servo)


def test_garbage_harms_nobody_and_gets_no_answer(keyed: tuple[FakeCabinet, str]) -> None:
    with Line(*keyed) as line:
        session = line.peer.welcome.session.to_bytes(4, "big")
        with Line.bound("127.0.0.1") as stranger:
            for size in range(300):
                line.throw(os.urandom(size), by=stranger)
                line.throw(session + os.urandom(size * 5), by=stranger)
            line.counted(strange=1)
            with pytest.raises(TimeoutError):
                stranger.recv(2048)
        line.send(wire.Ping(sent=1))
        line.counted(accepted=1)


def test_without_control_a_target_by_datagram_does_nothing(keyed: tuple[FakeCabinet, str]) -> None:
    with Line(*keyed) as line, Line(*keyed, name="observer") as observer:
        line.peer.take_control()
        servo = opened(line.peer)
        line.follow(servo, 0.1, 1)
        reached(line.peer, 0.1)
        observer.follow(servo, 0.9, 9)
        observer.send(wire.Cancel(id=servo), request=99)
        observer.counted(accepted=2)
        line.follow(servo, 0.2, 2)
        reached(line.peer, 0.2)
        line.peer.ask(wire.ServoClose(servo=servo))
        assert finish(line.peer, servo).cause is wire.Cause.CANCELLED


def test_a_second_token_makes_the_first_worthless(keyed: tuple[FakeCabinet, str]) -> None:
    with Line(*keyed) as line:
        old = line.pack(wire.Ping(sent=1))
        line.codec = line.peer.open_datagrams()
        line.throw(old)
        line.counted(forged=1)
        line.send(wire.Ping(sent=1))
        line.counted(accepted=1)


def test_pings_are_answered_and_states_come_by_datagram_once_the_client_answers_too(
    keyed: tuple[FakeCabinet, str],
) -> None:
    with Line(*keyed) as line:
        line.peer.ask(wire.Subscribe(groups=wire.Groups.JOINTS, rate=50.0))
        line.peer.wait_for(wire.State)  # over TCP: nothing shows that datagrams reach this client
        kinds: set[type] = set()
        deadline = time.monotonic() + PATIENCE
        line.send(wire.Ping(sent=5))
        while not {wire.Ping, wire.Pong, wire.State} <= kinds and time.monotonic() < deadline:
            try:
                data = line.socket.recv(2048)
            except TimeoutError:
                continue
            frame = line.codec.receive(data, now=time.monotonic_ns(), limit=10**9)
            assert frame is not None
            kinds.add(wire.MESSAGES[frame.type])
            if frame.type == wire.Ping.TYPE:
                line.send(wire.Pong(sent=wire.Ping.decode(frame.body).sent, received=time.monotonic_ns()))
        assert {wire.Ping, wire.Pong, wire.State} <= kinds


def test_a_stop_by_datagram_stops_once_and_a_late_copy_stops_nothing(keyed: tuple[FakeCabinet, str]) -> None:
    with Line(*keyed) as line:
        line.peer.take_control()
        first = line.peer.ask(run(ptp(2.0)))
        line.peer.wait_for(wire.MotionStarted, lambda event: event.id == first.id)
        request = line.peer._request + 1
        line.send(wire.Stop(), request=request)
        ended = line.peer.wait_for(wire.MotionFinished, lambda event: event.id == first.id)
        assert ended.cause is wire.Cause.STOPPED  # before the same request came over TCP
        assert isinstance(line.peer.ask(wire.Stop()), wire.Accepted)
        assert line.peer._request == request
        second = line.peer.ask(run(ptp(0.5)))
        line.peer.wait_for(wire.MotionStarted, lambda event: event.id == second.id)
        line.send(wire.Stop(), request=request)  # a copy that was under way for longer
        line.counted(accepted=2)
        ended = line.peer.wait_for(wire.MotionFinished, lambda event: event.id == second.id)
        assert ended.cause is wire.Cause.FINISHED


def test_datagrams_are_a_sign_of_life_and_their_silence_is_none(keyed: tuple[FakeCabinet, str]) -> None:
    with Line(*keyed) as line, Peer(keyed[0].port, key=keyed[1], name="watcher") as watcher:
        line.peer.take_control(watchdog=1.0)
        until_when = time.monotonic() + 2.5
        while time.monotonic() < until_when:  # TCP is silent for more than the watchdog time
            line.send(wire.Ping(sent=1))
            time.sleep(0.02)
        assert isinstance(line.peer.ask(wire.SetOverride(value=1.0)), wire.Accepted)
        old = [line.pack(wire.Ping(sent=1)) for _ in range(400)]
        for data in old:  # held back, and released one by one: each counts from the time at which it was made
            line.throw(data)
            time.sleep(0.005)
        lost = watcher.wait_for(wire.ControlChanged, lambda event: "silent" in event.text)
        assert lost.controller == ""


def test_a_cabinet_without_a_udp_port_serves_over_tcp(
    make: Callable[..., FakeCabinet], caplog: pytest.LogCaptureFixture
) -> None:
    cabinet = make(datagrams=False)
    with Peer(cabinet.port) as peer:
        assert peer.ask(wire.OpenDatagrams()).code == Code.UNSUPPORTED
    with (
        caplog.at_level(logging.WARNING, "heptarm.arm"),
        ha.connect(f"127.0.0.1:{cabinet.port}", datagrams=True, timeout=PATIENCE) as arm,
    ):
        assert arm.connection.datagrams is None
        assert arm.move(ha.ptp([0.1, 0, 0, 0, 0, 0, 0])).arrived
    assert "heptarm.datagrams" in caplog.text


def test_the_thread_and_the_port_end_with_the_server(tmp_path: Path) -> None:
    with FakeCabinet(log=tmp_path / "log") as cabinet:
        with Line(cabinet, "") as line:
            line.send(wire.Ping(sent=1))
            line.counted(accepted=1)
        assert "ha-datagrams" in cabinet.threads()
        assert cabinet.close() == []


# -------------------------------------------------------------------------- a line that is held up


class Held:
    """Frames of TCP that wait, as behind a lost packet, while `is_held`."""

    def __init__(self, relay: Relay) -> None:
        self._free = threading.Event()
        self._free.set()
        for direction in ("up", "down"):
            relay.attack(direction, self._pass)

    def _pass(self, frames: list[bytes]) -> bytes:
        frame = frames[-1]
        self._free.wait(PATIENCE)
        return frame

    def __enter__(self) -> Held:
        self._free.clear()
        return self

    def __exit__(self, *error: object) -> None:
        self._free.set()


def moving(servo: JointServo, seconds: float, *, a7: float = 0.1) -> bool:
    """Sends targets for a while; whether the arm still follows."""
    until_when = time.monotonic() + seconds
    while time.monotonic() < until_when and servo.tick() is not None:
        servo.set(servo.start.q + [0, 0, 0, 0, 0, 0, a7 * np.sin(servo.t)])
    return bool(servo.active)


@pytest.fixture
def arm(keyed: tuple[FakeCabinet, str]) -> Iterator[tuple[ha.Arm, Relay, DatagramRelay, Peer]]:
    cabinet, key = keyed
    with (
        Relay(cabinet.port) as relay,
        DatagramRelay(relay) as datagrams,
        Peer(cabinet.port, key=key, name="watcher") as peer,
    ):
        address = f"127.0.0.1:{relay.port}"
        arm = ha.connect(
            address, key=key, datagrams=True, timeout=PATIENCE, watchdog=1.0, groups=("joints", "motion")
        )
        try:
            until(lambda: arm.connection.datagrams.gets_through, "datagrams get through")
            yield arm, relay, datagrams, peer
        finally:
            arm.close()


Parts = tuple[ha.Arm, Relay, DatagramRelay, Peer]


def test_tcp_that_is_held_up_for_longer_than_every_watchdog_ends_nothing(arm: Parts) -> None:
    one, relay, _, watcher = arm
    held = Held(relay)
    with one.servo(rate=100, watchdog=1.0) as servo:
        assert moving(servo, 0.3)
        with held:
            assert moving(servo, 2.5)
            assert one.state.age < 1.0  # states come by datagram
        assert moving(servo, 0.3)
    assert one.in_control and one.connection.datagrams.states > 100
    assert not [event for event in watcher.all(wire.ControlChanged) if "lost" in event.text]


def test_udp_that_is_cut_is_replaced_by_tcp_at_once_and_used_again_later(arm: Parts) -> None:
    one, _, datagrams, _ = arm
    with one.servo(rate=100, watchdog=1.0) as servo:
        assert moving(servo, 0.3)
        for direction in ("up", "down"):
            datagrams.attack(direction, lambda _: [])
        assert moving(servo, 2.5)
        assert one.state.age < 1.0
        report = one.connection.datagrams
        assert report is not None and not report.gets_through
        assert report.targets_over_tcp > 0.5 * report.targets  # a busy machine sends fewer of them
        for direction in ("up", "down"):
            datagrams.attack(direction, None)  # type: ignore[arg-type]
        until(lambda: moving(servo, 0.05) and one.connection.datagrams.gets_through, "datagrams again")


def test_when_nothing_gets_through_the_arm_stops(arm: Parts) -> None:
    one, relay, datagrams, watcher = arm
    held = Held(relay)
    with pytest.raises(ha.HeptarmError), one.servo(rate=100, watchdog=0.5) as servo:
        assert moving(servo, 0.3)
        number = servo._number
        for direction in ("up", "down"):
            datagrams.attack(direction, lambda _: [])
        with held:
            ended = watcher.wait_for(wire.MotionFinished, lambda event: event.id == number)
            assert ended.cause in (wire.Cause.STARVED, wire.Cause.LOST)
            watcher.wait_for(
                wire.ControlChanged, lambda event: event.controller == "" and "lost" in event.text
            )
        moving(servo, 5.0)


def test_a_stop_does_not_wait_for_tcp(arm: Parts) -> None:
    one, relay, datagrams, watcher = arm
    held = Held(relay)
    one.set_override(0.05)
    motion = one.start(ha.ptp([-2.5 if one.state.q[0] > 0 else 2.5, 0, 0, 0, 0, 0, 0]))
    watcher.wait_for(wire.MotionStarted, lambda event: event.id == motion.id)
    drops = iter([True, True, True])
    datagrams.attack("up", lambda seen: [] if _is_stop(seen[-1]) and next(drops, False) else seen[-1:])
    with held:
        stopping = threading.Thread(target=one.stop)
        stopping.start()
        ended = watcher.wait_for(wire.MotionFinished, lambda event: event.id == motion.id)
        assert ended.cause is wire.Cause.STOPPED
        assert stopping.is_alive()  # its answer comes over TCP
    stopping.join(PATIENCE)
    assert not stopping.is_alive()
    one.set_override(1.0)


def _is_stop(data: bytes) -> bool:
    return int.from_bytes(data[8:10], "big") == wire.Stop.TYPE


def test_loss_reordering_and_repetition_end_nothing(arm: Parts) -> None:
    """One datagram in five is lost; others are repeated or overtaken; TCP is held up now and then."""
    one, relay, datagrams, _ = arm
    held = Held(relay)
    random = np.random.default_rng(1)

    def spoil(seen: list[bytes]) -> list[bytes]:
        last, before = seen[-1], seen[-2] if len(seen) > 1 else seen[-1]
        return [[last], [last], [last], [], [last, before, last]][int(random.integers(5))]

    for direction in ("up", "down"):
        datagrams.attack(direction, spoil)
    with one.servo(rate=200, watchdog=1.0) as servo:
        for _ in range(4):
            assert moving(servo, 0.3)
            with held:
                assert moving(servo, 0.7)
    counts = one.connection.link.datagram_counts(timeout=PATIENCE)
    assert counts.old > 0 and counts.forged == counts.damaged == 0
    assert one.connection.datagrams.ignored > 0


def test_datagrams_that_are_changed_in_transit_change_nothing(arm: Parts) -> None:
    one, _, datagrams, _ = arm
    with one.servo(rate=100, watchdog=1.0) as servo:
        for direction in ("up", "down"):
            datagrams.attack(direction, lambda seen: [seen[-1][:-30] + os.urandom(30)])
        assert moving(servo, 1.5)  # over TCP
    counts = one.connection.link.datagram_counts(timeout=PATIENCE)
    assert counts.forged > 20
    assert one.connection.datagrams.ignored > 0
