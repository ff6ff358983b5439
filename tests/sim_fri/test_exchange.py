"""Signals, frames, counters, and datagrams that are none."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from heptarm.errors import CommandRejected
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.codec import encode_monitoring
from heptarm.fri.protocol.version import Version
from heptarm.planning.seam import TICK_NS
from heptarm.sim.fri.settings import FrameProvided, OutputWritten, SessionConfiguration
from tests.oracles.fri.codec import encode_command
from tests.sim_fri.rig import Rig, State, mirror

IN, OUT = m.IoDirection.INPUT, m.IoDirection.OUTPUT
SIGNALS = (
    m.IoValue("Flange.Button", m.IoType.BOOLEAN, IN, 0),
    m.IoValue("Flange.Led", m.IoType.BOOLEAN, OUT, 0),
    m.IoValue("Tool.Code", m.IoType.DIGITAL, OUT, 7),
    m.IoValue("Tool.Pressure", m.IoType.ANALOG, OUT, 0.5),
)


def with_signals(version: Version = Version.V1_15) -> Rig:
    return Rig(configuration=SessionConfiguration(version, signals=SIGNALS))


@pytest.mark.parametrize("version", [Version.V1_15, Version.V2_5, Version.V2_7])
def test_the_client_sees_signals_and_writes_outputs(version: Version) -> None:
    rig = with_signals(version).ready()
    wanted = (
        replace(SIGNALS[1], value=1),
        replace(SIGNALS[2], value=2**63),
        replace(SIGNALS[3], value=-1.25),
    )
    rig.client.extra = m.Command(m.Header(0, 0), io=wanted)
    rig.run(5)
    assert [event.value for event in rig.events if isinstance(event, OutputWritten)] == list(wanted)
    rig.controller.exchange.set("Flange.Button", 1)
    rig.run(1)
    monitor = rig.client.seen[-1].monitor
    assert monitor is not None and monitor.io == (replace(SIGNALS[0], value=1), *wanted)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (m.IoValue("Flange.Door", m.IoType.BOOLEAN, OUT, 1), "not registered"),
        (m.IoValue("Flange.Button", m.IoType.BOOLEAN, OUT, 1), "it is BOOLEAN INPUT"),
        (m.IoValue("Flange.Led", m.IoType.BOOLEAN, IN, 1), "it is BOOLEAN OUTPUT"),
        (m.IoValue("Flange.Led", m.IoType.DIGITAL, OUT, 1), "it is BOOLEAN OUTPUT"),
        (m.IoValue("Flange.Led", m.IoType.BOOLEAN, OUT, 2), "an illegal value"),
        (m.IoValue("Tool.Pressure", m.IoType.ANALOG, OUT, float("nan")), "an illegal value"),
    ],
)
def test_a_signal_that_may_not_be_written_is_reported_once(value: m.IoValue, text: str) -> None:
    rig = with_signals().ready()
    rig.client.extra = m.Command(m.Header(0, 0), io=(value,))
    rig.run(20)
    assert len(rig.reported) == 1 and text in rig.reported[0]
    assert tuple(rig.controller.exchange.signals.values()) == SIGNALS
    assert rig.controller.state is State.MONITORING_READY


def test_the_cabinets_side_cannot_set_nonsense() -> None:
    exchange = with_signals().controller.exchange
    for name, value, text in (
        ("Flange.Door", 1, "not registered"),
        ("Flange.Led", 2, "got 2"),
        ("Tool.Code", -1, "must be a"),
        ("Tool.Pressure", float("inf"), "must be a"),
    ):
        with pytest.raises(CommandRejected, match=text):
            exchange.set(name, value)


@pytest.mark.parametrize(
    ("signals", "text"),
    [
        (SIGNALS * 3, "got 12"),
        ((SIGNALS[0], SIGNALS[0]), "must be unique"),
        ((replace(SIGNALS[0], name="x" * 64),), "1 to 63 bytes"),
        ((replace(SIGNALS[0], name=""),), "1 to 63 bytes"),
    ],
)
def test_signals_that_fri_cannot_carry(signals: tuple[m.IoValue, ...], text: str) -> None:
    with pytest.raises(CommandRejected, match=text):
        SessionConfiguration(Version.V1_15, signals=signals)
    with pytest.raises(CommandRejected, match="FRI 1.11 has no signals"):
        SessionConfiguration(Version.V1_11, signals=SIGNALS)
    with pytest.raises(CommandRejected, match="got 6"):
        SessionConfiguration(Version.V1_11, transformations=tuple("abcdef"))


@pytest.mark.parametrize("version", Version)
def test_the_client_provides_a_frame_that_is_asked_for(version: Version) -> None:
    rig = Rig(configuration=SessionConfiguration(version, transformations=("PBase", "Part")))
    values = (
        (0.0, 0, 300, 1, 0, 0, 0) if version.traits.quaternions else (1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 300)
    )
    frame = m.Transformation("PBase", values, m.TimeStamp(1, 2))
    stranger = m.Transformation("Nobody", values)
    broken = m.Transformation("Part", (float("nan"), *values[1:]))
    rig.client.extra = m.Command(m.Header(0, 0), transformations=(frame, stranger, broken))
    rig.ready().run(5)
    assert [wanted.name for wanted in rig.client.seen[-1].requested] == ["PBase", "Part"]
    assert rig.controller.exchange.frames == {"PBase": frame}
    assert [event.transformation for event in rig.events if isinstance(event, FrameProvided)] == [frame]
    assert any("'Nobody'" in text for text in rig.reported) and any(
        "not finite" in text for text in rig.reported
    )


# ------------------------------------------------------------------------------ counters


def test_counters_are_each_others_reflections() -> None:
    rig = Rig().ready()
    rig.run(5)
    sequences = [message.header.sequence for message in rig.client.seen]
    assert sequences == list(range(len(sequences)))
    last = rig.client.seen[-1].header
    assert last.reflected == rig.client.sequence - 2  # the newest answer is still in transit


def test_a_restarted_client_is_heard_at_once() -> None:
    rig = Rig().active()
    rig.client.sequence = 0
    rig.run(20)
    assert rig.controller.state is State.COMMANDING_ACTIVE and rig.controller.traffic.stale == 0


@pytest.mark.parametrize("version", Version)
def test_duplicates_and_stragglers_command_nothing(version: Version) -> None:
    rig = Rig(version).active()
    rig.run(10)
    newest = rig.client.seen[-1].header.sequence
    before = rig.controller.traffic.stale
    for back in (1, 2, 3):
        jump = replace(mirror(rig.client.seen[-1]), header=m.Header(1, newest - back), q=(0.0,) * 7)
        rig.controller.receive(encode_command(jump, version), rig.now)
    rig.run(5)
    assert rig.controller.traffic.stale == before + 3 and rig.controller.state is State.COMMANDING_ACTIVE


def test_the_counter_runs_over() -> None:
    rig = Rig()
    rig.controller._next = 2**32 - 120  # two minutes short of 50 days
    rig.controller._heard = 2**32 - 121
    rig.active().run(100)
    assert rig.controller.state is State.COMMANDING_ACTIVE and rig.controller.meter.counts.lost == 0
    assert rig.client.seen[-1].header.sequence < 200


# ------------------------------------------------------------------------------ what is no answer


def test_an_answer_to_what_was_never_sent_is_refused() -> None:
    rig = Rig().ready()
    for reflected in (rig.client.seen[-1].header.sequence + 1, 2**32 - 1):
        stray = m.Command(m.Header(0, reflected))
        rig.controller.receive(encode_command(stray, Version.V1_15), rig.now)
    assert rig.controller.traffic.refused == 2
    rig.run(1)
    assert rig.reported == ["an answer to a message that this session did not send, or sent too long ago"]


@pytest.mark.parametrize(
    ("cabinet", "client", "text"),
    [
        (Version.V2_7, Version.V1_15, "the other side speaks FRI 1.x or 2.5"),
        (Version.V2_7, Version.V2_5, "the other side speaks FRI 1.x or 2.5"),
        (Version.V1_11, Version.V2_7, 'the other side speaks FRI 2.7 ("3.0"), this side FRI 1.11'),
        (Version.V2_5, Version.V2_7, "this side FRI 2.5"),
    ],
)
def test_a_client_of_another_version_is_named(cabinet: Version, client: Version, text: str) -> None:
    rig = Rig(cabinet)
    rig.controller.open()
    rig.run(1)
    rig.controller.receive(encode_command(m.Command(m.Header(300, 0)), client), rig.now)
    rig.run(1)
    assert len(rig.reported) == 1 and text in rig.reported[0]


def test_an_answer_that_only_another_version_can_read_names_both() -> None:
    rig = Rig(Version.V2_5)
    rig.controller.open()
    rig.run(1)
    frame = m.Transformation("base", (0.0,) * 12)
    rig.controller.receive(
        encode_command(m.Command(m.Header(300, 0), transformations=(frame,)), Version.V1_15), rig.now
    )
    rig.run(1)
    assert "likely cause: the client speaks FRI 1.14-1.16, this cabinet FRI 2.5" in rig.reported[0]


def test_garbage_is_counted_and_reported_at_most_twenty_times() -> None:
    rig = Rig().active()
    generator = random.Random(1)
    for size in range(300):
        rig.controller.receive(generator.randbytes(size), rig.now)
    own = encode_monitoring(rig.client.seen[-1], Version.V1_15)  # a monitoring message is no command
    rig.controller.receive(own, rig.now)
    rig.run(20)
    assert rig.controller.traffic.refused == 301 and len(rig.reported) <= 20
    assert rig.controller.state is State.COMMANDING_ACTIVE


def test_answers_after_the_end_are_nobodys() -> None:
    rig = Rig().ready()
    rig.controller.close()
    rig.run(2)
    answer = encode_command(m.Command(m.Header(0, rig.client.seen[-1].header.sequence)), Version.V1_15)
    rig.controller.receive(answer, rig.now + TICK_NS)
    assert rig.controller.traffic.stale >= 1 and rig.controller.events() == []
