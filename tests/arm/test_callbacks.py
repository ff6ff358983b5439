"""Callbacks run in the thread that reads the link: a call that would wait for itself is refused."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

import heptarm as ha
from heptarm.wire import messages as wire
from tests.arm.peer import Peer

HOME = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))


def _servo(arm: ha.Arm) -> None:
    with arm.servo():
        pass


BLOCKING: list[Callable[[ha.Arm, ha.MotionHandle], object]] = [
    lambda arm, _: arm.move(HOME),
    lambda _, handle: handle.wait(timeout=1.0),
    lambda _, handle: list(handle.events(timeout=1.0)),
    lambda arm, _: arm.wait_until(lambda _: False, timeout=1.0),
    lambda arm, _: arm.wait_for_rest(timeout=1.0),
    lambda arm, _: arm.recover(timeout=1.0),
    lambda arm, _: arm.pad.wait_for_key(timeout=1.0),
    lambda arm, _: list(arm.states()),
    lambda arm, _: arm.close(),
    lambda arm, _: _servo(arm),
]
NAMES = [
    "move",
    "wait",
    "events",
    "wait_until",
    "wait_for_rest",
    "recover",
    "wait_for_key",
    "states",
    "close",
    "servo",
]


@pytest.mark.parametrize("call", BLOCKING, ids=NAMES)
def test_a_blocking_call_in_a_callback_is_refused(
    peer: Peer, call: Callable[[ha.Arm, ha.MotionHandle], object]
) -> None:
    peer.runs(1)
    raised: list[BaseException] = []
    done = threading.Event()
    with peer.arm() as arm:
        handle = arm.start(HOME)

        def callback(event: ha.MotionEvent) -> None:
            try:
                call(arm, handle)
            except BaseException as error:
                raised.append(error)
            done.set()

        handle.add_event_callback(callback)
        peer.tell(wire.SegmentReached(id=1, item=0, segment=0))
        assert done.wait(20.0)
        peer.tell(peer.finished(1))
        handle.wait(timeout=20.0)
        assert arm.connected
    (error,) = raised[:1]
    assert isinstance(error, ha.LocalProtocolError)
    assert "callback" in error.text and "another thread" in error.hint


def test_what_does_not_wait_works_in_a_callback(peer: Peer) -> None:
    peer.runs(1).runs(2)
    done = threading.Event()
    started: list[ha.MotionHandle] = []
    with peer.arm() as arm:

        def callback(handle: ha.MotionHandle) -> None:
            assert handle.wait().arrived  # it has ended, so this does not wait
            started.append(arm.start(HOME))
            arm.stop()
            done.set()

        arm.start(HOME).add_done_callback(callback)
        peer.tell(peer.finished(1))
        assert done.wait(20.0)
        peer.tell(peer.finished(2))
        started[0].wait(timeout=20.0)


def test_an_error_in_a_key_callback_does_not_end_the_link(
    peer: Peer, caplog: pytest.LogCaptureFixture
) -> None:
    called = threading.Event()
    with peer.arm() as arm:

        def callback(slot: int, down: bool) -> None:
            called.set()
            arm.wait_for_rest()

        arm.pad.on_key(callback)
        peer.tell(wire.KeyPressed(slot=1, down=True))
        assert called.wait(20.0)
        time.sleep(0.05)
        assert arm.connected
    assert "key callback" in caplog.text
