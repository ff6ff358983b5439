"""What ships is what is tested: process data of private simulators, the fastest rate, and the speed of a real robot."""

from __future__ import annotations

from pathlib import Path

import pytest

import heptarm as ha
from heptarm import _resources
from heptarm.errors import LimitError
from heptarm.io.targets import SavedTarget, add_target, saved_targets
from heptarm.sim.runtime import cabinet as runtime
from heptarm.sim.runtime.project import read_process_data
from tests.arm.peer import Peer
from tests.conftest import RunningCabinet

SHIPPED = read_process_data(_resources.cabinet_sources() / "project" / "RoboticsAPI.data.xml").values
SPEED = 5.0


def test_a_private_simulator_takes_what_install_cabinet_writes() -> None:
    data = runtime.process_data(runtime.arguments([]))
    assert SHIPPED.items() - data.items() == {("heptarm.bind", "0.0.0.0")}  # it listens on this machine only
    assert set(data) == set(SHIPPED)
    assert data["heptarm.max_rate"] == 500.0


def test_a_rate_beyond_the_cabinets_names_the_setting_and_fri(cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, state_rate=500.0, timeout=30.0) as arm:
        with pytest.raises(LimitError, match=r"rate must be in \[0, 500\] Hz, got 1000 Hz") as error:
            arm.subscribe(rate=1000.0)
        assert "heptarm.max_rate" in error.value.hint and 'arm.fri("monitor")' in error.value.hint
        assert arm.state_rate == 500.0
    with pytest.raises(LimitError, match="FRI"):
        ha.connect(cabinet.target, state_rate=1000.0, timeout=30.0)


def test_a_real_robot_begins_at_a_quarter_of_its_speed() -> None:
    peer = Peer(virtual=False)
    arm = peer.arm()
    assert arm.speed == 0.25
    assert "at most 25% of each axis' maximum, as every real robot begins: arm.speed" in str(arm)
    arm.speed = 0.8
    assert arm.speed == 0.8 and "at most 80% of each axis' maximum: arm.speed" in str(arm)
    arm.close()
    peer.close()


def test_a_simulated_robot_begins_at_its_full_speed(cabinet: RunningCabinet) -> None:
    with ha.connect(cabinet.target, control=False, timeout=30.0) as arm:
        assert arm.speed == 1.0
        assert "simulated" in str(arm) and "at most 100%" in str(arm) and "observing" in str(arm)
    assert str(arm) == repr(arm)


def test_the_entry_of_a_target_comes_first(
    cabinet: RunningCabinet, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    add_target(SavedTarget("lab1", cabinet.target, speed=1.0))
    add_target(SavedTarget("lab2", cabinet.target))
    assert saved_targets()["lab1"].speed == 1.0 and saved_targets()["lab2"].speed is None
    with ha.connect("lab1", control=False, timeout=30.0) as arm:
        assert arm.speed == 1.0
    add_target(SavedTarget("lab3", cabinet.target, speed=0.4))
    with ha.connect("lab3", control=False, timeout=30.0) as arm:
        assert arm.speed == 0.4 and "at most 40%" in str(arm)
