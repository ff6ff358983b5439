"""The media flange of a connected robot: stated, taken from a project, and compared with what the cabinet reports."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.flange_check import flange_warning
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import Target, parse_target
from heptarm.errors import CommandRejected, ConnectFailed
from heptarm.io.targets import SavedTarget, add_target
from heptarm.model import forward
from heptarm.values.pose import Pose, Redundancy
from heptarm.values.robot import FLANGES, robot
from heptarm.values.state import Cartesian, Joints
from tests.sim.station_setup import setup

PROJECT = "<persistence><processDataContainer/></persistence>"
Q = ha.deg(10, 20, 30, -80, 20, 40, 50)


@pytest.fixture(scope="module")
def touch() -> Iterator[str]:
    """Target of a running simulator whose robot has a Media Flange Touch."""
    running = PrivateCabinet.start(Target(model="iiwa14", options=(("flange", "touch"), ("speed", "5"))))
    assert running.model == "iiwa14+touch"
    yield f"sim://{running.host}:{running.port}"
    running.close()


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]


def test_the_flange_of_a_robot_is_stated_at_connect(touch: str, caplog: pytest.LogCaptureFixture) -> None:
    with ha.connect(touch, flange="touch", timeout=30.0, watchdog=5.0) as arm:
        assert arm.robot.name == "iiwa14+touch"
        assert forward(arm.robot, arm.state.q)[:3, 3] == pytest.approx(arm.state.pose.xyz, abs=1e-6)
        plan = arm.plan(ha.lin_rel(z=-0.05))
        arm.move(ha.lin_rel(z=-0.05))
        assert plan.tcp[-1][:3] == pytest.approx(arm.state.pose.xyz, abs=2e-3)
    assert warnings(caplog) == []


def test_a_flange_that_nobody_stated_is_named_at_connect(
    touch: str, caplog: pytest.LogCaptureFixture
) -> None:
    with ha.connect(touch, control=False, timeout=30.0) as arm:
        assert arm.robot.flange is FLANGES["plain"]
    (text,) = warnings(caplog)
    assert "26.0 mm" in text and 'connect with flange="touch"' in text


def test_the_flange_of_a_saved_target(
    touch: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    add_target(SavedTarget("lab1", touch, flange="touch"))
    with ha.connect("lab1", control=False, timeout=30.0) as arm:
        assert arm.robot.flange is FLANGES["touch"]
    assert warnings(caplog) == []
    with pytest.raises(CommandRejected, match='flange must be "touch", which the target .* got "plain"'):
        ha.connect("lab1", flange="plain")
    with pytest.raises(CommandRejected, match="flange must be one of plain, touch"):
        add_target(SavedTarget("lab2", touch, flange="tuch"))
    with pytest.raises(ConnectFailed, match="flange must be one of plain, touch"):
        parse_target("sim://iiwa14?flange=tuch")


def test_a_private_simulator_gets_the_stated_flange_or_the_projects(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert parse_target("sim://iiwa14").with_flange("touch").options == (("flange", "touch"),)
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "RoboticsAPI.data.xml").write_text(PROJECT)
    (tmp_path / "StationSetup.cat").write_text(setup())
    with ha.connect(
        f"sim://iiwa14?project={tmp_path}/src/RoboticsAPI.data.xml", control=False, timeout=30.0
    ) as arm:
        assert arm.robot.name == "iiwa14+touch"  # the flange of the station setup, and the stated robot
    (text,) = warnings(caplog)
    assert "the project is for an iiwa7" in text and "simulated is an iiwa14+touch" in text


# ------------------------------------------------------------------------------------- the comparison itself


def compared(stated: float, true: float, *, dq: float = 0.0, late: int = 0, off: float = 0.0) -> str | None:
    arm = robot("iiwa14", flange=stated)
    joints = Joints(1_000_000_000, Q, Q, np.full(7, dq))
    there = Pose.from_matrix(forward(robot("iiwa14", flange=true), Q))
    there = Pose.of(there.xyz + [off, 0, 0], there.quat)
    reported = Cartesian(1_000_000_000 + late, there, there, Redundancy())
    return flange_warning(arm, joints, reported, Pose.from_matrix(forward(arm, Q)))


def test_a_deviation_names_the_flange_that_explains_it() -> None:
    assert compared(0.0, 0.0) is None and compared(0.026, 0.026) is None
    assert compared(0.0, 0.0009) is None
    assert 'connect with flange="touch"' in str(compared(0.0, 0.026))
    assert 'connect with flange="plain"' in str(compared(0.026, 0.0))
    assert "connect with flange=0.0350" in str(compared(0.0, 0.035))
    assert "no media flange explains that" in str(compared(0.0, 0.0, off=0.01))


def test_samples_of_different_moments_of_a_motion_are_no_deviation() -> None:
    assert compared(0.0, 0.0, off=0.005) is not None
    assert compared(0.0, 0.0, off=0.005, dq=0.5, late=2_000_000) is None
    assert compared(0.0, 0.0, off=0.005, dq=float("nan"), late=2_000_000) is not None
