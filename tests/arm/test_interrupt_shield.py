"""Ctrl-C is held back while the shield is up, and only then."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator

import pytest

from heptarm.arm.shield import Shield


@pytest.fixture(autouse=True)
def handler() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_it_is_held_back_and_comes_through() -> None:
    shield = Shield()
    signal.raise_signal(signal.SIGINT)
    assert shield.pending
    with pytest.raises(KeyboardInterrupt):
        shield.down()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    shield.down()


def test_nothing_comes_of_nothing() -> None:
    shield = Shield()
    shield.down()
    assert not shield.pending
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_shields_may_be_nested() -> None:
    outer = Shield()
    inner = Shield()
    signal.raise_signal(signal.SIGINT)
    inner.down()
    assert outer.pending
    with pytest.raises(KeyboardInterrupt):
        outer.down()


def test_the_programs_own_handler_hears_of_it() -> None:
    heard: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: heard.append(number))
    shield = Shield()
    signal.raise_signal(signal.SIGINT)
    assert not heard
    shield.down()
    assert heard == [signal.SIGINT]


def test_an_ignored_signal_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    shield = Shield()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    shield.down()


def test_other_threads_are_left_alone() -> None:
    seen: list[object] = []

    def work() -> None:
        shield = Shield()
        seen.append(signal.getsignal(signal.SIGINT))
        shield.down()

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]
