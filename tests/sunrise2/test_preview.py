"""The preview for Sunrise 2.x: what it names, writes and reports, and what of it runs on doubles of those names."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import heptarm as ha
from heptarm import testing
from heptarm.arm.translate.state import _READERS
from heptarm.cli.install_cabinet import install_cabinet
from heptarm.errors import CommandRejected, StaleState
from heptarm.modes import CartesianImpedance, JointImpedance
from heptarm.testing import Verdict
from heptarm.wire import messages as wire
from tests.cli.running import refused, run

ROOT = Path(__file__).parents[2]
APP, DOUBLES = ROOT / "cabinet" / "app2", ROOT / "cabinet" / "doubles2" / "src"
#: What public programs for Sunrise 2.x use, by package; the names of FRI are those of both generations.
KNOWN = {
    "com.kuka.device": {"ForceData"},
    "com.kuka.device.common": {"JointPosition"},
    "com.kuka.fri": {
        "FRIChannelInformation",
        "FRIConfiguration",
        "FRIJointOverlay",
        "FRISession",
        "IFRISessionListener",
    },
    "com.kuka.fri.api.commanding": {"EClientCommandMode", "IFriCommanding"},
    "com.kuka.fri.api.monitoring": {
        *(
            "IFriChannelInformation",
            "IFriConfiguration",
            "IFriMonitoring",
            "IFriSession",
            "IFriSessionListener",
        ),
    },
    "com.kuka.fri.common": {"ClientCommandMode"},
    "com.kuka.geometry": {"Frame", "LocalFrame"},
    "com.kuka.io": {"IIoDefinition", "IIoDefinitionProvider", "IIoValueProvider"},
    "com.kuka.math.geometry": {"Transformation", "Vector3D"},
    "com.kuka.motion": {"IMotion", "IMotionContainer", "IMotionContainerListener", "MotionContainerState"},
    "com.kuka.roboticsAPI.applicationModel": {"IApplicationControl", "RoboticsAPIApplication"},
    "com.kuka.roboticsAPI.motionModel": {"ErrorHandlingAction", "IMotionErrorHandler"},
    "com.kuka.roboticsAPI.motionModel.BasicMotions": {"linRel", "positionHold", "ptp"},
    "com.kuka.roboticsAPI.motionModel.controlModeModel": {
        "AbstractMotionControlMode",
        "CartDOF",
        "PositionControlMode",
    },
    "com.kuka.sensitivity": {"LBR"},
    "com.kuka.sensitivity.controlmode": {"CartesianImpedanceControlMode", "JointImpedanceControlMode"},
    "com.kuka.servoing.api.common": {"IServoingCapability"},
    "com.kuka.servoing.api.smartservo": {"ISmartServo", "ISmartServoRuntime"},
    "com.kuka.task": {"ITaskLogger"},
}
#: Scenarios that need nothing that is unknown of 2.x.
SCENARIOS = (
    *("model.forward", "model.inverse", "model.in_bulk", "model.limits"),
    *("state.velocity", "state.stream", "state.every", "state.mode", "link.clock"),
    *("motions.ptp_joints", "motions.named", "motions.position_hold", "motions.reach"),
    *("programs.queue", "programs.replace", "programs.cancel", "programs.stop", "programs.error"),
    *(
        "servo.joints",
        "servo.jump",
        "servo.exclusive",
        "laws.minimum_jerk",
        "signals.message",
        "safety.kinds",
    ),
)
SIGNALS = "MediaFlange.OutputX3Pin1>bool MediaFlange.InputX3Pin3<bool MediaFlange.Nothing.x<bool"


def test_it_imports_only_names_of_public_programs() -> None:
    named: dict[str, set[str]] = {}
    for path in APP.rglob("*.java"):
        for package, name in re.findall(r"import (?:static )?(com\.kuka[\w.]*)\.(\w+);", path.read_text()):
            named.setdefault(package, set()).add(name)
    assert named == KNOWN


def test_install_cabinet_writes_it_with_a_key_and_one_release_of_fri(tmp_path: Path) -> None:
    out = tmp_path / "two"
    assert install_cabinet(out=out, sunrise=2, fri="3.0", as_json=True) == 0
    folder = out / "src" / "heptarm" / "app2"
    assert "com.kuka.fri.api" in (folder / "Sunrise2Fri.java").read_text()
    settings = folder / "Settings.java"
    key = (out / "heptarm.key").read_text().strip()
    assert f'{{"heptarm.key", "{key}"}}' in settings.read_text() and settings.stat().st_mode & 0o777 == 0o600
    assert "never run" in (out / "INSTALL.md").read_text() and not (out / "src" / "heptarm" / "app").exists()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--sunrise", "3"), "--sunrise must be 1 or 2"),
        (("--sunrise", "2", "--fri", "1.15"), "--fri must be one of 2.5, 3.0"),
        (("--fri", "2.5"), "--fri is for --sunrise 2"),
        (("--sunrise", "2", "--without", "fri"), "--without is for --sunrise 1"),
    ],
)
def test_install_cabinet_refuses_what_it_cannot_write(
    tmp_path: Path, words: tuple[str, ...], text: str
) -> None:
    done = refused("install-cabinet", "--out", str(tmp_path / "new"), *words)
    assert done.returncode != 0 and text in done.stderr and not (tmp_path / "new").exists()


def test_an_unknown_safety_state_is_never_fine() -> None:
    bits = wire.SafetyBits.UNKNOWN | wire.SafetyBits.MOVING
    safety = _READERS["safety"](wire.SafetyState(stamp=1, bits=bits, mode=wire.OperationMode.UNKNOWN))
    assert safety.moving is True and not safety.is_known
    assert safety.ready_to_move is None and safety.emergency_stop is None and safety.mastered is None
    assert "unknown" in str(safety) and not safety.stops


@pytest.fixture(scope="module", params=["2.5", "3.0"])
def address(request: pytest.FixtureRequest) -> Iterator[str]:
    """A virtual cabinet of 2.x with each of the two generations of FRI."""
    subprocess.run([sys.executable, str(ROOT / "cabinet" / "build.py"), "--sunrise2"], check=True)
    program = [
        sys.executable,
        "-m",
        "tests.sunrise2.virtual",
        request.param,
        "--model",
        "med7",
        "--port",
        "0",
    ]
    program += ["--data", f"heptarm.io={SIGNALS}", "--parent-pipe"]
    program += [
        "--data",
        "heptarm.heartbeat=2.0",
        "--fri-version",
        "2.7" if request.param == "3.0" else "2.5",
    ]
    with subprocess.Popen(
        program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        ready = json.loads(process.stdout.readline())
        yield f"127.0.0.1:{ready['port']}"
        process.stdin.close()
        process.wait(timeout=60)


@pytest.mark.long
def test_what_is_known_runs_and_the_rest_is_refused(address: str, caplog: pytest.LogCaptureFixture) -> None:
    with ha.connect(address, timeout=30.0, watchdog=5.0) as arm:
        assert "never run on such a cabinet; it can: " in caplog.text and "sunrise2_preview" in caplog.text
        report = testing.run(arm, only=SCENARIOS, ask=lambda question: True)
        shown = {outcome.scenario.name for outcome in report.outcomes if outcome.verdict is Verdict.SHOWN}
        assert shown == set(SCENARIOS), [(o.scenario.name, o.text) for o in report.outcomes]

        arm.move(ha.ptp([0.1, 0.5, 0.0, -1.4, 0.0, 1.2, 0.3]))
        arm.move(ha.lin_rel(z=-0.05))
        arm.move(ha.hold(0.2), mode=JointImpedance(stiffness=500.0))
        arm.move(ha.hold(0.2), mode=CartesianImpedance(stiffness={"xyz": 500.0, "abc": 50.0}))
        arm.io["MediaFlange.OutputX3Pin1"] = True
        assert arm.io["MediaFlange.OutputX3Pin1"] is True and arm.io["Med.BrakeTest"] == 1
        assert set(arm.io) == {"MediaFlange.OutputX3Pin1", "MediaFlange.InputX3Pin3", "Med.BrakeTest"}

        for attempt in (
            lambda: arm.move(ha.lin(arm.state.pose)),
            lambda: arm.set_override(0.5),
            arm.pause,
            lambda: arm.pad.process_data("x"),
            lambda: arm.pad.ask("Go on?", "Yes"),
            lambda: arm.move(ha.ptp(arm.state.q), mode=JointImpedance(stiffness=500.0)),
        ):
            with pytest.raises(CommandRejected, match=r"does not support"):
                attempt()
        assert "this cabinet reports no safety state" in str(arm.recover())
        with pytest.raises(StaleState, match="does not report the commanded pose"):
            _ = arm.state.pose_cmd
    verdict = run("doctor", "--target", address, "--json")
    assert "a preview for Sunrise 2.x, never run on such a cabinet" in verdict.stdout
    assert "reports neither safety state nor readiness" in verdict.stdout
    assert "readiness and stops unknown" in run("state", "--target", address).stdout
