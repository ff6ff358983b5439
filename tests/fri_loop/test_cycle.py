"""A cycle of the loop without sockets or processes: guard, policy and session together, and the published state."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import ShapeError
from heptarm.fri.guard.fallback import Missing, Policy
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import Cycle
from heptarm.fri.loop.native import REPEATS
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.loop.user_api import Params, Signals, State
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, SessionState
from heptarm.fri.protocol.version import Version
from heptarm.fri.session.events import Event
from heptarm.fri.session.statistics import Counters
from heptarm.io.shared import MemoryBlock

from .controller import IPO, Controller
from .laws import fails_later, lights, offset, torque

MS = 1_000_000


class Bench:
    """A cycle with a controller that has a simulated clock.

    Args:
        wire: of the controller.
        cycle: its class, that of the loop in C or its oracle.
        settings: of the loop.
        **params: parameters of the law.
    """

    def __init__(
        self,
        *,
        wire: Version = Version.V1_15,
        cycle: Any = Cycle,
        settings: LoopSettings | None = None,
        law: Any = None,
        policy: Policy | None = None,
        **params: Any,
    ) -> None:
        policy = policy or (Policy(Missing.HOLD, patience=1e6) if law is None else Policy())
        settings = settings or LoopSettings(law=law, policy=policy, params=params or None, history=256)
        block = MemoryBlock(at.Layout.words(**settings.sizes))
        block.unlink()
        self.layout = at.Layout(block, **settings.sizes)
        self.layout.params.write(settings.law_params[0])
        self.cycle = cycle(self.layout, settings)
        self.controller = Controller(9, wire=wire, period_ms=1)
        self.controller._sock.close()
        self.now = 10**12
        self.sent: list[m.Command] = self.controller.answers

    def run(self, count: int, state: SessionState | None = None) -> None:
        if state is not None:
            self.controller.state = state
        for _ in range(count):
            self.now += MS
            raw = self.cycle.turn(self.controller.datagram(), self.now)
            if raw is not None:
                self.sent.append(codec.decode_command(raw, self.controller.wire))
            self.cycle.finish(self.now + 30_000)
            self.controller.sequence += 1

    def activate(self) -> None:
        self.run(3, SessionState.MONITORING_READY)
        self.run(3, SessionState.COMMANDING_WAIT)
        self.controller.state = SessionState.COMMANDING_ACTIVE

    def command(self, q: tuple[float, ...]) -> None:
        words = np.zeros(at.COMMAND_WORDS)
        words[at.C_Q : at.C_Q + 7] = q
        self.give(words, at.GIVEN_Q)

    def give(self, words: np.ndarray, given: int) -> None:
        """A command of a user who has seen this session."""
        ints = words.view(np.int64)
        ints[at.C_AT : at.C_GIVEN + 1], ints[at.C_EPOCH] = (self.now, given), self.layout.header[at.EPOCH]
        self.layout.commands.write(words[1:])

    @property
    def counters(self) -> Counters:
        counts = Counters()
        counts.load(self.layout.header, at.COUNTS)
        return counts

    @property
    def limited(self) -> list[str]:
        return at.report_lines(self.layout)

    @property
    def trouble(self) -> str:
        return self.layout.trouble.read() or ""

    @property
    def texts(self) -> list[str]:
        """Texts of the last events."""
        return [one.text for one in events(self.layout)]

    @property
    def states(self) -> list[State]:
        ring = self.layout.states
        offer = self.layout.offered.read()
        known = Signals.of(offer[0] if offer is not None else ())
        return [State(words, known) for tick in range(ring.count) if (words := ring.read(tick)) is not None]

    def track(self) -> np.ndarray:
        """Every position that was sent while commanding or mirroring."""
        return np.array([one.q for one in self.sent if one.q is not None])


def events(layout: at.Layout) -> list[Event]:
    """The last events in a shared memory."""
    from heptarm.fri.loop.telemetry import Reader

    return Reader(layout).events()


def test_what_happens_is_published() -> None:
    bench = Bench(wire=Version.V2_7)
    bench.activate()
    bench.run(5)
    states = bench.states
    assert [one.sequence for one in states] == list(range(11))
    last = states[-1]
    assert last.is_commanding and last.is_answered and not last.is_limited
    assert last.q_sent.tolist() == list(IPO) and last.q_ipo.tolist() == list(IPO)
    assert last.latency == pytest.approx(30e-6) and last.period == 1e-3 and last.t == pytest.approx(4e-3)
    assert last.pose.xyz.tolist() == pytest.approx([0.1, 0.2, 0.3]) and last.tracking == 1.0
    assert last.drive is m.DriveState.ACTIVE and last.operation_mode is m.OperationMode.AUT
    assert last.mode is CommandMode.POSITION and last.overlay is m.Overlay.JOINT
    assert math.isnan(states[0].q_sent[0]) and states[0].t == 0.0


def test_a_jump_at_the_start_of_commanding_becomes_a_gentle_travel() -> None:
    bench = Bench()
    bench.activate()
    bench.command(tuple(value + 0.3 for value in IPO))
    bench.run(1500)
    track = bench.track()[-1503:]
    assert track[-1] == pytest.approx(np.add(IPO, 0.3))
    jerk = np.abs(np.diff(track, 3, axis=0)).max() * 1e9
    assert jerk <= 95.0 * 1.01
    assert bench.counters.limited > 100
    assert any("A1: velocity limited" in line for line in bench.limited)


def test_after_commanding_is_left_the_next_start_is_where_the_interpolator_then_is() -> None:
    bench = Bench()
    bench.activate()
    bench.command(tuple(value + 0.2 for value in IPO))
    bench.run(1200)
    bench.controller.ipo = tuple(value - 0.1 for value in IPO)  # the arm was moved meanwhile
    bench.activate()
    first = len(bench.sent)
    bench.run(300)
    active = np.array([one.q for one in bench.sent[first:]])
    assert active == pytest.approx(np.tile(np.subtract(IPO, 0.1), (300, 1))), "the old command is forgotten"


def test_a_session_that_restarts_between_two_messages_is_a_new_start() -> None:
    bench = Bench()
    bench.activate()
    bench.command(tuple(value + 0.2 for value in IPO))
    bench.run(1200)
    bench.controller.sequence = 0
    bench.controller.ipo = tuple(value - 0.1 for value in IPO)
    bench.run(1)
    assert bench.sent[-1].q == bench.controller.ipo


def test_commands_of_a_program_that_has_not_seen_the_session_hold_the_arm() -> None:
    """A controller restarts elsewhere while a program streams absolute positions: A1 went back to the old place."""
    bench = Bench()
    bench.activate()
    old = tuple(value + 0.2 for value in IPO)
    bench.command(old)
    bench.run(1200)
    seen = bench.layout.header[at.EPOCH]
    bench.controller.sequence = 0
    bench.controller.ipo = tuple(value - 0.4 for value in IPO)
    bench.activate()
    for _ in range(300):
        words = np.zeros(at.COMMAND_WORDS)
        words[at.C_Q : at.C_Q + 7] = old
        ints = words.view(np.int64)
        ints[at.C_AT : at.C_GIVEN + 1], ints[at.C_EPOCH] = (bench.now, at.GIVEN_Q), seen
        bench.layout.commands.write(words[1:])
        bench.run(1)
        assert bench.sent[-1].q == bench.controller.ipo, "it is held where the interpolator is"
    assert bench.layout.header[at.STALE] == 300
    assert sum("has not seen this session" in text for text in bench.texts) == 1
    bench.command(old)  # by a program that has read a state meanwhile
    bench.run(1500)
    assert bench.sent[-1].q == pytest.approx(old)


def test_the_interpolators_speed_is_taken_over() -> None:
    """An overlay on a moving interpolator: mirroring while it moves at 0.2 rad/s, then commanding."""
    bench = Bench()
    for state, count in ((SessionState.COMMANDING_WAIT, 20), (SessionState.COMMANDING_ACTIVE, 20)):
        for _ in range(count):
            bench.controller.ipo = tuple(value + 0.2e-3 for value in bench.controller.ipo)
            bench.run(1, state)
    assert np.diff(bench.track(), axis=0) == pytest.approx(0.2e-3)
    assert not bench.limited


def joints(command: m.Command) -> tuple[float, ...]:
    assert command.q is not None
    return command.q


def test_after_a_long_silence_an_arm_that_stands_is_left_at_rest() -> None:
    bench = Bench()
    bench.activate()
    bench.command(tuple(value + 0.5 for value in IPO))
    bench.run(250)
    last = bench.sent[-1].q
    assert last is not None
    bench.now += 200 * MS
    bench.controller.sequence += 200  # the controller has stopped at once, and reports it
    bench.run(2)
    assert np.abs(np.subtract(joints(bench.sent[-2]), last)).max() < 1e-6, "no jump after the gap"


@pytest.mark.parametrize("wire", [Version.V1_15, Version.V2_5])
def test_after_a_long_silence_an_arm_that_went_on_is_not_halted(wire: Version) -> None:
    bench = Bench(wire=wire)
    bench.activate()
    bench.command(tuple(value + 1.5 for value in IPO))
    bench.run(400)
    speed = np.subtract(joints(bench.sent[-1]), joints(bench.sent[-2]))
    assert speed[0] > 1e-3
    ahead = m.Command(m.Header(0, 0), q=tuple(np.add(joints(bench.sent[-1]), 60 * speed).tolist()))
    bench.sent.append(ahead)  # where the arm then is
    bench.now += 60 * MS
    bench.controller.sequence += 60
    bench.run(2)
    after = np.subtract(joints(bench.sent[-1]), joints(bench.sent[-2]))
    first = np.subtract(joints(bench.sent[-2]), joints(ahead))
    assert after == pytest.approx(speed, rel=0.1) and np.abs(first).max() < 3 * speed.max()


def test_a_law_sees_the_state_and_its_parameters() -> None:
    bench = Bench(law=offset, offset=np.full(7, 0.01))
    bench.activate()
    bench.run(800)
    assert bench.sent[-1].q == pytest.approx(np.add(IPO, 0.01))
    bench.layout.params.write(np.full(7, -0.01))
    bench.run(800)
    assert bench.sent[-1].q == pytest.approx(np.subtract(IPO, 0.01))


def test_a_torque_law() -> None:
    bench = Bench(law=torque, gain=4.0)
    bench.controller.mode = CommandMode.TORQUE
    bench.activate()
    assert bench.sent[-1].tau == (0.0,) * 7, "in COMMANDING_WAIT there is a torque field already"
    bench.run(10)
    assert bench.sent[-1].tau == pytest.approx((2.0,) * 7)
    assert bench.states[-1].tau_sent == pytest.approx((2.0,) * 7)


def test_a_law_that_fails_brakes_the_arm_and_reports_why() -> None:
    bench = Bench(law=fails_later)
    bench.activate()
    bench.run(400)
    assert bench.cycle.may_end
    assert any("the law has had enough" in text for text in bench.texts)


def want(bench: Bench, **outputs: tuple[int, float]) -> None:
    """The outputs that the user's process writes: for each a count and a value."""
    bench.layout.outputs.write({f"FRI.{name}": one for name, one in outputs.items()}, {})


def test_outputs_are_written_until_the_cabinet_shows_them() -> None:
    bench = Bench()
    signal = m.IoValue("FRI.Out", m.IoType.BOOLEAN, m.IoDirection.OUTPUT, 0)
    bench.controller.io = (signal,)
    bench.run(3, SessionState.MONITORING_READY)
    want(bench, Out=(1, 1))
    bench.run(5)
    assert [one.io[0].value for one in bench.sent if one.io] == [1] * 5, "in every state of a session"
    bench.controller.io = (replace(signal, value=1),)
    bench.activate()
    bench.run(5)
    assert not any(one.io for one in bench.sent[-5:])
    want(bench, Out=(2, 0))
    bench.run(80)
    assert sum(bool(one.io) for one in bench.sent[-80:]) == REPEATS
    assert any("does not accept FRI.Out = 0: it shows 1" in text for text in bench.texts)
    assert bench.states[-1].io["out"] is True and bench.sent[-1].q == IPO


def test_signals_that_come_and_go() -> None:
    bench = Bench(wire=Version.V2_7)
    analog = m.IoValue("FRI.Level", m.IoType.ANALOG, m.IoDirection.INPUT, 2.5)
    bench.activate()
    bench.run(2)
    assert not bench.states[-1].io
    bench.controller.io = (analog,)
    bench.run(2)
    assert bench.layout.offered.read() == ((("FRI.Level", m.IoType.ANALOG, m.IoDirection.INPUT),), ())
    bench.controller.io = ()
    bench.run(2)
    assert bench.layout.offered.read() == ((), ())
    want(bench, Out=(1, 1))
    bench.run(2)
    assert any("this FRI session no longer has an output 'FRI.Out'" in text for text in bench.texts)


def test_a_law_reads_inputs_and_writes_outputs() -> None:
    bench = Bench(law=lights)
    button = m.IoValue("FRI.Button", m.IoType.BOOLEAN, m.IoDirection.INPUT, 0)
    lamp = m.IoValue("FRI.Lamp", m.IoType.BOOLEAN, m.IoDirection.OUTPUT, 0)
    bench.controller.io = (button, lamp)
    bench.activate()
    bench.run(5)
    assert not any(one.io for one in bench.sent), "the lamp is off already"
    bench.controller.io = (replace(button, value=1), lamp)
    bench.run(5)
    assert [one.io[0].value for one in bench.sent if one.io] == [1] * 5
    bench.controller.io = ()
    bench.run(200)
    assert bench.cycle.may_end and any("no signal" in text for text in bench.texts)


@pytest.mark.parametrize("wire", Version)
def test_frames_are_reported_as_each_version_has_them(wire: Version) -> None:
    bench = Bench(wire=wire)
    bench.controller.requested = (m.Transformation("PBase", (), m.TimeStamp(1, 2)),)
    half = math.sqrt(0.5)
    pose = [0.1, 0.2, 0.3, 0.0, 0.0, half, half]  # turned by 90 degrees about z
    bench.layout.outputs.write({}, {"PBase": pose, "Other": pose})
    bench.run(3, SessionState.MONITORING_WAIT)
    assert [one.name for one in bench.sent[-1].transformations] == ["PBase"]
    values = bench.sent[-1].transformations[0].values
    if wire.traits.quaternions:
        assert values == pytest.approx((100.0, 200.0, 300.0, half, 0.0, 0.0, half))
    else:
        assert values == pytest.approx((0, -1, 0, 100, 1, 0, 0, 200, 0, 0, 1, 300), abs=1e-12)
    bench.controller.requested = ()
    bench.run(2)
    assert not bench.sent[-1].transformations


def test_parameters_have_names_and_shapes() -> None:
    changed: list[bool] = []
    values, schema = Params.flat({"k": 2.0, "goal": [1.0, 2.0, 3.0]})
    params = Params(values, schema, changed=lambda: changed.append(True))
    assert params.k == 2.0 and params.goal.tolist() == [1.0, 2.0, 3.0]
    params.goal = [3.0, 2.0, 1.0]
    params.set(k=1.0, goal=[0.0, 0.0, 0.0])
    assert params.k == 1.0 and not np.any(params.goal) and len(changed) == 2
    with pytest.raises(ShapeError, match="goal must have shape"):
        params.goal = 1.0
    with pytest.raises(AttributeError, match="there are k, goal"):
        params.speed = 1.0
    with pytest.raises(AttributeError, match="read-only"):
        Params(values, schema).k = 2.0
