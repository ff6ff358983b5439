"""Signals, user keys, messages and process data in the core: all or none is written, secrets are kept."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.conftest import Maker
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer


@pytest.fixture
def peer(cabinet: FakeCabinet) -> Iterator[Peer]:
    with Peer(cabinet.port) as peer:
        peer.take_control()
        yield peer


def target(**values: float) -> wire.SetSignals:
    pairs = ((name.replace("_", "."), value) for name, value in values.items())
    return wire.SetSignals(values=tuple(wire.SetSignal(signal=n, value=v) for n, v in pairs))


def seen(peer: Peer) -> dict[str, float]:
    """Values in a state that is pushed from now on."""
    peer.ask(wire.Subscribe(groups=wire.Groups.IO, rate=50.0))
    signals = peer.signals()
    peer.ask(wire.Subscribe(groups=wire.Groups.IO, rate=0.0))
    return signals


def test_signals_are_reported_written_and_pushed(peer: Peer) -> None:
    lamp, count = peer.welcome.signals[1], peer.welcome.signals[2]
    assert (lamp.name, lamp.direction, lamp.type) == (
        "Flange.Lamp",
        wire.IoDirection.OUTPUT,
        wire.IoType.BOOLEAN,
    )
    assert (count.low, count.high) == (0, 255) and peer.welcome.groups & wire.Groups.IO
    assert isinstance(peer.ask(target(Flange_Lamp=1.0, Cell_Count=200.0, Cell_Level=-2.5)), wire.Accepted)
    known = {"Flange.Button": 0.0, "Flange.Lamp": 1.0, "Cell.Count": 200.0, "Cell.Level": -2.5}
    assert seen(peer) == {**known, "Cell.Offset": 0.0}


@pytest.mark.parametrize(
    ("values", "code", "parameter"),
    [
        ({"Flange_Lamp": 0.0, "Flange_Button": 1.0}, Code.UNSUPPORTED, "values[1].signal"),
        ({"Flange_Lamp": 0.0, "Flange_Knob": 1.0}, Code.UNKNOWN_NAME, "values[1].signal"),
        ({"Flange_Lamp": 0.0, "Cell_Count": 256.0}, Code.OUT_OF_RANGE, "values[1].value"),
        ({"Flange_Lamp": 0.0, "Cell_Count": 1.5}, Code.OUT_OF_RANGE, "values[1].value"),
        ({"Cell_Count": 1.0, "Flange_Lamp": 0.5}, Code.OUT_OF_RANGE, "values[1].value"),
        ({"Cell_Count": 1.0, "Cell_Level": -11.0}, Code.OUT_OF_RANGE, "values[1].value"),
        ({"Cell_Level": float("nan")}, Code.NOT_FINITE, "values[0].value"),
        ({}, Code.BAD_LENGTH, "values"),
    ],
)
def test_all_are_written_or_none(peer: Peer, values: dict[str, float], code: Code, parameter: str) -> None:
    peer.ask(target(Flange_Lamp=1.0, Cell_Count=7.0, Cell_Level=0.0))
    answer = peer.ask(target(**values))
    assert isinstance(answer, wire.Rejected)
    assert (answer.code, answer.parameter) == (code, parameter)
    now = seen(peer)
    assert (now["Flange.Lamp"], now["Cell.Count"], now["Cell.Level"]) == (1.0, 7.0, 0.0)


def test_a_slow_cabinet_reads_them_a_few_at_a_time(make: Maker) -> None:
    with Peer(make(getter=0.005).port) as peer:
        peer.ask(wire.Subscribe(groups=wire.Groups.IO | wire.Groups.JOINTS, rate=100.0))
        peer.read_for(1.0)
        states = peer.all(wire.State)
        fresh = {state.joints.stamp for state in states if state.joints is not None}
        assert len(fresh) > 10, "signals do not keep the joints from being read"
        assert all(state.io is not None and len(state.io.values) == 5 for state in states)


def next_signals(peer: Peer) -> wire.IoState:
    state = peer.wait(lambda _, one: isinstance(one, wire.State) and one.io is not None, since=len(peer.seen))
    assert isinstance(state, wire.State) and state.io is not None
    return state.io


def test_the_stamp_of_signals_is_that_of_the_oldest(make: Maker) -> None:
    with Peer(make(getter=0.005).port) as peer:
        peer.take_control()
        peer.ask(wire.Subscribe(groups=wire.Groups.IO, rate=5.0))
        for count in range(1, 10):
            for _ in range(count % 3):  # written anywhere in a round of three readings
                next_signals(peer)
            peer.ask(target(Cell_Count=float(count), Cell_Level=0.1 * count))
            now = peer.signals()
            assert (now["Cell.Count"], now["Cell.Level"]) == (count, 0.1 * count)


def test_a_new_subscriber_sees_no_value_from_before(make: Maker) -> None:
    with Peer(make(getter=0.005).port) as peer:
        peer.take_control()
        for count in range(1, 4):
            peer.ask(target(Cell_Count=float(count), Cell_Level=0.1 * count))
            written = peer.seen[-1][0].time
            peer.ask(wire.Subscribe(groups=wire.Groups.IO, rate=5.0))
            assert next_signals(peer).stamp > written
            for _ in range(count):
                next_signals(peer)
            peer.ask(wire.Subscribe(groups=wire.Groups(0), rate=0.0))
            peer.read_for(0.5)


def test_only_the_controller_writes(cabinet: FakeCabinet, peer: Peer) -> None:
    with Peer(cabinet.port) as other:
        for message in (
            target(Flange_Lamp=1.0),
            wire.SetKey(slot=0, text="x", led=wire.KeyLed.RED),
            wire.SetProcessData(name="speed", value="1"),
            wire.ShowMessage(severity=wire.Severity.INFO, text="hello"),
        ):
            answer = other.ask(message)
            assert isinstance(answer, wire.Rejected) and answer.code == Code.NOT_IN_CONTROL
        assert other.ask(wire.GetProcessData(name="speed")).value


def test_keys_have_texts_and_lamps(peer: Peer) -> None:
    assert isinstance(peer.ask(wire.SetKey(slot=1, text="go on", led=wire.KeyLed.GREEN)), wire.Accepted)
    assert peer.ask(wire.GetProcessData(name="keyed")).value == "1 go on GREEN true"
    for message, code in (
        (wire.SetKey(slot=4, text="", led=wire.KeyLed.GREY), Code.OUT_OF_RANGE),
        (wire.SetKey(slot=0, text="x" * 65, led=wire.KeyLed.GREY), Code.BAD_LENGTH),
        (wire.SetKey(slot=3, text="", led=wire.KeyLed.GREY), Code.UNSUPPORTED),
    ):
        answer = peer.ask(message)
        assert isinstance(answer, wire.Rejected) and answer.code == code


def test_process_data_are_read_and_written(peer: Peer) -> None:
    assert isinstance(peer.ask(wire.SetProcessData(name="speed", value="0.75")), wire.Accepted)
    answer = peer.ask(wire.GetProcessData(name="speed"))
    assert isinstance(answer, wire.ProcessData) and answer.value == "0.75"
    wrong: list[tuple[Any, Code]] = [
        (wire.SetProcessData(name="speed", value="fast"), Code.OUT_OF_RANGE),
        (wire.SetProcessData(name="colour", value="red"), Code.UNKNOWN_NAME),
        (wire.SetProcessData(name="heptarm.port", value="30002"), Code.UNSUPPORTED),
        (wire.GetProcessData(name="colour"), Code.UNKNOWN_NAME),
        (wire.GetProcessData(name="heptarm.key"), Code.UNSUPPORTED),
        (wire.GetProcessData(name=""), Code.BAD_LENGTH),
    ]
    for message, code in wrong:
        answer = peer.ask(message)
        assert isinstance(answer, wire.Rejected) and answer.code == code, message


def test_dialogs_are_shown_one_at_a_time(peer: Peer) -> None:
    def ask(text: str, *buttons: str) -> wire.AskOperator:
        return wire.AskOperator(kind=wire.DialogKind.QUESTION, text=text, buttons=buttons)

    def closed(number: int) -> wire.DialogClosed:
        return peer.wait_for(wire.DialogClosed, lambda event: event.dialog == number)

    first = peer.ask(ask("clamped?", "Yes", "No"))
    assert (closed(first.id).button, closed(first.id).text) == (1, "")
    broken = peer.ask(ask("broken", "Ok"))
    assert closed(broken.id).button == -1 and "unplugged" in closed(broken.id).text
    stays = peer.ask(ask("stay", "Ok"))
    busy = peer.ask(ask("next", "Ok"))
    assert (busy.code, stays.id) == (
        Code.BUSY,
        broken.id + 1,
    ) and '"stay"; press one of its buttons' in busy.text
    assert isinstance(peer.ask(wire.SetOverride(value=1.0)), wire.Accepted)  # everything else goes on
    for wrong in (("",), ("x" * 65,), ("Yes", "Yes")):
        refused = peer.ask(ask("labels", *wrong))
        assert refused.code in (Code.BAD_LENGTH, Code.OUT_OF_RANGE)
        assert refused.parameter == f"buttons[{len(wrong) - 1}]"
    peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="answer"))
    assert closed(stays.id).button == 0
