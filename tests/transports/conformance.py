"""Requirements of every transport: one suite, run on each of them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.errors import ConnectionLost
from heptarm.io.transport import Transport

Pair = tuple[Transport, Transport]


def receive(transport: Transport, size: int, *, chunk: int = 65536, seconds: float = 30.0) -> bytes:
    """Receive that many bytes."""
    buffer, got = memoryview(bytearray(chunk)), b""
    deadline = time.monotonic() + seconds
    while len(got) < size and time.monotonic() < deadline:
        count = transport.receive_into(buffer)
        got += bytes(buffer[:count])
    return got


class Conformance:
    """Subclasses define how to create a connected pair."""

    MUCH = 8192  # times 256 bytes

    def make(self) -> Pair:
        raise AssertionError("make() is the subclass's")

    @pytest.fixture
    def pair(self) -> Iterator[Pair]:
        ours, theirs = self.make()
        yield ours, theirs
        ours.close()
        theirs.close()

    def test_bytes_go_both_directions(self, pair: Pair) -> None:
        ours, theirs = pair
        ours.send(b"up")
        theirs.send(b"down")
        assert receive(theirs, 2) == b"up" and receive(ours, 4) == b"down"

    @given(parts=st.lists(st.binary(max_size=300), max_size=20), chunk=st.integers(1, 400))
    @settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.differing_executors])
    def test_any_split_and_merge_keeps_the_bytes(self, parts: list[bytes], chunk: int) -> None:
        ours, theirs = self.make()
        try:
            whole = b"".join(parts)
            for part in parts:
                ours.send(part)
            assert receive(theirs, len(whole), chunk=chunk) == whole
        finally:
            ours.close()
            theirs.close()

    def test_much_arrives_whole(self, pair: Pair) -> None:
        ours, theirs = pair
        data = bytes(range(256)) * self.MUCH
        thread = threading.Thread(target=ours.send, args=(data,))
        thread.start()
        assert receive(theirs, len(data)) == data
        thread.join()

    def test_nothing_within_the_patience(self, pair: Pair) -> None:
        ours, _ = pair
        ours.set_patience(0.05)
        began = time.monotonic()
        assert ours.receive_into(memoryview(bytearray(8))) == 0
        assert time.monotonic() - began > 0.03

    def test_without_waiting(self, pair: Pair) -> None:
        ours, theirs = pair
        ours.set_patience(30.0)
        began = time.monotonic()
        assert ours.receive_into(memoryview(bytearray(8)), wait=False) == 0
        assert time.monotonic() - began < 20.0
        theirs.send(b"x")
        assert ours.wait_readable(20.0)
        assert ours.receive_into(memoryview(bytearray(8)), wait=False) == 1

    def test_readable_takes_nothing(self, pair: Pair) -> None:
        ours, theirs = pair
        assert not ours.wait_readable(0.01)
        theirs.send(b"x")
        assert ours.wait_readable(20.0) and ours.wait_readable(0.0)
        assert receive(ours, 1) == b"x"
        assert not ours.wait_readable(0.0)

    def test_what_was_sent_before_the_end_arrives(self, pair: Pair) -> None:
        ours, theirs = pair
        theirs.send(b"last words")
        theirs.close()
        assert receive(ours, 10) == b"last words"
        with pytest.raises(ConnectionLost, match="lost"):
            ours.receive_into(memoryview(bytearray(8)))

    def test_the_end_is_readable(self, pair: Pair) -> None:
        ours, theirs = pair
        theirs.close()
        assert ours.wait_readable(20.0)

    def test_sending_to_nobody(self, pair: Pair) -> None:
        ours, theirs = pair
        theirs.close()
        with pytest.raises(ConnectionLost):
            for _ in range(50):
                ours.send(b"x" * 1000)
                time.sleep(0.002)

    def test_closing_wakes_who_waits(self, pair: Pair) -> None:
        for wait in (self._receiver, self._poller):
            ours, theirs = self.make()
            ended = threading.Event()
            thread = threading.Thread(target=wait, args=(ours, ended))
            thread.start()
            time.sleep(0.05)
            ours.close()
            assert ended.wait(20.0)
            thread.join()
            theirs.close()

    @staticmethod
    def _receiver(transport: Transport, ended: threading.Event) -> None:
        transport.set_patience(5.0)
        try:
            transport.receive_into(memoryview(bytearray(8)))
        except ConnectionLost:
            ended.set()

    @staticmethod
    def _poller(transport: Transport, ended: threading.Event) -> None:
        if transport.wait_readable(5.0):
            ended.set()

    def test_a_closed_end_reports_it(self, pair: Pair) -> None:
        ours, _ = pair
        ours.close()
        ours.close()
        actions: list[Callable[[], object]] = [
            lambda: ours.send(b"x"),
            lambda: ours.receive_into(memoryview(bytearray(8))),
        ]
        for action in actions:
            with pytest.raises(ConnectionLost, match="closed"):
                action()

    def test_the_peer_has_a_name(self, pair: Pair) -> None:
        assert all(isinstance(end.peer, str) and end.peer for end in pair)
