"""Ctrl-C is deferred while the shield is active, and only then."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator

import pytest

from heptarm.arm.link.pending import InterruptShield
from tests.interrupts import ctrl_c_interrupts


@pytest.fixture(autouse=True)
def handler() -> Iterator[None]:
    with ctrl_c_interrupts():
        yield


def test_it_is_held_back_and_comes_through() -> None:
    shield = InterruptShield()
    signal.raise_signal(signal.SIGINT)
    assert shield.pending
    with pytest.raises(KeyboardInterrupt):
        shield.release()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    shield.release()


def test_nothing_comes_of_nothing() -> None:
    shield = InterruptShield()
    shield.release()
    assert not shield.pending
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_shields_may_be_nested() -> None:
    outer = InterruptShield()
    inner = InterruptShield()
    signal.raise_signal(signal.SIGINT)
    inner.release()
    assert outer.pending
    with pytest.raises(KeyboardInterrupt):
        outer.release()


def test_the_programs_own_handler_receives_it() -> None:
    heard: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    shield = InterruptShield()
    signal.raise_signal(signal.SIGINT)
    assert not heard
    shield.release()
    assert heard == [signal.SIGINT]


def test_an_ignored_signal_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    shield = InterruptShield()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    shield.release()


def test_other_threads_are_left_alone() -> None:
    seen: list[object] = []

    def work() -> None:
        shield = InterruptShield()
        seen.append(signal.getsignal(signal.SIGINT))
        shield.release()

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]
