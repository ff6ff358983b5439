"""The commands for FRI, as a user types them, on ports that are free."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.fri.loop.client import Client
from heptarm.values.pose import Pose
from tests.cli.running import HEPTARM, refused, run
from tests.interrupts import ctrl_c_interrupts


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Reported(list[Any]):
    """Output and input of a controller process."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        super().__init__()
        self._process = process

    def say(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()


@contextmanager
def controller(
    port: int, *arguments: str, version: str = "1.15", typed: bool = False
) -> Iterator[tuple[Any, Reported]]:
    """`heptarm sim fri`: its output, including its end."""
    command = [*HEPTARM, "sim", "--json", "--fri", version, "--fri-client", f"127.0.0.1:{port}"]
    with ctrl_c_interrupts():
        started = subprocess.Popen(
            [*command, "--fri-port", "0", *arguments],
            stdin=subprocess.PIPE if typed else None,
            stdout=subprocess.PIPE,
            text=True,
        )
    with started as process:
        assert process.stdout is not None
        reported = Reported(process)
        try:
            yield json.loads(process.stdout.readline()), reported
        finally:
            process.send_signal(signal.SIGINT)
            reported.extend(json.loads(line) for line in process.stdout)
            assert process.wait(timeout=30) == 0


def test_a_bare_controller_serves_any_client_and_reports_how_it_went() -> None:
    with Client(0, realtime=False) as client:
        with controller(client.port, "--fri-period", "10") as (ready, reported):
            assert ready["ready"] and ready["command"] == "position" and ready["port"] != client.port
            begin = client.wait("COMMANDING_ACTIVE", timeout=60.0).q.copy()
            goal = begin + 0.05
            for s in client:
                client.command(q=goal)
                if np.abs(s.q - goal).max() < 2e-3:
                    break
        client.wait("IDLE", timeout=20.0)  # the controller sends goodbye
    assert {"event": "StateChanged", "text": "session COMMANDING_WAIT -> COMMANDING_ACTIVE"} in reported
    assert reported[-1]["ended"] and reported[-1]["answers"]["on_time"] > 10 and reported[-1]["refused"] == 0


def test_a_bare_controller_has_signals_and_asks_for_frames() -> None:
    signals = ("--fri-io", "Cell.Door<bool", "--fri-io", "Cell.Part>u8", "--fri-io", "Cell.Level>analog")
    with (
        Client(0, realtime=False) as client,
        controller(
            client.port, "--fri-period", "10", *signals, "--fri-frame", "Part", version="2.7", typed=True
        ) as (_, reported),
    ):
        client.wait("COMMANDING_ACTIVE", timeout=60.0)
        assert client.inputs == {"Cell.Door": False} and client.outputs == {"Cell.Part": 0, "Cell.Level": 0.0}
        assert client.wanted_frames == ("Part",)
        client.frame("Part", Pose.at(0.5, 0.0, 0.1))
        client.output("part", 7)
        client.output("Cell.Level", 0.5)
        reported.say("set Cell.Door true")
        for s in client:
            if s.io.door and s.io.part == 7 and s.io.level == 0.5:
                break
        reported.say("set Cell.Door 3")
        reported.say("open the door")
    texts = [one.get("text", "") for one in reported]
    for line in ("output Cell.Part = 7", "output Cell.Level = 0.5", "frame Part = 500, 0, 100, 1, 0, 0, 0"):
        assert line in texts


def test_a_bare_controller_has_a_posture_an_impedance_a_force_and_faults() -> None:
    options = ("--fri-mode", "joint-impedance", "--fri-stiffness", "500", "--fri-force", "0,0,-20")
    start = (10.0, 20.0, 0.0, -80.0, 0.0, 70.0, 5.0)
    posture = ("--fri-start", ",".join(map(str, start)), "--fault", "emergency_stop@60", "--payload", "1")
    with (
        Client(0, realtime=False) as client,
        controller(client.port, "--fri-period", "10", *options, *posture, version="2.7", typed=True) as (
            _,
            reported,
        ),
    ):
        state = client.wait("COMMANDING_ACTIVE", timeout=60.0)
        assert state.q_ipo == pytest.approx(np.radians(start), abs=0.02)
        assert state.wrench[2] < -20.0  # the force, and the payload that the controller does not know of
        for s in client:
            deflection = s.tau_ext / 500.0
            if np.abs(deflection).max() > 0.01 and s.q - s.q_ipo == pytest.approx(deflection, abs=2e-3):
                break
        reported.say("emergency_stop")
        client.wait("MONITORING_READY", timeout=30.0)
        reported.say("clear")
        client.wait("COMMANDING_ACTIVE", timeout=30.0)
    ends = [one["text"] for one in reported if one.get("event") == "OverlayEnded"]
    ends = [
        text for text in ends if "connection quality" not in text
    ]  # a busy machine answers late, and it begins again
    assert len(ends) == 2 and "safety stop" in ends[0]


def test_torques_begin_on_an_impedance_that_holds_the_arm() -> None:
    with (
        Client(0, realtime=False) as client,
        controller(client.port, "--fri-command", "torque", "--fri-force", "0,0,-20"),
    ):
        begin = client.wait("COMMANDING_ACTIVE", timeout=60.0).q.copy()
        for s in client:
            assert np.abs(s.q - begin).max() < 0.35  # swings to 0.2 under the force; without stiffness to 0.6
            if s.t > 0.5:
                break


def test_the_network_of_a_bare_controller_has_faults() -> None:
    faults = ("--fri-network", "loss=0.5", "--fri-network", "delay=0.001")
    with Client(0, realtime=False) as client, controller(client.port, *faults) as (_, reported):
        client.wait("MONITORING_WAIT", timeout=60.0)
        for _ in zip(range(30), client, strict=False):
            pass
    assert reported[-1]["answers"]["lost"] > 5


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("--fri", "1.99"), "must be one of"),
        (("--fri", "1.15", "--fri-command", "pose"), "use FRI 2.5 or later"),
        (("--fri", "1.15", "--fri-command", "torque", "--fri-period", "10"), "got 10 ms"),
        (("--fri", "1.15", "--fri-period", "2.5"), "whole number of milliseconds"),
        (("--fri", "1.15", "--fri-io", "Cell.Door"), "must be GROUP.NAME<TYPE"),
        (("--fri", "1.11", "--fri-io", "Cell.Door<bool"), "use FRI 1.14 or later"),
        (("--fri", "1.15", "--fri-frame", "x" * 64), "63 bytes"),
        (("--fri", "1.15", "--fri-client", "here"), "no IPv4 address"),
        (("--fri", "1.15", "--fri-client", "127.0.0.1:x"), "HOST:PORT"),
        (("--fri", "1.15", "--fri-start", "0,30,0"), "--fri-start must be 7 finite numbers"),
        (("--fri", "1.15", "--fri-start", "0,130,0,0,0,0,0"), "A2 must be in [-120, 120] deg"),
        (("--fri", "1.15", "--fri-stiffness", "300"), "--fri-stiffness needs an impedance"),
        (("--fri", "1.15", "--fri-mode", "joint-impedance", "--fri-stiffness", "9000"), "[0, 5000] Nm/rad"),
        (
            ("--fri", "1.15", "--fri-command", "torque", "--fri-mode", "position"),
            "not possible in control mode",
        ),
        (("--fri", "1.15", "--fri-force", "1,2"), "--fri-force must be 3 finite numbers"),
        (("--fri", "1.15", "--fri-network", "luck=1"), "one of loss, duplicate"),
        (("--fri", "1.15", "--fri-network", "loss=2"), "loss must be in [0, 1]"),
        (("--fri", "1.15", "--fault", "explode@1"), "not understood"),
        (("--fri", "1.15", "--key-file", "x"), "--key-file cannot be used with heptarm sim fri"),
    ],
)
def test_what_no_cabinet_would_do_is_refused_in_words(arguments: tuple[str, ...], why: str) -> None:
    done = refused("sim", *arguments, "--fri-port", "0")
    misused = "cannot be used" in why  # the command, and not the value of an option
    assert done.returncode == (2 if misused else 1) and why in done.stderr and "Traceback" not in done.stderr


def test_messages_of_any_application_are_recorded(tmp_path: Path) -> None:
    port, path = free_port(), tmp_path / "fri.mcap"
    with controller(port, "--fri-period", "10", "--fri-force", "0,0,-20"):
        done = run("record", str(path), "--listen", "--fri-port", str(port), "--for", "1.5", "--json")
    assert done.returncode == 0, done.stderr
    reported, recorded = json.loads(done.stdout), ha.load(path)
    assert reported["lost"] == 0 and reported["cycles"] >= len(recorded["fri.t"]) > 10
    assert recorded["fri.wrench"][-1, 2] == pytest.approx(-20.0, abs=1.0), (
        "estimated: this version sends none"
    )
