"""Triggers in the core: checked, executed by the cabinet, reported; items of a program are reported as they end."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from math import nan

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.conftest import Maker
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, run

#: Of the fake a metre is a radian.
LAMP, LEVEL = "Flange.Lamp", "Cell.Level"
START, END = wire.PathReference.START, wire.PathReference.DESTINATION
#: The fake's A7 turns against a spring of 10 Nm/rad.
PUSHED = wire.JointTorqueOutside(joint=6, low=-3.0, high=3.0)


def at(distance: float, reference: wire.PathReference = START) -> wire.PathReached:
    return wire.PathReached(reference=reference, distance=distance, delay=0.0)


def trigger(action: wire.Action, *nodes: wire.ConditionNode) -> wire.Trigger:
    return wire.Trigger(condition=wire.Condition(nodes=nodes), action=action)


def turn(a7: float, *triggers: wire.Trigger, blend: float = 0.0) -> wire.Item:
    q = (0.0,) * 6 + (a7,)
    return wire.Item(motion=wire.Ptp(q=q, blending=wire.Blending(relative=blend)), triggers=triggers)


@contextlib.contextmanager
def controlling(port: int) -> Iterator[Peer]:
    with Peer(port) as peer:
        peer.take_control()
        finish(peer, started(peer, turn(0.0)))
        yield peer
        peer.ask(wire.ReleaseControl())


@pytest.fixture
def peer(cabinet: FakeCabinet) -> Iterator[Peer]:
    with controlling(cabinet.port) as peer:
        yield peer


def started(peer: Peer, *items: wire.Item) -> int:
    answer = peer.ask(run(*items))
    assert isinstance(answer, wire.Accepted), answer
    return int(answer.id)


def finish(peer: Peer, number: int) -> wire.MotionFinished:
    return peer.wait_for(wire.MotionFinished, lambda event: event.id == number, timeout=30.0)


def received(peer: Peer, number: int) -> list[tuple[str, int]]:
    """The events of a program, in their order."""
    return [
        (type(m).__name__, m.item)
        for _, m in peer.seen
        if getattr(m, "id", None) == number and hasattr(m, "item")
    ]


def fired(peer: Peer, number: int) -> list[wire.TriggerFired]:
    return [event for event in peer.all(wire.TriggerFired) if event.id == number]


def lamp(port: int) -> tuple[float, float]:
    """The lamp and the level in the states of an observer."""
    with Peer(port) as peer:
        peer.ask(wire.Subscribe(groups=wire.Groups.IO, rate=100.0))
        signals = peer.signals()
        return signals[LAMP], signals[LEVEL]


def test_an_output_is_set_on_the_way_and_an_event_reported(cabinet: FakeCabinet, peer: Peer) -> None:
    peer.ask(wire.SetSignals(values=(wire.SetSignal(signal=LAMP, value=0.0),)))
    number = started(
        peer,
        turn(
            0.4,
            trigger(wire.Notify(label="half way"), at(0.2)),
            trigger(wire.SetSignal(signal=LEVEL, value=2.5), at(-0.1, END)),
            trigger(wire.SetSignal(signal=LAMP, value=1.0), PUSHED, at(0.05), wire.AnyOf(n=2)),
            trigger(wire.Notify(label="never"), at(0.5)),
        ),
    )
    assert finish(peer, number).cause is wire.Cause.FINISHED
    events = fired(peer, number)
    assert [(event.trigger, event.label, event.code) for event in events] == [
        (0, "half way", 0),
        (1, "", 0),
        (2, "", 0),
    ]
    assert all(event.item == 0 for event in events)
    assert [event.time for event in events] == sorted(event.time for event in events)
    half = events[0].joints
    assert half is not None and 0.2 <= half.q[6] <= 0.4
    assert lamp(cabinet.port) == (1.0, 2.5)


def test_each_item_has_its_own_and_all_is_reported_in_order(peer: Peer) -> None:
    label = wire.Notify(label="x")
    number = started(
        peer,
        turn(0.1, trigger(label, at(0.05)), blend=0.5),
        turn(0.2, trigger(label, at(0.0)), trigger(label, at(0.0, END)), blend=0.5),
        turn(0.1),
    )
    finish(peer, number)
    assert received(peer, number) == [
        ("MotionStarted", 0),
        ("TriggerFired", 0),
        ("ItemReached", 0),
        ("MotionStarted", 1),
        ("TriggerFired", 1),
        ("TriggerFired", 1),
        ("ItemReached", 1),
        ("MotionStarted", 2),
        ("MotionFinished", 2),
    ]


def test_an_item_is_reported_when_it_ends_also_before_a_break_condition(peer: Peer) -> None:
    until = wire.Condition(nodes=(wire.SignalIs(signal="Flange.Button", value=True),))
    guarded = [wire.Item(motion=turn(a).motion, until=until) for a in (0.05, 0.1)]
    number = started(peer, *guarded)
    finish(peer, number)
    assert received(peer, number) == [
        ("MotionStarted", 0),
        ("ItemReached", 0),
        ("MotionStarted", 1),
        ("MotionFinished", 1),
    ]


def test_a_cancelled_motion_fires_no_more(peer: Peer) -> None:
    number = started(peer, turn(2.5, trigger(wire.Notify(label="late"), at(2.0))))
    peer.wait_for(wire.MotionStarted, lambda event: event.id == number)
    peer.ask(wire.Cancel(id=number))
    finish(peer, number)
    assert fired(peer, number) == []


def test_an_output_that_the_robot_does_not_write_is_reported(make: Maker) -> None:
    with controlling(make().port) as peer:
        peer.ask(wire.ShowMessage(severity=wire.Severity.INFO, text="jammed"))
        number = started(peer, turn(0.1, trigger(wire.SetSignal(signal=LAMP, value=1.0), at(0.02))))
        assert finish(peer, number).cause is wire.Cause.FINISHED
        (event,) = fired(peer, number)
        assert event.code == Code.EXECUTION_FAILED and "did not respond" in event.text


@pytest.mark.parametrize(
    ("bad", "code", "where"),
    [
        (trigger(wire.Notify(label="x"), at(-0.1)), Code.OUT_OF_RANGE, "condition.nodes[0].distance"),
        (trigger(wire.Notify(label="x"), at(0.1, END)), Code.OUT_OF_RANGE, "condition.nodes[0].distance"),
        (trigger(wire.Notify(label="x"), at(float("nan"))), Code.NOT_FINITE, "condition.nodes[0].distance"),
        (trigger(wire.Notify(label="x")), Code.BAD_CONDITION, "condition"),
        (trigger(wire.Notify(label="x"), at(0.1), at(0.1)), Code.BAD_CONDITION, "condition.nodes"),
        (trigger(wire.Notify(label="x" * 129), at(0.1)), Code.BAD_LENGTH, "action.label"),
        (
            trigger(wire.SetSignal(signal="Flange.Knob", value=1.0), at(0.1)),
            Code.UNKNOWN_NAME,
            "action.signal",
        ),
        (
            trigger(wire.SetSignal(signal="Flange.Button", value=1.0), at(0.1)),
            Code.UNSUPPORTED,
            "action.signal",
        ),
        (trigger(wire.SetSignal(signal=LAMP, value=0.5), at(0.1)), Code.OUT_OF_RANGE, "action.value"),
        (trigger(wire.SetSignal(signal=LEVEL, value=11.0), at(0.1)), Code.OUT_OF_RANGE, "action.value"),
        (
            trigger(wire.Notify(label="x"), wire.SignalOutside(signal=LEVEL, low=0.0, high=1.0)),
            Code.UNSUPPORTED,
            "condition",
        ),
    ],
)
def test_bad_ones_are_refused_and_nothing_moves(
    peer: Peer, bad: wire.Trigger, code: Code, where: str
) -> None:
    answer = peer.ask(run(turn(0.5), turn(1.1, trigger(wire.Notify(label="good"), at(0.1)), bad)))
    assert isinstance(answer, wire.Rejected), answer
    assert (answer.code, answer.parameter) == (code, f"items[1].triggers[1].{where}")


def test_a_hold_has_no_path_and_sixteen_are_enough(peer: Peer) -> None:
    one = trigger(wire.Notify(label="x"), at(0.1))
    answer = peer.ask(run(wire.Item(motion=wire.Hold(duration=1.0), triggers=(one,))))
    assert isinstance(answer, wire.Rejected) and answer.code == Code.BAD_CONDITION
    guided = wire.HandGuide(q_min=(nan,) * 7, q_max=(nan,) * 7)
    answer = peer.ask(run(wire.Item(motion=guided, triggers=(one,))))
    assert isinstance(answer, wire.Rejected) and answer.code == Code.UNSUPPORTED
    answer = peer.ask(run(turn(0.5, *[one] * 17)))
    assert isinstance(answer, wire.Rejected) and answer.parameter == "items[0].triggers"
