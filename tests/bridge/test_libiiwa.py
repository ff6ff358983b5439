"""libiiwa's protocol: a program of our own speaks it as libiiwa's class does, and heptarm's cabinet carries it out."""

from __future__ import annotations

import math
import struct
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

import numpy as np
import pytest

from heptarm import Arm
from heptarm.bridge.libiiwa import LibiiwaBridge, serve_libiiwa
from heptarm.modes import CartesianImpedance, JointImpedance, SineImpedance
from tests.bridge.libiiwa import PATIENCE, LibiiwaProgram

NAN = math.nan
HOME = [0.0, math.radians(30), 0.0, -math.pi / 2, 0.0, math.radians(60), 0.0]
NEAR = [0.1, 0.6, 0.1, -1.5, 0.1, 0.9, 0.2]
NONE, VALUE, ASYNCHRONOUS, CONFIGURATION = -10, -11, -14, -16


@contextmanager
def bridge(arm: Arm, port: int) -> Iterator[list[str]]:
    """A bridge to a port, and what it reports."""
    ended = threading.Event()
    reports: list[str] = []
    thread = threading.Thread(
        target=serve_libiiwa, args=(arm,), kwargs={"port": port, "on_change": reports.append, "ended": ended}
    )
    thread.start()
    try:
        yield reports
    finally:
        ended.set()
        thread.join(PATIENCE)
        assert not thread.is_alive()


@contextmanager
def connected(arm: Arm, letter: str = "f") -> Iterator[LibiiwaProgram]:
    program = LibiiwaProgram(letter)
    try:
        with bridge(arm, program.port):
            program.accept()
            yield program
            program.close()
    finally:
        program.close()


def off(answer: Sequence[float], q: Sequence[float]) -> float:
    return float(np.abs(np.subtract(answer[1:8], q)).max())


def wait_for(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("precision", ["f", pytest.param("d", marks=pytest.mark.long)])
def test_motions_of_the_standard_interface_end_at_their_targets(arm: Arm, precision: str) -> None:
    with connected(arm, precision) as program:
        program.command(102, *NEAR)
        assert off(program.rest(), NEAR) < 1e-3
        program.command(102, *[NAN] * 6, -0.3)
        answer = program.rest()
        assert off(answer, [*NEAR[:6], -0.3]) < 1e-3, "NaN keeps a joint"

        state = arm.state
        assert np.allclose(answer[22:25], 1000.0 * state.pose.xyz, atol=0.1)
        assert np.allclose(answer[25:28], state.pose.abc, atol=1e-3)
        assert np.allclose(answer[15:22], state.tau_ext, atol=5.0)
        assert answer[34:38] == (NONE, 0.0, 1.0, 0.0)

        x, y, z = answer[22:25]
        program.command(303, 22)  # LIN
        program.command(103, x, y, z - 50.0, NAN, NAN, NAN)
        line = program.rest()
        assert np.allclose(line[22:25], (x, y, z - 50.0), atol=0.1)
        assert np.allclose(line[25:28], answer[25:28], atol=1e-3), "NaN keeps an angle"
        program.command(104, x, y + 30.0, z - 20.0, x, y + 60.0, z - 50.0)
        assert np.allclose(program.rest()[22:25], (x, y + 60.0, z - 50.0), atol=0.1)

        program.command(303, 21)  # PTP
        program.command(305, 52)  # synchronous: the answer comes at the end
        assert off(program.command(102, *HOME), HOME) < 1e-3


def test_targets_of_the_servo_interface_are_followed_to_the_last(arm: Arm) -> None:
    with connected(arm) as program:
        program.command(302, 32)
        for step in range(1, 6):
            program.command(102, *(HOME + (np.array(NEAR) - HOME) * step / 5.0))
        answer = program.until(lambda one: off(one, NEAR) < 1e-3)
        assert answer[37] == 1.0, "the servo motion stays open"

        x, y, z = answer[22:25]
        for code, target in ((21, (x + 20.0, y, z)), (22, (x, y, z))):
            program.command(303, code)
            program.command(103, *target, NAN, NAN, NAN)
            program.until(lambda one, at=target: bool(np.allclose(one[22:25], at, atol=0.5)))  # type: ignore[misc]
        assert program.command(101)[37] == 0.0, "stopped"
        assert program.ask(305, 52)[0] == 1.0
        refused = program.ask(102, *HOME)
        assert (refused[0], refused[34]) == (0.0, CONFIGURATION), "servo and synchronous exclude each other"


#: Requests, and status and last error of the answers.
REQUESTS = (
    ((201, 0.5), 1, NONE),
    ((202, 0.5), 1, NONE),
    ((203, 0.5), 1, NONE),
    ((204, 10_000.0), 1, NONE),
    ((205, 1e9), 1, NONE),  # more than an arm has
    ((206, 10_000.0), 1, NONE),
    ((201, 0.0), 0, VALUE),
    ((201, NAN), 0, VALUE),
    ((204, -1.0), 0, VALUE),
    ((211, 10.0, NAN, 20.0, 10.0, 10.0, 10.0), 1, NONE),
    ((211, -1.0, NAN, NAN, 10.0, 10.0, 10.0), 0, VALUE),
    ((211, NAN, NAN, NAN, 10.0, 10.0, 10.0), 1, NONE),
    ((212, 3.0, -20.0, 20.0), 1, NONE),
    ((212, 3.0, 20.0, -20.0), 0, VALUE),
    ((212, 7.0, -20.0, 20.0), 0, VALUE),
    ((212, 3.0, NAN, NAN), 1, NONE),
    ((221, 1000.0, 1100.0, 1200.0, 10.0, 20.0, 30.0, 50.0), 1, NONE),
    ((221, 9000.0, NAN, NAN, NAN, NAN, NAN, NAN), 0, VALUE),
    ((222, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5), 1, NONE),
    ((223, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0), 1, NONE),
    ((224, 1e6, 1e6, 50.0, 1e6, 1e6, 1e6, 1.0), 1, NONE),
    ((224, *[1e6] * 6, 1.0), 1, NONE),
    ((225, *[1e9] * 3, *[1e6] * 3), 1, NONE),
    ((226, 100.0, *[1e9] * 2, *[1e6] * 3), 1, NONE),
    ((227, *[300.0] * 7), 1, NONE),
    ((227, NAN, *[300.0] * 6), 0, VALUE),
    ((228, *[0.5] * 7), 1, NONE),
    ((229, 5.0), 1, NONE),
    ((230, 2.0), 1, NONE),
    ((230, 20.0), 0, VALUE),
    ((231, 90.0, 0.0, 0.0, 450.0), 1, NONE),
    ((232, -3.0), 1, NONE),
    ((233, *[1e6] * 6), 1, NONE),
    ((234, *[1e9] * 3, *[1e6] * 3), 1, NONE),
    ((236, 1.0), 1, NONE),
    ((237, 1e9), 1, NONE),
    ((238, 1.0), 1, NONE),
    ((235, 1e9), 1, NONE),
    ((239, 0.0), 1, NONE),
    ((240, 2.0, 5.0, 1000.0), 1, NONE),
    ((240, 8.0, 5.0, 1000.0), 0, VALUE),
    ((241, 0.0, 2.0, 5.0, 1000.0), 1, NONE),
    ((242, 1.0, 2.0, 5.0, 1000.0), 1, NONE),
    ((243, 2.0, 2.0, 5.0, 1000.0, 10.0), 1, NONE),
    ((243, 3.0, 2.0, 5.0, 1000.0, 10.0), 0, VALUE),
    ((301, 11.0), 1, NONE),
    ((301, 12.0), 0, VALUE),  # hangs libiiwa's application
    ((302, 33.0), 0, VALUE),
    ((303, 25.0), 0, VALUE),
    ((304, 44.0), 1, NONE),
    ((304, NAN), 0, VALUE),
    ((305, 51.0), 1, NONE),
    ((400, -1.0), 1, NONE),
    ((400, 1.0), 0, VALUE),
    ((999.0,), 0, CONFIGURATION),
    ((-5.0,), 0, CONFIGURATION),  # ends libiiwa's application
    ((304, 41.0), 1, NONE),
    ((102, 3.5, *[0.0] * 6), 0, VALUE),
    ((103, 5000.0, 0.0, 0.0, NAN, NAN, NAN), 0, VALUE),
    ((303, 23.0), 1, NONE),
    (
        (103, 600.0, 0.0, 500.0, NAN, NAN, NAN),
        0,
        CONFIGURATION,
    ),  # a line of LIN_REL, which libiiwa does not have
)


def request(*numbers: float) -> list[float]:
    return [*numbers, *[0.0] * (8 - len(numbers))]


def test_each_command_has_its_status_and_its_error(arm: Arm) -> None:
    server = LibiiwaBridge(arm)
    for numbers, status, error in REQUESTS:
        answer = server.answer(request(*numbers))
        assert len(answer) == 38
        assert (answer[0], answer[34]) == (status, error), numbers
        assert off(answer, HOME) < 1e-3, "nothing has moved"
    assert server.answer(request(math.inf))[0] == server.answer(request(NAN))[0] == 0.0


def test_modes_have_the_values_that_were_set(arm: Arm) -> None:
    server = LibiiwaBridge(arm, tools=("no such tool",))

    def mode_of(number: int, kind: type) -> Any:
        assert server.answer(request(304, number))[0] == 1.0
        assert server.answer(request(102, *[NAN] * 6, 0.5 - number % 2))[0] == 1.0
        mode = arm.wait_until(lambda state: isinstance(state.mode, kind), timeout=PATIENCE).mode
        assert server.answer(request(101))[0] == 1.0
        return mode

    assert server.answer(request(227, *[100.0 * k for k in range(1, 8)]))[0] == 1.0
    assert server.answer(request(221, 1000.0, 1100.0, NAN, 10.0, 20.0, 30.0, 50.0))[0] == 1.0
    assert server.answer(request(229, 4.0))[0] == 1.0
    assert mode_of(42, JointImpedance).stiffness[6] == 700.0
    assert mode_of(43, CartesianImpedance).stiffness.tolist() == [1000.0, 1100.0, 2000.0, 30.0, 20.0, 10.0]
    sine = mode_of(44, SineImpedance)
    assert sine.amplitude[0] == 4.0 and sine.base.stiffness[0] == 1000.0
    answer = server.answer(request(400, 0))
    assert (answer[0], answer[34]) == (0.0, CONFIGURATION), "no tool has this name"


def test_a_condition_ends_motions_and_servo_motions(arm: Arm) -> None:
    with connected(arm) as program:
        program.command(212, 0, 50.0, 60.0)  # outside of it from the beginning
        program.command(102, *NEAR)
        answer = program.rest()
        assert answer[35] == 1.0 and off(answer, NEAR) > 0.01
        program.command(302, 32)
        program.command(102, *NEAR)
        assert program.until(lambda one: one[37] == 0.0)[35] == 1.0
        refused = program.ask(102, *NEAR)
        assert (refused[0], refused[34]) == (0.0, ASYNCHRONOUS), "not before it is set again"
        program.command(212, 0, NAN, NAN)
        assert program.command(102, *HOME)[35] == 0.0


def test_a_stop_ends_a_synchronous_motion(arm: Arm) -> None:
    with connected(arm) as program:
        program.command(201, 0.05)
        program.command(305, 52)
        program.send(102, 1.5, *HOME[1:])
        wait_for(lambda: abs(arm.state.dq[0]) > 0.01)
        program.send(101)
        assert program.receive()[0] == 0.0, "the motion has not reached its target"
        stopped = program.receive()
        assert stopped[0] == 1.0 and stopped[1] < 1.0 and stopped[37] == 0.0


@pytest.mark.parametrize(
    ("settings", "precision"),
    [((), "f"), (((305, 52),), "f"), (((302, 32),), "d")],
    ids=["standard", "synchronous", "servo"],
)
def test_the_arm_stops_when_the_program_is_lost(
    arm: Arm, settings: tuple[tuple[int, int], ...], precision: str
) -> None:
    with connected(arm, precision) as program:
        program.command(201, 0.05)
        for one in settings:
            program.command(*one)
        program.send(102, 1.5, *HOME[1:])
        wait_for(lambda: abs(arm.state.dq[0]) > 0.01)
        program.close()
        arm.wait_for_rest(timeout=PATIENCE)
        assert arm.state.q[0] < 1.0


def test_garbage_ends_neither_the_bridge_nor_its_next_program(arm: Arm) -> None:
    program = LibiiwaProgram("f")
    with bridge(arm, program.port) as reports:
        program.accept()
        assert program.connection is not None
        program.connection.sendall(bytes(range(32)))
        program.receive()
        rng = np.random.default_rng(5)
        for _ in range(50):
            program.connection.sendall(rng.bytes(32))
            program.receive()
        with suppress(OSError):  # many requests, and nobody reads: the bridge may hang up
            program.connection.sendall(rng.bytes(1000))
        program.connection.close()
        program.accept()
        for piece in struct.pack("!8f", 102, *NEAR[:6], 0.0), b"":
            for byte in piece:
                program.connection.sendall(bytes([byte]))
        assert program.receive()[0] == 1.0, "a request may come in pieces"
        assert off(program.rest(), [*NEAR[:6], 0.0]) < 1e-3
        program.close()
        wait_for(lambda: len(reports) == 4)
        assert "stopped" in reports[-1]
