"""The loop in C does what its oracle in Python does, to the last bit: both process the same exchange."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.native import REPEATS
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, Quality, SessionState
from heptarm.fri.protocol.protobuf import put_bytes, put_varint
from heptarm.fri.protocol.version import MONITORING_ID, Version
from tests.fri import strategies as some
from tests.long import few, longer
from tests.oracles.fri.cycle import Cycle as Oracle

from .controller import IPO
from .laws import lights, offset, torque
from .test_cycle import MS, Bench

EXAMPLES = longer(25, 1000)


class Twins:
    """The loop in C and its oracle; both receive the same input."""

    def __init__(self, **options: Any) -> None:
        self.pure, self.other = Bench(cycle=Oracle, **options), Bench(**options)
        self.answer: bytes | None = None
        self._events = 0

    def message(self, datagram: bytes, gap: int = MS) -> None:
        """One message for both; their answers and what they publish must be equal."""
        for bench in (self.pure, self.other):
            bench.now += gap
        expected = self.pure.cycle.turn(datagram, self.pure.now)
        self.pure.cycle.finish(self.pure.now + 30_000)
        self.answer = self.other.cycle.turn(datagram, self.other.now)
        self.other.cycle.finish(self.other.now + 30_000)
        first, second = self.pure.layout, self.other.layout
        rings = first.events, second.events
        for tick in range(self._events, max(one.count for one in rings)):
            one, two = (ring.read(tick) for ring in rings)
            assert one is not None and two is not None, (rings[0].count, rings[1].count, one, two)
            texts = [words[3:].tobytes().rstrip(b"\0") for words in (one, two)]
            assert texts[0] == texts[1], texts
            assert (one[1:3].view(np.int64) == two[1:3].view(np.int64)).all()
        self._events = rings[0].count
        assert self.answer == expected
        assert first.trouble.read() == second.trouble.read()
        assert first.states.count == second.states.count
        if first.states.count:
            one, two = first.states.newest(), second.states.newest()
            assert one is not None and two is not None
            differ = np.flatnonzero(
                (one.view(np.int64) != two.view(np.int64)) & ~(np.isnan(one) & np.isnan(two)) & ~(one == two)
            )
            assert not differ.size, (differ, one[differ], two[differ])

    def step(self, *, gap: int = MS, **changes: object) -> None:
        """The next message of the controller, after some changes and a time [ns]."""
        controller = self.pure.controller
        for name, value in changes.items():
            setattr(controller, name, value)
        datagram = controller.datagram()
        controller.sequence += 1
        controller._reflected = max(0, self.pure.cycle.session.sent - 1)
        self.message(datagram, gap)

    def command(self, **numbers: Sequence[float]) -> None:
        """A command for both."""
        words = np.zeros(at.COMMAND_WORDS)
        given = 0
        places = {
            "q": (at.GIVEN_Q, at.C_Q),
            "tau": (at.GIVEN_TAU, at.C_TAU),
            "wrench": (at.GIVEN_WRENCH, at.C_WRENCH),
        }
        for name, values in numbers.items():
            bit, start = places[name]
            words[start : start + len(values)] = values
            given |= bit
        for bench in (self.pure, self.other):
            bench.give(words.copy(), given)

    def write(self, io: Any = None, frames: Any = None) -> None:
        """Outputs, each with the count of its write, and frames of the user's process for both."""
        for bench in (self.pure, self.other):
            bench.layout.outputs.write(io or {}, frames or {})

    def activate(self, *, gap: int = MS) -> None:
        for state in (
            SessionState.MONITORING_READY,
            SessionState.COMMANDING_WAIT,
            SessionState.COMMANDING_ACTIVE,
        ):
            for _ in range(4):
                self.step(gap=gap, state=state)

    def check(self) -> None:
        """Counts, histograms and the guards' reports are equal too."""
        one, two = self.pure.layout.block.ints, self.other.layout.block.ints
        for start, end in ((at.COUNTS, at.LATENCY), (at.LATENCY, at.HEADER_WORDS)):
            differ = np.flatnonzero(one[start:end] != two[start:end])
            assert not differ.size, (start + differ, one[start:end][differ], two[start:end][differ])
        assert self.pure.limited == self.other.limited


@pytest.mark.parametrize("wire", Version)
@pytest.mark.parametrize("mode", [CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH])
def test_a_session_with_commands_that_need_limits(wire: Version, mode: CommandMode) -> None:
    twins, rng = Twins(wire=wire), random.Random(1)
    twins.pure.controller.mode = mode
    twins.activate()
    for k in range(600):
        if k % 7 == 0:
            twins.command(
                q=[value + rng.uniform(-0.5, 0.5) for value in IPO],
                tau=[rng.uniform(-400, 400) for _ in range(7)],
                wrench=[rng.uniform(-200, 200) for _ in range(6)],
            )
        twins.step()
    twins.check()


@pytest.mark.parametrize("missing", Missing)
def test_the_policies(missing: Missing) -> None:
    twins = Twins(policy=Policy(missing, patience=0.02, over=0.05))
    twins.pure.controller.mode = CommandMode.TORQUE
    twins.activate()
    for k in range(500):
        if k < 200 or 300 < k < 350:
            twins.command(q=[value + 0.0001 * k for value in IPO], tau=[3.0] * 7)
        twins.step()
    twins.check()
    assert twins.other.counters.filled > 50


def test_a_command_for_each_message_of_a_slow_session_is_fresh() -> None:
    """Messages every 100 ms, and a patience of half of that: no program could send in time."""
    twins, period = Twins(policy=Policy(patience=0.05)), 100 * MS
    twins.pure.controller.period_ms = 100
    twins.activate(gap=period)
    for k in range(40):
        goal = [value + 0.001 * k for value in IPO]
        twins.command(q=goal)
        twins.step(gap=period)
    twins.check()
    assert twins.other.counters.filled == 0
    assert twins.other.states[-1].q_sent == pytest.approx(goal, abs=0.01)
    for _ in range(2):
        twins.step(gap=period)
    assert twins.other.counters.filled == 2, "without another one it expires"


@pytest.mark.parametrize("law", [offset, torque])
def test_laws(law: object) -> None:
    params = {"offset": [0.05] * 7} if law is offset else {"gain": 5.0}
    twins = Twins(law=law, **params)
    twins.pure.controller.mode = CommandMode.POSITION if law is offset else CommandMode.TORQUE
    twins.activate()
    for _ in range(300):
        twins.step()
    twins.check()


def _signal(name: str, kind: m.IoType, value: float, *, is_output: bool = True) -> m.IoValue:
    direction = m.IoDirection.OUTPUT if is_output else m.IoDirection.INPUT
    return m.IoValue(name, kind, direction, value)


class Cell:
    """A cabinet with signals, which shows outputs as they are written, after some messages.

    Attributes:
        signals: as it shows them.
        stuck: name of an output that it does not accept.
    """

    def __init__(self, twins: Twins) -> None:
        self.twins = twins
        self.signals = [
            _signal("FRI.Button", m.IoType.BOOLEAN, 0, is_output=False),
            _signal("FRI.Lamp", m.IoType.BOOLEAN, 0),
            _signal("FRI.Code", m.IoType.DIGITAL, 7),
            _signal("FRI.Level", m.IoType.ANALOG, 0.5),
        ]
        self.stuck = ""
        self.show()

    def show(self) -> None:
        self.twins.pure.controller.io = tuple(self.signals)

    def run(self, count: int) -> list[m.Command]:
        """Messages; the cabinet shows what the answer to the last but one has written."""
        answers: list[m.Command] = []
        for _ in range(count):
            self.twins.step()
            if self.twins.answer:
                answers.append(codec.decode_command(self.twins.answer, self.twins.pure.controller.wire))
            for one in answers[-2].io if len(answers) > 1 else ():
                place = next(i for i, known in enumerate(self.signals) if known.name == one.name)
                if one.name != self.stuck:
                    self.signals[place] = replace(self.signals[place], value=one.value)
            self.show()
        return answers


@pytest.mark.parametrize("wire", [one for one in Version if one.traits.io])
@pytest.mark.parametrize("mode", [CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH])
def test_signals_and_frames_without_python(wire: Version, mode: CommandMode) -> None:
    twins = Twins(wire=wire)
    cell, controller = Cell(twins), twins.pure.controller
    controller.mode = mode
    asked = (1.0, 0.0, 0.0, 0.0) * 3 if not wire.traits.quaternions else (0.0,) * 3 + (1.0, 0.0, 0.0, 0.0)
    controller.requested = (
        m.Transformation("Part", asked, m.TimeStamp(5, 6)),
        m.Transformation("Other", ()),
    )
    controller.state = SessionState.MONITORING_READY
    cell.run(5)
    part = (0.5, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0)
    written = {"FRI.Lamp": 1, "FRI.Code": 2**63, "FRI.Level": 0.25}
    counted = {name: (count, value) for count, (name, value) in enumerate(written.items(), 1)}
    twins.write(counted, {"Part": part})
    answers = cell.run(20)
    assert {one.name: one.value for answer in answers for one in answer.io} == written
    assert not answers[-1].io and [one.name for one in answers[-1].transformations] == ["Part"]
    twins.activate()
    cell.signals[0] = replace(cell.signals[0], value=1)
    cell.run(50)
    twins.write({"FRI.Lamp": (4, 0)}, {"Part": (0.6, *part[1:])})
    assert any(one.io for one in cell.run(20))
    shown = {**written, "FRI.Button": True, "FRI.Lamp": False}
    assert dict(twins.other.states[-1].io) == shown
    twins.check()


def test_an_output_that_the_cabinet_does_not_accept_is_reported_as_in_python() -> None:
    twins = Twins()
    cell = Cell(twins)
    cell.stuck = "FRI.Lamp"
    twins.activate()
    twins.write({"FRI.Lamp": (1, 1)})
    answers = cell.run(80)
    assert sum(bool(one.io) for one in answers) == REPEATS
    one, two = (bench.layout.events for bench in (twins.pure, twins.other))
    assert one.count == two.count
    for tick in range(one.count):
        first, second = one.read(tick), two.read(tick)
        assert first is not None and second is not None and (first[2:] == second[2:]).all()
    assert b"does not accept FRI.Lamp = 1: it shows 0" in one.newest()[3:].tobytes()  # type: ignore[index]
    twins.check()


def test_a_law_reads_and_writes_signals_in_the_native_loop() -> None:
    twins = Twins(law=lights)
    cell = Cell(twins)
    twins.activate()
    cell.run(5)
    for pressed in (1, 0, 1):
        cell.signals[0] = replace(cell.signals[0], value=pressed)
        answers = cell.run(10)
        assert ("FRI.Lamp", pressed) in [(one.name, one.value) for answer in answers for one in answer.io]
        assert cell.signals[1].value == pressed
    twins.check()


def test_signals_that_change_between_messages_go_to_python_and_back() -> None:
    """Other names, types and numbers of signals, a name twice, a very long name."""
    twins = Twins()
    cell = Cell(twins)
    twins.activate()
    first = list(cell.signals)
    for count, signals in enumerate(
        (
            first[:2],
            [replace(first[0], name="FRI.Other"), first[1]],
            [replace(first[0], type=m.IoType.DIGITAL), first[1]],
            [first[0], first[0], first[1]],
            [replace(first[1], name=f"FRI.{'ä' * 59}"), first[0]],
            [],
            first,
        ),
        1,
    ):
        cell.signals = list(signals)
        cell.show()
        twins.write({"FRI.Lamp": (count, count % 2)})
        cell.run(6)
    twins.check()


@pytest.mark.parametrize("wire", few([Version.V2_5, Version.V1_15]))
def test_every_byte_of_a_message_damaged(wire: Version) -> None:
    """The native part refuses what Python refuses; a zero tag or an illegal pose ends the decoding."""
    twins = Twins(wire=wire)
    twins.pure.controller.io = tuple(Cell(twins).signals[1:4:2])
    twins.pure.controller.requested = (m.Transformation("Part", (), m.TimeStamp(5, 6)),)
    twins.step(state=SessionState.COMMANDING_WAIT)
    for byte in range(len(twins.pure.controller.datagram())):
        for bit in range(8) if EXAMPLES > 25 else (3, byte % 8):
            datagram = bytearray(twins.pure.controller.datagram())
            datagram[byte] ^= 1 << bit
            twins.message(bytes(datagram))
            twins.pure.controller.sequence += 1
            twins.step()
    twins.check()


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data(), wire=st.sampled_from(list(Version)))
def test_whatever_a_controller_may_send(data: st.DataObject, wire: Version) -> None:
    """Legal messages of any content and order of sessions: read alike, answered alike."""
    twins = Twins(wire=wire)
    for _ in range(data.draw(st.integers(1, 8))):
        value = data.draw(some.monitorings(wire))
        twins.message(codec.encode_monitoring(value, wire), gap=data.draw(st.sampled_from((MS, 700 * MS))))
    twins.check()


@pytest.mark.parametrize("numbers", [(2**32, 0), (2**63, 0), (5, 2**64 - 1)])
def test_numbers_of_more_than_32_bits_are_refused_and_break_nothing(numbers: tuple[int, int]) -> None:
    twins = Twins()
    twins.activate()
    for sequence, reflected in (numbers, numbers[::-1]):
        head = put_varint(1, MONITORING_ID) + put_varint(2, sequence) + put_varint(3, reflected)
        datagram = twins.pure.controller.datagram()
        twins.message(put_bytes(1, head) + datagram[2 + datagram[1] :])
    twins.step()
    assert twins.other.counters.malformed == 2
    twins.check()


def test_of_a_pose_nothing_is_left_when_joints_are_commanded() -> None:
    twins = Twins(wire=Version.V2_5)
    twins.activate()
    for mode in (CommandMode.CARTESIAN_POSE, CommandMode.POSITION, CommandMode.CARTESIAN_POSE):
        twins.pure.controller.mode = mode
        twins.step()
        twins.step()
    twins.check()


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data(), wire=st.sampled_from(list(Version)))
def test_whatever_happens(data: st.DataObject, wire: Version) -> None:
    """States, qualities, modes, losses, repeats, silence, damage and jumps of the interpolator, in any order."""
    twins = Twins(wire=wire)
    kept, count = [b""], 0
    for _ in range(data.draw(st.integers(5, 40))):
        what = data.draw(
            st.sampled_from(
                ["plain"] * 4
                + [
                    "state",
                    "quality",
                    "mode",
                    "lose",
                    "repeat",
                    "silence",
                    "damage",
                    "cut",
                    "ipo",
                    "command",
                    "restart",
                    "wild",
                    "signals",
                    "write",
                ]
            )
        )
        controller = twins.pure.controller
        if what == "state":
            controller.state = data.draw(st.sampled_from(SessionState))
        elif what == "quality":
            controller.quality = data.draw(st.sampled_from(Quality))
        elif what == "mode":
            controller.mode = data.draw(st.sampled_from(CommandMode))
        elif what == "lose":
            controller.sequence += data.draw(st.integers(1, 3))
        elif what == "restart":
            controller.sequence = 0
        elif what == "ipo":
            controller.ipo = tuple(data.draw(st.floats(-2, 2)) for _ in range(7))
        elif what in ("command", "wild"):
            number = st.floats(-3, 3) if what == "command" else st.floats(allow_nan=True, allow_infinity=True)
            twins.command(q=[data.draw(number) for _ in range(7)])
        elif what == "signals" and wire.traits.io:
            known = Cell(twins).signals
            controller.io = tuple(data.draw(st.permutations(known))[: data.draw(st.integers(0, 4))])
            names = data.draw(st.lists(st.sampled_from(("Part", "Other")), max_size=3))
            controller.requested = tuple(m.Transformation(name, ()) for name in names)
        elif what == "write":
            count += 1
            values = {"FRI.Lamp": (count, count % 2), "FRI.Level": (count, 0.1 * count)}
            twins.write(values, {"Part": (0.5, 0.01 * count, 0.1, 0.0, 0.0, 0.0, 1.0)})
        elif what == "repeat":
            twins.message(kept[-1])
        elif what in ("damage", "cut"):
            raw = bytearray(controller.datagram())
            if what == "cut":
                raw = raw[: data.draw(st.integers(0, len(raw)))]
            else:
                raw[data.draw(st.integers(0, len(raw) - 1))] ^= 1 << data.draw(st.integers(0, 7))
            twins.message(bytes(raw))
        for _ in range(data.draw(st.integers(1, 12))):
            kept.append(controller.datagram())
            if what == "silence":
                twins.pure.now += 20 * MS
                twins.other.now += 20 * MS
                what = "plain"
            twins.step()
    twins.check()
