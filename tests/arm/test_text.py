"""Names and texts of others cannot control a terminal or forge lines of a log."""

from __future__ import annotations

import logging

import pytest

import heptarm as ha
from heptarm.arm.arm import Arm
from heptarm.arm.link.connection import Connection, Options
from heptarm.io import tcp
from heptarm.io.clock import RealClock
from heptarm.values.text import printable
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer
from tests.conftest import RunningCabinet

EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31mroot\r\nfake: line\u202egnp.exe\u2028\x00"


def is_harmless(text: str) -> bool:
    return text.isprintable() and "\x1b" not in text and "root" in text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Zoë 李 🤖", "Zoë 李 🤖"),
        ("a\x1b[31mb", "a[31mb"),
        ("a\nb\tc\r\nd", "a b c d"),
        ("\u202eabc\u2066\u200b", "abc"),
        ("\ud800x", "x"),
    ],
)
def test_what_cannot_be_printed_is_removed(text: str, shown: str) -> None:
    assert printable(text) == shown


def test_a_message_may_have_lines() -> None:
    assert printable("one\ntwo\x1b[1m", lines=True) == "one\ntwo[1m"


def test_the_cabinet_strips_the_names_of_its_clients(
    cabinet: RunningCabinet, monkeypatch: pytest.MonkeyPatch
) -> None:
    # what this side removes when it receives a text must not hide what the cabinet lets through
    monkeypatch.setattr("heptarm.arm.link.link.printable_message", lambda message: message)
    options = Options(name=EVIL, timeout=30.0, watchdog=5.0)
    intruder = Arm(
        Connection(lambda: tcp.connect(cabinet.host, cabinet.port, timeout=30.0), options, clock=RealClock())
    )
    try:
        intruder.open(control=True)
        with ha.connect(cabinet.target, control=False, timeout=30.0) as observer:
            assert is_harmless(observer.controller), ascii(observer.controller)
            with pytest.raises(ha.NotInControl) as refused:
                observer.take_control()
            assert is_harmless(refused.value.text), ascii(refused.value.text)
    finally:
        intruder.close()


def test_texts_of_a_cabinet_are_stripped_here(caplog: pytest.LogCaptureFixture) -> None:
    peer = Peer()
    peer.expect(wire.TakeControl, wire.Rejected(code=Code.CONTROL_TAKEN, text=f"{EVIL} controls", value=EVIL))
    with caplog.at_level(logging.INFO, logger="heptarm.arm"), peer.arm(control=False) as arm:
        with pytest.raises(ha.NotInControl) as refused:
            arm.take_control()
        assert "\x1b" not in str(refused.value) and is_harmless(str(refused.value.value))
        peer.tell(wire.Notice(severity=wire.Severity.WARNING, code=0, text=EVIL))
        peer.tell(wire.ControlChanged(controller=EVIL, session=9, text=EVIL))
        arm.wait_until(lambda _: arm.controller != "", timeout=30.0)
        assert is_harmless(arm.controller)
    peer.close()
    noticed = [record.getMessage() for record in caplog.records if "cabinet:" in record.getMessage()]
    assert noticed and not any(set("\x1b\x07\x9b\u202e\x00") & set(text) for text in noticed)


def test_a_client_cannot_choose_such_a_name() -> None:
    with pytest.raises(ha.ShapeError, match="printable") as refused:
        ha.connect("127.0.0.1:9", name=EVIL)
    assert "\x1b" not in str(refused.value)
