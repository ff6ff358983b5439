"""The protocol of KST and iiwaPy3: lines as their classes send them, carried out by heptarm's cabinet."""

from __future__ import annotations

import math
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm
from heptarm.bridge.kst import serve_kst
from heptarm.modes import CartesianImpedance
from tests.conftest import RunningCabinet

PATIENCE = 60.0
HOME = [0.0, math.radians(30), 0.0, -math.pi / 2, 0.0, math.radians(60), 0.0]
NEAR = [0.1, 0.6, 0.1, -1.5, 0.1, 0.9, 0.2]


class Program:
    """What KST's class is on the wire: one line after the other."""

    def __init__(self, port: int) -> None:
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                self.connection = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
                break
            except ConnectionRefusedError:
                assert time.monotonic() < deadline
                time.sleep(0.02)
        self.answers = self.connection.makefile("r")

    def send(self, line: str) -> None:
        self.connection.sendall(f"{line}\n".encode())

    def ask(self, line: str) -> str:
        self.send(line)
        return self.answers.readline().strip()

    def numbers(self, line: str) -> list[float]:
        return [float(one) for one in self.ask(line).split("_") if one]

    def done(self, *lines: str) -> None:
        for line in lines:
            assert self.ask(line) == "done", line

    def move(self, line: str) -> str:
        """Carry out a motion; returns how it ended."""
        self.done(line)
        return self.answers.readline().strip()

    def close(self) -> None:
        self.answers.close()
        self.connection.close()


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as one:
        port: int = one.getsockname()[1]
    return port


@pytest.fixture
def program(arm: Arm) -> Iterator[Program]:
    ended, port = threading.Event(), free_port()
    thread = threading.Thread(target=serve_kst, args=(arm,), kwargs={"port": port, "ended": ended})
    thread.start()
    try:
        one_program = Program(port)
        yield one_program
        one_program.close()
    finally:
        ended.set()
        thread.join(PATIENCE)
        assert not thread.is_alive()
        if arm.state.tool:
            arm.detach_tool()


def joined(values: Sequence[float]) -> str:
    return "_".join(f"{value:.6f}" for value in values) + "_"


def off(one: Sequence[float], other: Sequence[float]) -> float:
    return float(np.abs(np.subtract(one, other)).max())


def test_motions_answer_at_their_beginning_and_at_their_end(program: Program, arm: Arm) -> None:
    program.done("jRelVel_1.0_", f"jp_{joined(NEAR)}")
    assert program.move("doPTPinJS") == "done"
    assert off(program.numbers("getJointsPositions"), NEAR) < 1e-3
    assert program.move("doPTPinJS") == "done", "to where the arm is"

    pose = program.numbers("Eef_pos")
    assert np.allclose(pose[:3], 1000.0 * arm.state.pose.xyz, atol=0.1)
    x, y, z = pose[:3]
    program.done("jRelVel_250_", f"cArtixanPosition_{joined([x, y, z - 40.0, *pose[3:]])}\n")
    assert program.move("doPTPinCS") == "done"
    assert off(program.numbers("Eef_pos")[:3], (x, y, z - 40.0)) < 0.2
    program.done(f"cArtixanPosition_{joined([0, 30, 0, 0, 0, 0])}")
    assert program.move("doPTPinCSRelBase") == "done"
    assert off(program.numbers("Eef_pos")[:3], (x, y + 30.0, z - 40.0)) < 0.2
    program.done(f"cArtixanPosition_{joined([0, 0, -20, 0, 0, 0])}")
    here = arm.state.pose
    assert program.move("doPTPinCSRelEEF") == "done"
    assert arm.state.pose.distance_to(here.shifted(z=-0.02, frame="tool")) < 2e-4
    x, y, z = program.numbers("Eef_pos")[:3]
    program.done(
        f"cArtixanPositionCirc1_{joined([x, y - 20.0, z + 20.0, *pose[3:]])}",
        f"cArtixanPositionCirc2_{joined([x, y - 40.0, z, *pose[3:]])}",
    )
    assert program.move("doPTPinCSCircle1_") == "done"
    assert off(program.numbers("Eef_pos")[:3], (x, y - 40.0, z)) < 0.2


def test_a_torque_window_interrupts_motions_and_lines(program: Program) -> None:
    program.done("jRelVel_0.2_", f"jp_{joined(NEAR)}")
    assert program.move("doPTP!inJS_1_50_60") == "interrupted", "the torque is outside from the beginning"
    assert off(program.numbers("getJointsPositions"), NEAR) > 0.01
    before = program.numbers("Eef_pos")
    program.done("jRelVel_50_", f"cArtixanPosition_{joined([0, 40, 0, 0, 0, 0])}")
    assert program.move("doPTP!inCSRelBase_2_400_450") == "interrupted"
    assert off(program.numbers("Eef_pos")[:3], (before[0], before[1] + 40.0, before[2])) > 5.0
    program.done("jRelVel_1.0_")
    assert program.move("doPTP!inJS_1_-300_300_2_-300_300") == "done"


def test_streams_follow_their_targets(program: Program, arm: Arm) -> None:
    program.done("startDirectServoJoints")
    program.send(f"jf_{joined(HOME)}")  # without an answer
    program.done(f"jp_{joined(NEAR)}")
    deadline = time.monotonic() + PATIENCE
    while off(program.numbers(f"jpJP_{joined(NEAR)}"), NEAR) > 1e-3:
        assert time.monotonic() < deadline
    assert len(program.numbers(f"jpExT_{joined(NEAR)}")) == len(program.numbers(f"jpMT_{joined(NEAR)}")) == 7
    assert len(program.numbers(f"jpEEfP_{joined(NEAR)}")) == 6
    program.done("stopDirectServoJoints", "stDcEEf_")
    pose = program.numbers("Eef_pos")
    target = [pose[0] + 20.0, *pose[1:]]
    program.done(f"DcSeCarW_{joined(target)}\n")
    program.send(f"DcSeCar_{joined(target)}")
    while off(program.numbers(f"DcSeCarEEfP_{joined(target)}")[:3], target[:3]) > 0.5:
        assert time.monotonic() < deadline
    program.done("stopDirectServoJoints", "stVelDcJoint_")
    before = program.numbers("getJointsPositions")[6]
    while program.numbers(f"velJDCJP_{joined([0] * 6 + [0.3])}")[6] < before + 0.05:
        assert time.monotonic() < deadline
    program.done("stopDirectServoJoints")
    for spelling in ("startSmartImpedneceJoints", "startSmartImpedanceJoints"):
        q = program.numbers("getJointsPositions")
        program.done(f"{spelling}_0_0_0_0_1500_150_50_", f"jp_{joined(q)}")
        mode = arm.wait_until(lambda state: isinstance(state.mode, CartesianImpedance), timeout=PATIENCE).mode
        assert isinstance(mode, CartesianImpedance)
        assert mode.stiffness.tolist() == [1500.0] * 3 + [150.0] * 3
        program.done("stopDirectServoJoints")


def test_a_stop_of_somebody_else_is_not_undone_by_the_next_target(program: Program, arm: Arm) -> None:
    program.done("startDirectServoJoints", f"jp_{joined(HOME)}", f"jp_{joined(NEAR)}")
    deadline = time.monotonic() + PATIENCE
    while not np.abs(arm.state.dq).max() > 0.01:
        assert time.monotonic() < deadline
    arm.stop()
    rest = arm.wait_for_rest(timeout=PATIENCE)
    for _ in range(20):
        assert program.ask(f"jp_{joined(HOME)}") == "nak"
    assert off(arm.state.q.tolist(), rest.q.tolist()) < 1e-3
    program.done("stopDirectServoJoints", "startDirectServoJoints")
    while off(program.numbers(f"jpJP_{joined(NEAR)}"), NEAR) > 1e-3:
        assert time.monotonic() < deadline
    program.done("stopDirectServoJoints")


def test_tool_signals_and_state(program: Program, arm: Arm) -> None:
    program.done("TFtrans_0_0_100_0_0_0")
    assert (
        abs(arm.wait_until(lambda state: bool(state.tool), timeout=PATIENCE).pose.z - arm.pose("flange").z)
        > 0.05
    )
    for word in ("Torques_ext_J", "Torques_m_J"):
        assert len(program.numbers(word)) == 7
    for word in ("Eef_force", "Eef_moment"):
        assert len(program.numbers(word)) == 3
    program.done("blueOn", "blueOff", "pin1on", "pin12off")
    assert program.numbers("getPin3") == program.numbers("getPin16") == [0.0]


def test_refused_lines_and_garbage_change_nothing(program: Program) -> None:
    for line in (
        "doSomethingElse",
        "doPTP!inJSinf_0_1",
        "jRelVel_abc_",
        "jp_1_2_3",
        "TFtrans_1_2",
        "preciseHandGuiding1_0_0_0_0",
        "pin7on",
        "doPTP!inJS_9_1_2",
        "doPTP!inJS_1_5",
        f"cArtixanPosition_{joined([math.nan] * 5)}",
    ):
        assert program.ask(line) == "nak", line
    program.done("jRelVel_2_", f"jp_{joined(NEAR)}")
    assert program.ask("doPTPinJS") == "nak", "twice the speed"
    program.send("\n\n\n")
    program.connection.sendall(b"\xff\x00\xfe\n")
    assert program.answers.readline().strip() == "nak"
    assert off(program.numbers("getJointsPositions"), HOME) < 1e-3


def test_the_state_is_known_during_a_motion_and_its_program_may_go(program: Program, arm: Arm) -> None:
    program.done("jRelVel_0.05_", f"jp_{joined([1.5, *HOME[1:]])}", "doPTPinJS")
    deadline = time.monotonic() + PATIENCE
    while program.numbers("getJointsPositions")[0] < 0.02:
        assert time.monotonic() < deadline
    program.close()
    arm.wait_for_rest(timeout=PATIENCE)
    assert arm.state.q[0] < 1.0


def test_a_bridge_that_stood_still_takes_control_again_unless_another_has_it(cabinet: RunningCabinet) -> None:
    port = free_port()
    command = [
        sys.executable,
        "-m",
        "heptarm",
        "bridge",
        "kst",
        f"--port={port}",
        f"--target={cabinet.target}",
    ]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as bridge,
        ha.connect(cabinet.target, control=False, timeout=30.0) as other,
    ):
        assert bridge.stdout is not None
        program = Program(port)

        def stands_still() -> None:
            bridge.send_signal(signal.SIGSTOP)
            deadline = time.monotonic() + PATIENCE
            while other.controller:
                assert time.monotonic() < deadline, "the cabinet notices no silence"
                time.sleep(0.05)

        try:
            program.done("jRelVel_0.5_", f"jp_{joined(HOME)}")
            stands_still()
            bridge.send_signal(signal.SIGCONT)
            assert program.move("doPTPinJS") == "done", "it has taken control again"
            program.done("jRelVel_0.02_", f"jp_{joined(NEAR)}", "doPTPinJS")
            stands_still()
            bridge.send_signal(signal.SIGCONT)
            assert program.answers.readline().strip() == "nak", "the motion was ended, the bridge was not"
            program.done("jRelVel_0.5_")
            stands_still()
            other.take_control()
            bridge.send_signal(signal.SIGCONT)
            assert program.ask("doPTPinJS") == "nak"
            other.release_control()
            assert program.move("doPTPinJS") == "done"
        finally:
            program.close()
            bridge.send_signal(signal.SIGCONT)
            bridge.send_signal(signal.SIGINT)
            said = bridge.stdout.read()
    assert said.count("took it again") == 3 and "controls the robot" in said, said
