"""Applications of our own in the habits of other labs, on one virtual cabinet, driven by clients."""

from __future__ import annotations

import base64
import contextlib
import math
import socket
import struct
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from heptarm import _resources
from heptarm.errors import Timeout
from heptarm.fri import Client, CommandMode
from heptarm.sim.runtime import application, moved
from tests.cli.running import run
from tests.long import longer

pytestmark = pytest.mark.computing  # a compiler, and a program whose clock is the simulator's
LABS = Path(__file__).parent / "labs"
APPLICATIONS = (
    *("Motions", "BrakeCheck", "TaughtLine", "DataEditor", "BitOrders"),
    *("Bridge", "TouchSweep", "LcmLikeBridge", "OldServer", "ServoInteraction"),
)
#: Largest deviation of a joint from its target [rad].
MILLIRADIAN = 1e-3
#: Simulated seconds per second: a servo motion waits for the next target of its client, so time must not fly.
SPEED = "10"
MAGIC = 0x4C433032
PATIENCE = 240.0

LCM_TARGETS = ((0.1, 0.5, 0.1, -1.2, 0.1, 0.9, 0.1), (-0.15, 0.45, 0.0, -1.4, 0.0, 1.0, -0.2))
OLD_TARGETS = ((0.02, 0.42, 0.0, -1.28, 0.0, 1.02, 0.02), (0.05, 0.45, 0.02, -1.25, 0.02, 1.05, 0.05))
#: Where each application leaves the arm.
ENDS = {
    "Motions": (0.0, math.radians(30), 0.0, math.radians(-70), 0.0, math.radians(80), 0.0),
    "BrakeCheck": (0.1, 0.4, 0.0, -1.2, 0.0, 0.8, 0.0),
    "DataEditor": (0.2, 0.5, 0.1, -1.5, 0.0, 0.9, 0.0),
    "BitOrders": (0.3, 0.3, 0.0, -1.2, 0.0, 0.9, 0.2),
    "Bridge": (-0.2, 0.5, 0.1, -1.2, 0.1, 1.1, -0.1),
    "TouchSweep": (0.3, 0.4, 0.2, -1.3, 0.1, 1.0, 0.4),
    "LcmLikeBridge": LCM_TARGETS[-1],
    "OldServer": OLD_TARGETS[-1],
    "ServoInteraction": (0.1, 0.5, 0.0, -1.2, 0.0, 0.9, 0.0),
}
#: What else they report.
SAID = (
    "Motions true",
    "BrakeCheck true",
    "TaughtLine /Table/P1 P1 /Table/P2 P2 pick left tray true true place true true true true",
    "DataEditor true true true true true",
    "BitOrders Done:BOOLEAN:1:false Step:UNSIGNED_INTEGER:4 2 true",
    "Bridge true",
    "TouchSweep true true true",
    "ServoInteraction true true true true",
)


class Report:
    """The file that the applications write."""

    def __init__(self, file: Path, process: subprocess.Popen[str]) -> None:
        self._file, self._process = file, process

    def lines(self) -> list[str]:
        return self._file.read_text().splitlines() if self._file.exists() else []

    def until(self, beginning: str) -> str:
        """The rest of the line with this beginning; waits for it."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline and self._process.poll() is None:
            found = next((one for one in self.lines() if one.startswith(beginning)), None)
            if found is not None:
                return found.removeprefix(beginning)
            time.sleep(0.02)
        raise AssertionError(f"no line {beginning!r}: {self.lines()}")


def near(found: tuple[float, ...], target: tuple[float, ...]) -> bool:
    return max(abs(a - b) for a, b in zip(found, target, strict=True)) < MILLIRADIAN


def drive_by_datagrams(report: Report) -> None:
    port = int(report.until("LcmLikeBridge port ").split()[0])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as pc:
        pc.settimeout(PATIENCE)
        pc.sendto(b"not for it", ("127.0.0.1", port))
        for sequence, target in enumerate(LCM_TARGETS):
            pc.sendto(struct.pack(">ii7d", MAGIC, sequence, *target), ("127.0.0.1", port))
            magic, answered, *joints = struct.unpack(">ii7d", pc.recv(256))
            assert (magic, answered) == (MAGIC, sequence)
            assert near(tuple(joints), target)
        pc.sendto(struct.pack(">ii", MAGIC, -1), ("127.0.0.1", port))


def drive_by_lines(report: Report) -> None:
    port = int(report.until("OldServer port "))
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as pc, pc.makefile("rwb") as stream:

        def ask(words: str) -> bytes:
            stream.write(base64.b64encode(words.encode()) + b"\n")
            stream.flush()
            return stream.readline()

        assert ask("dance").split() == [b"unknown"]
        for target in OLD_TARGETS:
            assert ask("joints " + " ".join(map(str, target))).split() == [b"ok"]
        ask("end")


def listen(pc: socket.socket, heard: list[tuple[float, ...]]) -> Callable[[Report], None]:
    def until_it_ends(report: Report) -> None:
        report.until("Bridge -")
        pc.settimeout(0.0)
        while True:
            try:
                words = pc.recv(1024).decode().split()
            except BlockingIOError:
                return
            assert words[0] == "joint_states"
            heard.append(tuple(map(float, words[1:])))

    return until_it_ends


@pytest.fixture(scope="module")
def labs(tmp_path_factory: pytest.TempPathFactory) -> application.Survey:
    return application.survey(LABS, tmp_path_factory.mktemp("labs"))


def cabinet_of(main: str, labs: application.Survey, folder: Path, speed: str, **data: str | int) -> list[str]:
    """The command of a virtual cabinet that runs an application with process data, whose dots are underscores here."""
    one = next(one for one in labs.applications if one.main == main)
    given = {name.replace("_", "."): value for name, value in data.items()}
    numbers = "".join(
        f'<processData dataType="java.lang.Integer" id="{name}" value="{value}"/>'
        for name, value in given.items()
        if isinstance(value, int)
    )
    project = folder / "RoboticsAPI.data.xml"
    assert one.project is not None
    text = one.project.read_text().replace("<processDataContainer>", f"<processDataContainer>{numbers}")
    project.write_text(text)
    command = [sys.executable, "-m", "heptarm.sim.runtime.cabinet", "--application", main]
    command += ["--classpath", str(one.classes), "--speed", speed, "--project", str(project)]
    command += ["--station", str(one.station)]
    for name, value in given.items():
        command += ["--data", f"{name}={value}"]
    return command


def test_an_fri_sample_runs_to_its_end_with_its_client(tmp_path: Path, labs: application.Survey) -> None:
    """The client turns A7 by 0.05 rad, of a position and on a motion, then commands no wrench."""
    file = tmp_path / "report.txt"
    with Client(0) as client:
        data: dict[str, str | int] = {"lab_file": str(file), "lab_fri": client.port}
        command = cabinet_of("labs.FriSine", labs, tmp_path, "1", **data)
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as cabinet:
            start = client.wait("COMMANDING_ACTIVE", timeout=PATIENCE)
            pushes = False
            with contextlib.suppress(Timeout):
                for state in client:
                    if state.mode is CommandMode.WRENCH:
                        pushes = True
                        client.command(wrench=np.zeros(6))
                    elif pushes:  # the application closes its session
                        break
                    elif state.is_commanding:
                        turned = 0.05 * min(1.0, state.t - start.t)
                        client.command(q=state.q_ipo + turned * np.eye(7)[6])
            log = cabinet.communicate(timeout=PATIENCE)[0]
    said, where = file.read_text().splitlines()
    assert cabinet.returncode == 0 and said == "FriSine true true true", log
    assert near(tuple(map(float, where.split()[1:])), (0.0, 0.5, 0.0, -1.2, 0.0, 0.9, 0.1))


def test_applications_of_other_labs_run_and_are_driven_to_a_milliradian(
    tmp_path: Path, labs: application.Survey
) -> None:
    file = tmp_path / "report.txt"
    assert labs.failed == ()
    assert {f"labs.{name}" for name in APPLICATIONS} < {one.main for one in labs.applications}
    heard: list[tuple[float, ...]] = []
    failures: list[BaseException] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as pc:
        pc.bind(("127.0.0.1", 0))
        data: dict[str, str | int] = {
            "lab_file": str(file),
            "lab_applications": " ".join(APPLICATIONS),
            "lab_port": int(pc.getsockname()[1]),
        }
        command = cabinet_of("labs.Medley", labs, tmp_path, SPEED, **data)
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as cabinet:
            report = Report(file, cabinet)

            def guarded(drive: Callable[[Report], None]) -> None:
                try:
                    drive(report)
                except BaseException as error:  # shown by the test, whose other threads go on
                    failures.append(error)
                    cabinet.kill()

            drivers = (drive_by_datagrams, drive_by_lines, listen(pc, heard))
            threads = [threading.Thread(target=guarded, args=(one,)) for one in drivers]
            late = threading.Timer(2 * PATIENCE, cabinet.kill)
            for thread in (*threads, late):
                thread.start()
            log = cabinet.communicate()[0]
            late.cancel()
            for thread in threads:
                thread.join()
    assert failures == [], log
    assert cabinet.returncode == 0, log
    lines = report.lines()
    assert [one for one in lines if one.startswith("ended ")] == [f"ended {one} null" for one in APPLICATIONS]
    for said in SAID:
        assert said in lines
    for name, target in ENDS.items():
        found = next(
            one.split()[1:] for one in reversed(lines) if one.startswith(f"{name} ") and len(one.split()) == 8
        )
        assert near(tuple(map(float, found)), target), name
    assert len(heard) > 1
    assert near(heard[-1], ENDS["Bridge"])


def test_a_folder_of_projects_is_surveyed_class_by_class(tmp_path: Path) -> None:
    sources = tmp_path / "lab" / "one" / "src" / "app"
    sources.mkdir(parents=True)
    begin = "package app; import com.kuka.roboticsAPI.applicationModel.RoboticsAPIApplication;\n"
    good = "public class Good extends RoboticsAPIApplication { public void run() { } }"
    (sources / "Good.java").write_text(begin + good)
    bad = (
        "import com.google.flatbuffers.Table; public class Inertia extends Table { FlatBufferBuilder builder; "
        "com.kuka.roboticsAPI.deviceModel.LBR lbr; void run() { lbr.dance(); } }"
    )
    (sources / "Inertia.java").write_text(f"package app; {bad}")
    throws = good.replace("Good", "Throws").replace(
        "{ }", '{ throw new IllegalStateException("no gripper"); }'
    )
    (sources / "Throws.java").write_text(begin + throws)
    for name, field in (("Platform", "com.kuka.nav.robot.MobileRobot"), ("Newer", "com.kuka.geometry.Frame")):
        (sources / f"{name}.java").write_text(f"package app; class {name} {{ {field} one; }}")
    found = run("check", "--projects", str(tmp_path / "lab"), "--run", str(longer(0, 60)))
    assert found.returncode == 1
    if longer(False, True):  # two cabinets
        assert "ended    lab/one: app.Good" in found.stdout
        assert "fails    lab/one: app.Throws  java.lang.IllegalStateException: no gripper" in found.stdout
    else:
        assert "compiles lab/one: app.Good" in found.stdout
    assert "fails    lab/one: app.Inertia  package com.google.flatbuffers does not exist" in found.stdout
    assert "name the jar of com.google.flatbuffers with --jar" in found.stdout
    assert "method dance() of com.kuka.roboticsAPI.deviceModel.LBR" in found.stdout
    assert (
        "FlatBufferBuilder" not in found.stdout
    )  # what follows from the missing jar, and is none of Sunrise's
    assert "0 of 1 projects compile wholly; 2 of 5 classes" in found.stdout
    assert (
        "a mobile platform (KMR, KMP): the virtual cabinet has the arm only; it would need a" in found.stdout
    )
    assert (
        "for Sunrise.OS 2, whose packages differ: the virtual cabinet has 1.x; it would need" in found.stdout
    )


def test_names_of_older_releases_are_read_as_those_of_today() -> None:
    old = (
        "package lab;\n"
        "import com.kuka.roboticsAPI.motionModel.*; // SmartServoLIN is not used\n"
        "import com.kuka.connectivity.fri.FRISession;\n"
        "import sun.misc.BASE64Encoder;\n"
        "import com.kuka.connectivity.fri.example.FRIIOGroup;\n"
        "class A { SmartServo s; PTP p; com.kuka.roboticsAPI.motionModel.DirectServo d; BASE64Encoder e; }\n"
    )
    new = moved.renamed(old, frozenset(), lambda text: text.replace("// SmartServoLIN is not used", ""))
    motions = "com.kuka.connectivity.motionModel"
    assert new.splitlines() == [
        "package lab;",
        f"import com.kuka.roboticsAPI.motionModel.*; import {motions}.smartServo.SmartServo; "
        f"import {motions}.directServo.DirectServo; // SmartServoLIN is not used",
        "import com.kuka.connectivity.fastRobotInterface.FRISession;",
        "import heptarm.doubles.jre.BASE64Encoder;",
        "import com.kuka.connectivity.fri.example.FRIIOGroup;",
        f"class A {{ SmartServo s; PTP p; {motions}.directServo.DirectServo d; BASE64Encoder e; }}",
    ]
    own = frozenset({"sun.misc.BASE64Encoder", "com.kuka.connectivity.fri.FRISession"})
    kept = moved.renamed(old, own, lambda text: text)
    assert "import sun.misc.BASE64Encoder;" in kept
    assert "import com.kuka.connectivity.fri.FRISession;" in kept


def test_the_doubles_have_each_class_that_moved() -> None:
    offered = set()
    for jar in _resources.jars():
        with zipfile.ZipFile(jar) as file:
            offered |= set(file.namelist())
    for _, package, names in moved.MOVED:
        for name in names.split():
            assert f"{package.replace('.', '/')}/{name}.class" in offered
