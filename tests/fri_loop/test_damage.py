"""Damaged and strange messages: never an error, never a value beyond the limits, never an end without its cause."""

from __future__ import annotations

import math
import os
import random
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import ConnectionLost
from heptarm.fri import Client
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import LAW_FAILED
from heptarm.fri.loop.native import OVERRUN
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.loop.user_api import State
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, SessionState
from heptarm.fri.protocol.protobuf import put_bytes, put_varint
from heptarm.fri.protocol.version import MONITORING_ID, Version, unwrap, wrap
from heptarm.fri.session.events import Kind
from heptarm.values.robot import robot
from tests.long import longer
from tests.oracles.fri import codec

from .controller import IPO, Controller
from .test_cycle import MS, Bench, events
from .test_native import Twins

ARM = robot("iiwa14")
#: Hostile datagrams for each version.
HOSTILE = longer(20_000, 200_000)


def check_limits(answer: bytes | None, wire: Version) -> None:
    """What is sent is within the robot's limits."""
    if answer is None:
        return
    sent = codec.decode_command(answer, wire)
    for value, low, high in zip(sent.q or (), ARM.q_min if sent.q else (), ARM.q_max if sent.q else ()):
        assert low - OVERRUN <= value <= high + OVERRUN, sent.q
    assert all(abs(value) <= most for value, most in zip(sent.tau or (), ARM.tau_max)), sent.tau
    assert all(map(math.isfinite, sent.wrench or ())), sent.wrench
    if sent.pose is not None:
        assert all(abs(value) <= 10_000.0 for value in sent.pose.values), sent.pose


def check_speed(last: State, now: State) -> None:
    """The axes move no faster than they may, by the controller's time and by the clock."""
    if math.isnan(last.q_sent[0]) or now.t <= last.t:  # a new session
        return
    seconds = max(now.t - last.t, (now.received - last.received) * 1e-9)
    assert (np.abs(now.q_sent - last.q_sent) <= ARM.dq_max * seconds + 1e-9).all(), (now, last)


class Hostile:
    """Messages of a controller with right check sums and wrong contents: damaged, cut, repeated, from years away.

    Args:
        wire: version of FRI.
        chance: source of what happens.
    """

    def __init__(self, wire: Version, chance: random.Random) -> None:
        self.wire, self.chance = wire, chance
        self.sequence, self.said = 0, [b"\x0a"]
        modes = [CommandMode.POSITION, CommandMode.TORQUE, CommandMode.WRENCH]
        modes += [CommandMode.CARTESIAN_POSE] if wire.traits.quaternions else []
        controller = Controller(9, wire=wire, period_ms=1)
        controller._sock.close()
        #: Encoded messages behind their headers, by state and mode.
        self.plain: dict[tuple[SessionState, CommandMode], list[bytes]] = {}
        for state in list(SessionState)[1:]:
            for mode in modes:
                controller.state, controller.mode = state, mode
                self.plain[state, mode] = [self._body(controller, variant) for variant in range(12)]

    def _body(self, controller: Controller, variant: int) -> bytes:
        """A message without its header, in some variants with less or with other values than usual."""
        message = codec.decode_monitoring(controller.datagram(), self.wire)
        monitor, ipo = message.monitor, message.ipo
        assert monitor is not None
        variants: list[dict[str, Any]] = [
            {},
            {},
            {},
            {"q": None},
            {"q_cmd": None},
            {"tau_ext": None},
            {"pose": None},
        ]
        lacking = variants[variant % 7]
        if variant == 7:
            monitor = replace(monitor, stamp=m.TimeStamp(2**32 - 1, 2**32 - 1))
        if variant == 8:
            monitor = replace(monitor, q=(2.9, -2.0, 2.9, -2.0, 2.9, 2.0, 3.0), tau=(math.inf,) * 7)
        if variant == 9 and ipo is not None:
            ipo = replace(ipo, q=None, pose=None)
        if variant == 10 and ipo is not None:
            ipo = replace(ipo, q=(0.3, 0.6, 0.1, -1.0, 0.4, 1.1, 0.2))
        if variant == 11:
            monitor = replace(monitor, tau_ext=(math.nan,) * 7)
        message = replace(message, monitor=replace(monitor, **lacking), ipo=ipo)
        raw = unwrap(codec.encode_monitoring(message, self.wire), self.wire)
        return raw[2 + raw[1] :]

    def datagram(self, state: SessionState, mode: CommandMode) -> bytes:
        """The next one: three of four as they should be."""
        chance = self.chance
        what = chance.random()
        self.sequence = (
            self.sequence + (1 if what < 0.97 else chance.choice((2, 5, 40, 900, 2**31)))
        ) % 2**32
        variant = 0 if what < 0.8 else chance.randrange(12)
        head = (
            put_varint(1, MONITORING_ID) + put_varint(2, self.sequence) + put_varint(3, chance.randrange(100))
        )
        raw = bytearray(put_bytes(1, head) + self.plain[state, mode][variant])
        what = chance.random()
        if what < 0.15:
            for _ in range(chance.choice((1, 1, 2, 3))):
                raw[chance.randrange(len(raw))] ^= 1 << chance.randrange(8)
        elif what < 0.17:
            del raw[chance.randrange(len(raw)) :]
        elif what < 0.19:
            return chance.choice(self.said[-300:])
        elif what < 0.2:
            raw[chance.randrange(len(raw))] = chance.randrange(256)
        datagram = wrap(bytes(raw), self.wire)
        self.said = [*self.said[-299:], datagram]
        return datagram


@pytest.mark.parametrize("wire", longer([Version.V1_15, Version.V2_7], list(Version)))
def test_no_datagram_ends_the_client_nor_passes_a_limit(wire: Version) -> None:
    """Whatever comes, every answer is finite and within all limits, and good messages are answered again."""
    chance = random.Random(wire.value)
    bench, hostile = Bench(wire=wire), Hostile(wire, chance)
    modes = sorted({mode for _, mode in hostile.plain})
    last: State | None = None
    mode = CommandMode.POSITION
    for index in range(HOSTILE):
        if index % 160 == 0:
            mode = chance.choice(modes)
        state = SessionState(min(4, 1 + index % 160 // 20))
        bench.now += MS if chance.random() < 0.99 else chance.randrange(600) * MS
        if index % 7 == 0:
            words = np.zeros(at.COMMAND_WORDS)
            words[at.C_Q : at.C_E1 + 1] = [chance.uniform(-4.0, 4.0) for _ in range(at.C_E1 + 1 - at.C_Q)]
            words[at.C_POSE + 3 : at.C_POSE + 7] = 0.5
            bench.give(
                words, chance.choice((at.GIVEN_Q, at.GIVEN_Q | at.GIVEN_TAU, at.GIVEN_WRENCH, at.GIVEN_POSE))
            )
        answer = bench.cycle.turn(hostile.datagram(state, mode), bench.now)
        count = bench.layout.states.count
        bench.cycle.finish(bench.now + 30_000)
        check_limits(answer, wire)
        if bench.layout.states.count > count:
            words_now = bench.layout.states.newest()
            assert words_now is not None
            now = State(words_now)
            if (
                last is not None
                and now.is_commanding
                and last.is_commanding
                and not math.isnan(now.q_sent[0])
            ):
                check_speed(last, now)
            last = now
    bench.now += 600 * MS
    bench.controller.sequence = 0
    bench.run(5, SessionState.MONITORING_READY)
    bench.run(5, SessionState.COMMANDING_WAIT)
    before = len(bench.sent)
    bench.run(5, SessionState.COMMANDING_ACTIVE)
    assert len(bench.sent) == before + 5 and not bench.trouble
    assert bench.counters.malformed > HOSTILE // 50


@pytest.mark.parametrize(
    "state", [SessionState.MONITORING_READY, SessionState.COMMANDING_WAIT, SessionState.COMMANDING_ACTIVE]
)
def test_a_position_that_no_robot_has_is_not_sent_back(state: SessionState) -> None:
    bench = Bench()
    bench.activate()
    bench.run(3, state)
    answers = len(bench.sent)
    bench.controller.ipo = (1e269, *IPO[1:])
    bench.run(2)
    assert len(bench.sent) == answers and bench.counters.malformed == 2
    assert "A1 must be in" in bench.trouble and "1e+269" in bench.trouble
    bench.controller.ipo = IPO
    bench.run(2)
    assert len(bench.sent) == answers + 2 and not bench.trouble
    assert max(abs(value) for one in bench.sent for value in one.q or ()) < math.pi


def test_a_measured_position_that_no_robot_has_is_no_reason_for_a_torque() -> None:
    """One flipped bit of an exponent: torques of NaN were sent."""
    bench = Bench()
    bench.controller.mode = CommandMode.TORQUE
    bench.activate()
    words = np.zeros(at.COMMAND_WORDS)
    words[at.C_TAU : at.C_TAU + 7] = 5.0
    bench.give(words, at.GIVEN_TAU)
    bench.run(20)
    answers = len(bench.sent)
    damaged = (*bench.controller.position()[:4], -5.486124068793689e302, *bench.controller.position()[5:])
    where = bench.controller.position
    bench.controller.position = lambda: damaged  # type: ignore[method-assign]
    bench.run(2)
    assert len(bench.sent) == answers and bench.counters.malformed == 2
    assert "measured position of A5 must be in [-2π, 2π] rad, got -5.486e+302 rad" in bench.trouble
    bench.controller.position = where  # type: ignore[method-assign]
    bench.run(2)
    assert len(bench.sent) == answers + 2
    assert all(math.isfinite(value) for one in bench.sent for value in one.tau or ())


@pytest.mark.parametrize("name", ["", "ü" * 63, "Präzisionsgreifer" * 3])
@pytest.mark.parametrize("wire", [Version.V2_5, Version.V2_7])
def test_a_pose_with_a_strange_name_is_sent_back_under_its_name(name: str, wire: Version) -> None:
    bench = Bench(wire=wire)
    bench.controller.mode = CommandMode.CARTESIAN_POSE
    plain = bench.controller.datagram

    def renamed() -> bytes:
        message = codec.decode_monitoring(plain(), wire)
        if message.ipo is None or message.ipo.pose is None:
            return plain()
        pose = m.Transformation(name, message.ipo.pose.values)
        ipo = m.IpoData(
            q=message.ipo.q, pose=pose, command_mode=CommandMode.CARTESIAN_POSE, overlay=m.Overlay.CARTESIAN
        )
        return codec.encode_monitoring(
            m.Monitoring(message.header, message.robot, message.monitor, message.connection, ipo), wire
        )

    bench.controller.datagram = renamed  # type: ignore[method-assign]
    bench.activate()
    bench.run(3)
    poses = [one.pose for one in bench.sent if one.pose is not None]
    assert len(poses) == 6 and {one.name for one in poses} == {name}


def leaves(state: object, out: object, params: object) -> None:
    raise SystemExit(3)


def test_a_law_that_exits_brakes_as_well() -> None:
    bench = Bench(law=leaves)
    bench.activate()
    bench.run(3)
    assert any(LAW_FAILED + "SystemExit: 3" in text for text in bench.texts)
    assert bench.cycle.may_end


def assigns(state: object, out: object, params: object) -> None:
    out.q = [*IPO[:6], 0.05]  # type: ignore[attr-defined]


def test_a_law_may_assign_its_output() -> None:
    twins = Twins(law=assigns)
    twins.activate()
    for _ in range(300):
        twins.step()
    assert twins.other.states[-1].q_sent[6] == pytest.approx(0.05, abs=1e-6)


def until(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "not in time"
        time.sleep(0.01)


def test_a_loop_that_is_killed_is_named_in_the_trouble() -> None:
    with Client(0, realtime=False) as client:
        os.kill(int(client._header[at.PID]), signal.SIGKILL)
        until(lambda: not client.is_running)
        assert client.trouble == "its process has ended, killed by signal 9 (SIGKILL)"
        with pytest.raises(
            ConnectionLost, match=r"FRI loop has ended: its process has ended, killed by signal 9"
        ):
            client.command(q=IPO)


def test_a_version_that_nobody_knows_is_named_as_the_likely_cause() -> None:
    controller = Controller(9, wire=Version.V1_15)
    controller._sock.close()
    bench = Bench()
    for _ in range(3):
        bench.now += MS
        assert bench.cycle.turn(b"\x12\x34" + controller.datagram(), bench.now) is None
    assert "likely cause: the controller speaks another version" in bench.trouble


def test_a_message_that_another_version_would_understand_names_both() -> None:
    bench = Bench(settings=LoopSettings(version="2.5"))
    frame = m.Transformation("base", (0.0,) * 12)
    controller = Controller(9, wire=Version.V1_15, requested=(frame,))
    controller._sock.close()
    assert bench.cycle.turn(controller.datagram(), bench.now) is None
    assert "speaks FRI 1.14-1.16" in bench.trouble and "set to 2.5" in bench.trouble
    assert [event.kind for event in events(bench.layout)] == [Kind.WRONG_VERSION]
