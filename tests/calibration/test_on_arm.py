"""Calibration on a virtual cabinet with noisy sensors and a load that it does not know: one cabinet for all of it."""

from __future__ import annotations

import io
import logging
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm import calibration, model, modes
from heptarm.arm.motion.load_check import WARN, LoadCheck
from heptarm.cli import calibrate
from heptarm.cli.options import Access, CommandTarget
from heptarm.io.targets import SavedTarget, add_target, saved_targets
from tests.simulators import FASTER

TRUE = ha.Tool("true", mass=2.0, com=(0.01, -0.02, 0.08))
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
TIP = np.array([0.012, -0.034, 0.187])
POINT = np.array([0.55, 0.0, 0.25])


@pytest.fixture(scope="module")
def arm() -> Iterator[ha.Arm]:
    target = f"sim://iiwa14?speed={FASTER:g}&sensors=noisy:7&payload=2,0.01,-0.02,0.08"
    with ha.connect(target, state_rate=500.0, watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(HOME))
        yield arm


@pytest.fixture(autouse=True)
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))


def test_a_load_is_measured_and_compared(arm: ha.Arm) -> None:
    declared = ha.Tool("gripper", mass=1.2, com=(0, 0, 0.06), tcp=ha.Pose.at(0, 0, 0.15))
    with arm.tool(declared):
        begin = arm.state.q_cmd
        plan = calibration.load_plan(arm, speed=0.6, seconds=1.0)
        shown: list[str] = []
        with pytest.raises(ha.CommandRejected, match="nothing moves"):
            calibration.load(arm, plan=plan, confirm=lambda plan: bool(shown.append(str(plan))))
        assert np.abs(arm.state.q_cmd - begin).max() < 1e-6
        assert "A4 +0 to +30, A5 -90 to +90" in shown[0] and "at most 60%" in shown[0]
        found = calibration.load(arm, plan=plan)
        assert np.abs(arm.state.q_cmd - begin).max() < 1e-6
        assert arm.state.tool == "gripper" and arm.tools["gripper"].mass == 1.2  # nothing is changed
    assert abs(found.mass - 2.0) <= min(0.04, 3.0 * found.sigma_mass)
    assert np.linalg.norm(found.com - TRUE.com) <= 3e-3
    assert found.comparison.startswith("declared 1.2 kg, measured ") and not found.is_as_declared

    add_target(SavedTarget("lab1", "172.31.1.147"))
    saved = found.save("lab1", declared)
    assert saved_targets()["lab1"].tools == (saved,) and saved.tcp == declared.tcp


def test_a_load_beyond_the_rating_is_refused_before_it_moves(
    arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    heavy = ha.Tool("heavy", mass=30.0)
    moved: list[object] = []
    monkeypatch.setattr(ha.Arm, "move", lambda *given, **more: moved.append(given))
    with pytest.raises(ha.LimitError, match="rated load"):
        calibration.load(arm, declared=heavy.body)  # 32 kg
    assert not moved


def test_a_tool_that_touches_something_is_named_as_a_cause(
    arm: ha.Arm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drive trips where the arm is held; load data and tools are those of before."""

    def trips(*given: object, **more: object) -> None:
        raise ha.MotionAborted("drive error in A4: -2.9 deg behind its set-point", hint="clear its cause")

    before = arm.load, dict(arm.tools)
    plan = calibration.load_plan(arm)
    monkeypatch.setattr(ha.Arm, "move", trips)
    with pytest.raises(ha.MotionAborted, match=r"the load is not measured, .*touched something.*; clear its"):
        calibration.load(arm, plan=plan)
    assert (arm.load, dict(arm.tools)) == before


def test_verify_load_warns_and_refuses(arm: ha.Arm, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "heptarm.arm"):
        found = arm.verify_load()
    assert "measure the load" in caplog.text and not found.is_fine
    assert 1.6 < found.mass < 2.6 and found.axis in (2, 4)
    with pytest.raises(ha.NotReady, match=r"the load data leave .* Nm of A\d.*at most 2.0% are allowed"):
        arm.verify_load(refuse=0.02)
    with arm.tool(TRUE):
        caplog.clear()
        assert arm.verify_load().is_fine and abs(arm.verify_load().mass) < 0.3
        arm.move(ha.hold(0.05), mode=modes.JointImpedance(500.0))
        assert "sinks" not in caplog.text

    def shows(state: ha.State) -> bool:
        found = LoadCheck.of(arm.robot, state.q, state.tau_ext)
        return isinstance(state.mode, modes.Position) and found.fraction > 1.05 * WARN

    arm.wait_until(shows)
    with caplog.at_level(logging.WARNING, "heptarm.arm"):
        arm.move(ha.hold(0.05), mode=modes.JointImpedance(500.0))
    assert "a compliant arm sinks under a load that it does not know" in caplog.text


def test_a_motion_that_would_sink_far_is_refused_and_a_contact_is_not(arm: ha.Arm) -> None:
    compliant, refused = (
        modes.JointImpedance(500.0),
        r"the load data leave .* at most 8\.0% are allowed before",
    )
    arm.operator.start_push((0.0, 0.0, -50.0), duration=60.0)  # as five more kilograms
    arm.wait_until(lambda state: LoadCheck.of(arm.robot, state.q, state.tau_ext).weight > 0.1)
    for begin in (
        lambda: arm.move(ha.hold(0.05), mode=compliant),
        lambda: arm.start([ha.hold(0.05), ha.hold(0.05)], mode=compliant),
        lambda: arm.servo("joint", mode=compliant),
        lambda: arm.fri("torque", mode=compliant),
    ):
        with pytest.raises(ha.NotReady, match=refused):
            begin()
    assert isinstance(arm.state.mode, modes.Position)
    arm.operator.start_push((0.0, 0.0, 70.0), duration=60.0)  # it leans on a table
    arm.wait_until(lambda state: state.wrench.force[2] > 40.0)
    arm.move(ha.hold(0.05), mode=modes.JointImpedance(1000.0))
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    arm.move(ha.ptp(HOME))


def test_the_tip_from_confirmed_poses(arm: ha.Arm) -> None:
    home = ha.Pose.from_matrix(model.forward(arm.robot, HOME))
    turns = [home.rotated(*ha.deg(*abc)) for abc in ((0, 30, 0), (25, -30, 0), (-25, 0, 30), (0, 0, -30))]
    asked: list[str] = []
    goals = [turns[0], *turns]  # the first one twice: the second time it is not counted

    def confirm(text: str) -> bool:
        turn = goals[len(asked)]
        asked.append(text)
        flange = ha.Pose.of(POINT - turn.rotation @ TIP, turn.quat)
        arm.move(ha.ptp(model.solve(arm.robot, flange, near=HOME)))
        return True

    found = calibration.tcp(calibration.record_poses(arm, count=4, confirm=confirm))
    assert np.linalg.norm(found.pose.xyz - TIP) < 0.3e-3 and np.linalg.norm(found.point - POINT) < 1e-3
    assert len(asked) == 5 and "deg from pose 1, tilt the flange more; pose 2 of 4" in asked[2]
    with pytest.raises(ha.CommandRejected, match="pose 1 of 4 was not confirmed"):
        calibration.record_poses(arm, confirm=lambda text: False)
    arm.move(ha.ptp(HOME))


def test_the_command_shows_what_would_move_and_gives_up(
    arm: ha.Arm, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cabinet = arm.connection.cabinet
    assert cabinet is not None
    target = CommandTarget(text=f"sim://{cabinet.host}:{cabinet.port}")
    assert calibrate.load(dry_run=True, access=Access(target=target)) == 0
    assert "A1 to A3 stay" in capsys.readouterr().out
    with pytest.raises(ha.CommandRejected, match="is not a saved target"):
        calibrate.load(save="gripper", access=Access(target=target))
    monkeypatch.setattr("sys.stdin", io.StringIO("q" + os.linesep))
    with pytest.raises(ha.CommandRejected, match="pose 1 of 6 was not confirmed"):
        calibrate.tcp(access=Access(target=target))


def test_an_unsuited_posture_is_refused(arm: ha.Arm) -> None:
    arm.move(ha.ptp(np.zeros(7)))
    plan = None
    try:
        plan = calibration.load_plan(arm)
    except ha.CommandRejected as error:
        assert "not suited" in str(error)
    else:
        assert np.ptp(plan.postures, axis=0)[3:].min() > 0.5
    with pytest.raises(ha.CommandRejected, match="does not rest any more"):
        calibration.load(arm, plan=calibration.load_plan(arm) if plan is None else _elsewhere(plan))


def _elsewhere(plan: calibration.LoadPlan) -> calibration.LoadPlan:
    from dataclasses import replace

    return replace(plan, postures=plan.postures + 0.1)
