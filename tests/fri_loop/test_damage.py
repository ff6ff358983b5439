"""Damaged and strange messages: never an error, never a value beyond the limits, never an end without its cause."""

from __future__ import annotations

import math
import os
import random
import signal
import time
from collections.abc import Callable

import numpy as np
import pytest

from heptarm.errors import ConnectionLost
from heptarm.fri import Client
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import LAW_FAILED
from heptarm.fri.loop.native import OVERRUN
from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, SessionState
from heptarm.fri.protocol.version import Version
from heptarm.fri.session.events import Kind
from heptarm.values.robot import robot

from .controller import IPO, Controller
from .test_cycle import MS, Bench
from .test_native import Twins

ARM = robot("iiwa14")
#: Damaged datagrams for each version; `LONG=1` searches longer.
DAMAGED = 20_000 if os.environ.get("LONG") else 1_500


def check_limits(answer: bytes | None, wire: Version) -> None:
    """What is sent is within the robot's limits."""
    if answer is None:
        return
    sent = codec.decode_command(answer, wire)
    for value, low, high in zip(sent.q or (), ARM.q_min if sent.q else (), ARM.q_max if sent.q else ()):
        assert low - OVERRUN <= value <= high + OVERRUN, sent.q
    if sent.pose is not None:
        assert all(abs(value) <= MAX_COORDINATE for value in sent.pose.values), sent.pose


def damaged(datagram: bytes, random: random.Random) -> bytes:
    """One to three flipped bits; rarely a cut, a repetition, or an exchanged byte."""
    raw = bytearray(datagram)
    what = random.random()
    if what < 0.85:
        for _ in range(random.choice((1, 1, 2, 3))):
            at = random.randrange(len(raw))
            raw[at] ^= 1 << random.randrange(8)
    elif what < 0.9:
        del raw[random.randrange(len(raw)) :]
    elif what < 0.95:
        at = random.randrange(len(raw))
        raw[at:at] = raw[random.randrange(len(raw)) :][: random.randrange(20)]
    else:
        raw[random.randrange(len(raw))] = random.randrange(256)
    return bytes(raw)


@pytest.mark.parametrize(
    ("wire", "mode"),
    [
        (Version.V1_11, CommandMode.POSITION),
        (Version.V1_15, CommandMode.TORQUE),
        (Version.V1_15, CommandMode.WRENCH),
        (Version.V2_5, CommandMode.POSITION),
        (Version.V2_5, CommandMode.CARTESIAN_POSE),
    ],
)
def test_flipped_bits_never_stop_the_loop_nor_pass_a_limit(wire: Version, mode: CommandMode) -> None:
    """Both loops, Python and native; 2.7 refuses damage by its checksum, tested with the codec."""
    twins, chance = Twins(wire=wire), random.Random(f"{wire}{mode}")
    controller, cycle = twins.pure.controller, twins.pure.cycle
    controller.mode = mode
    for index in range(DAMAGED):
        controller.state = SessionState(1 + index // 40 % 4)
        twins.step()
        raw = damaged(controller.datagram(), chance)
        controller.sequence += 1
        for bench in (twins.pure, twins.other):
            bench.now += MS
        answer = cycle.turn(raw, twins.pure.now)
        cycle.finish(twins.pure.now + 30_000)
        assert twins._native(raw) == answer
        check_limits(answer, wire)
        for bench in (twins.pure, twins.other):
            assert not bench.cycle.failure and not bench.cycle.is_ending
        if chance.random() < 0.02:  # a damaged counter or state may have begun another session
            twins.step(state=SessionState.MONITORING_READY)


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
    assert len(bench.sent) == answers and bench.cycle.session.counters.malformed == 2
    assert "A1 must be in" in bench.cycle.session.trouble and "1e+269" in bench.cycle.session.trouble
    bench.controller.ipo = IPO
    bench.run(2)
    assert len(bench.sent) == answers + 2 and not bench.cycle.session.trouble
    assert max(abs(value) for one in bench.sent for value in one.q or ()) < math.pi


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
    assert len(poses) == 6 and {one.name for one in poses} == {name} and not bench.cycle.failure


@pytest.mark.parametrize("wire", [Version.V1_15, Version.V2_5])
def test_an_error_of_the_loop_brakes_and_is_reported(wire: Version) -> None:
    """Whatever fails inside a cycle: the arm brakes with the guard's limits, and the loop ends with its cause."""
    bench = Bench(wire=wire)
    bench.activate()
    bench.command((1.0, *IPO[1:]))
    bench.run(40)
    before = bench.track()[-1][0]
    assert before > IPO[0]

    def broken(*_: object) -> None:
        raise ZeroDivisionError("a defect")

    bench.cycle._read_command = broken  # type: ignore[method-assign]
    bench.run(400)
    assert bench.cycle.failure.startswith(LOOP_FAILED + "ZeroDivisionError: a defect (test_damage.py, line")
    assert bench.layout.header[at.STOP] and bench.cycle.may_end
    track = bench.track()[:, 0]
    speeds = 1e3 * np.diff(track)
    assert abs(1e3 * np.diff(speeds)).max() <= ARM.ddq_max[0] and speeds[-1] == 0.0


def leaves(state: object, out: object, params: object) -> None:
    raise SystemExit(3)


def test_a_law_that_exits_brakes_as_well() -> None:
    bench = Bench(law=leaves)
    bench.activate()
    bench.run(3)
    events = [bench.layout.events.read(tick) for tick in range(bench.layout.events.count)]
    texts = [words[3:].tobytes().decode(errors="replace") for words in events if words is not None]
    assert any(LAW_FAILED + "SystemExit: 3" in text for text in texts) and bench.cycle.is_ending


def assigns(state: object, out: object, params: object) -> None:
    out.q = [*IPO[:6], 0.05]  # type: ignore[attr-defined]


def test_a_law_may_assign_its_output_in_both_loops() -> None:
    twins = Twins(law=assigns)
    twins.activate()
    for _ in range(300):
        twins.step()
    twins.native.sync_to_python()
    assert twins.plain > 250 and twins.other.cycle.guard.q == twins.pure.cycle.guard.q
    assert twins.other.cycle.guard.q[6] == pytest.approx(0.05, abs=1e-6)


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
    assert "likely cause: the controller speaks another version" in bench.cycle.session.trouble


def test_a_message_that_another_version_would_understand_names_both() -> None:
    from heptarm.fri.session.session import Session

    session = Session(Version.V2_5)
    frame = m.Transformation("base", (0.0,) * 12)
    controller = Controller(9, wire=Version.V1_15, requested=(frame,))
    controller._sock.close()
    assert session.receive(controller.datagram(), 0) is None
    assert "speaks FRI 1.14-1.16" in session.trouble and "set to 2.5" in session.trouble
    assert [event.kind for event in session.events()] == [Kind.WRONG_VERSION]
