"""The arithmetic of a tick does what its oracle in Python does: two plants follow the same scripts."""

from __future__ import annotations

import subprocess
import sys
from array import array
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
import pytest

from heptarm._library import Unavailable
from heptarm.planning.seam import StateWords
from heptarm.planning.table import MANY, MotionTable, SetPointRows
from heptarm.sim.control_laws.laws import MeasuredState, PositionLaw
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant import native
from heptarm.sim.plant import plant as plant_module
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.robot import ROBOTS
from tests.oracles.set_points import ahead
from tests.oracles.tick import PythonTick, position_torque
from tests.sim import motions
from tests.sim.driving import READY
from tests.sim.plant_scripts import PLANT_SCRIPTS

#: Words of a state that are integers.
WHOLE = [
    StateWords.SEQ,
    StateWords.TIME,
    StateWords.FLAGS,
    StateWords.MODE,
    StateWords.ORDER,
    StateWords.STATUS,
    StateWords.TURN,
]
#: Sums of products are rounded otherwise than numpy's; the arm's feedback keeps that from growing. A last digit of a
#: set-point is a millionth of an acceleration [rad, rad/s; Nm, N].
SAME, SAME_LOAD = 2e-12, 1e-9


@contextmanager
def in_python(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """With the oracles instead of the compiled parts."""
    with monkeypatch.context() as patched:
        patched.setattr(plant_module, "NativeTick", PythonTick)
        patched.setattr(SetPointRows, "compute", _compute)
        patched.setattr(PositionLaw, "_undisturbed", staticmethod(position_torque))
        yield


def _compute(rows: SetPointRows, table: MotionTable, time: float, step: float, last: Array) -> int:
    """`SetPointRows.compute` by its oracle."""
    times, places, joints = ahead(table, time, step, last, rows._leap)
    count = len(times)
    rows.times[:count], rows.places[:count] = array("d", times), array("d", places)
    rows.joints, rows.is_last = joints, count < MANY
    return count


@pytest.mark.parametrize("name", PLANT_SCRIPTS)
def test_every_state_of_a_script_is_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = PLANT_SCRIPTS[name].record()
    with in_python(monkeypatch):
        expected = PLANT_SCRIPTS[name].record()
    assert (found[:, WHOLE].view(np.int64) == expected[:, WHOLE].view(np.int64)).all()
    off = np.abs(np.nan_to_num((found - expected) / np.maximum(1.0, np.abs(expected))))
    torques = [StateWords.TAU, StateWords.TAU_EXT, StateWords.TAU_CMD, StateWords.WRENCH]
    assert max(off[:, words].max() for words in torques) < SAME_LOAD
    for words in torques:
        off[:, words] = 0.0
    assert off.max() < SAME
    assert (np.isnan(found) == np.isnan(expected)).all()
    assert np.ptp(found[:, StateWords.Q], axis=0).max() > 1e-3  # something has moved


@pytest.mark.parametrize("seed", range(20))
def test_the_law_of_position_control_is_that_of_its_oracle(seed: int) -> None:
    chance = np.random.default_rng(seed)
    full = chance.normal(size=(9, 9))  # of a world with two more joints
    vectors = chance.normal(size=(7, 7))
    sensed = MeasuredState(vectors[0], vectors[1], full[:7, :7], *vectors[2:])
    expected = position_torque(sensed)
    scale = 1.0 + np.abs(full[:7, :7]).sum(axis=1) * 4e6
    assert (np.abs(PositionLaw().torque(sensed) - expected) < 1e-15 * 16 * scale).all()
    preload = chance.normal(size=7)
    locked = PositionLaw(preload, is_locked=True).torque(sensed)
    assert (np.abs(locked - expected - preload) < 1e-15 * 16 * scale).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_a_written_state_is_that_of_the_oracle(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """At random postures, on straight arms too, where status and quaternion change."""
    found = Plant(name, q=READY)
    with in_python(monkeypatch):
        expected = Plant(name, q=READY)
    chance, low, high = np.random.default_rng(4), found.robot.q_min, found.robot.q_max
    for k in range(200):
        q = chance.uniform(low, high) * chance.integers(0, 2, 7)
        for plant in (found, expected):
            plant.data.qpos[:7] = q
            plant._native.write(k, q, words=(1, 2, 3), times=(0.5, 1.5))
            plant._native.publish(k)
        one, other = (plant.shared.read(k) for plant in (found, expected))
        assert one is not None and other is not None
        assert (one[WHOLE].view(np.int64) == other[WHOLE].view(np.int64)).all()
        w = StateWords.POSE.stop - 1
        if abs(one[w]) < 1e-9:  # a half turn: both quaternions mean it
            one[w - 3 : w + 1] *= np.sign(one[w - 3 : w] @ other[w - 3 : w])
        assert np.abs(one - other).max() < 1e-14


def test_a_mujoco_that_does_not_show_its_functions_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native, "_CALLED", {"mj_no_such_function": "step1"})
    with pytest.raises(Unavailable, match="shows no mj_no_such_function"):
        Plant("iiwa7", q=READY)


def test_a_motion_in_position_control_is_computed_in_c_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    plant = Plant("iiwa14", q=READY)
    plant.submit(MotionCommand(1, motions.ptp(tuple(q + 0.1 for q in READY))))
    with monkeypatch.context() as patched:
        for name in ("mj_step1", "mj_step2", "mj_step"):
            patched.setattr(mujoco, name, _refuse)
        plant.step(300)
        assert np.abs(plant.snapshot.q - READY).min() > 1e-3
        plant.apply_wrench((0.0, 0.0, -10.0))
        with pytest.raises(_RefusedError):  # what pushes is known to Python alone
            plant.step()


class _RefusedError(Exception):
    """A function of MuJoCo was called from Python."""


def _refuse(*_: object) -> None:
    raise _RefusedError


def test_a_force_on_a_body_is_seen() -> None:
    plant = Plant("iiwa14", q=READY)
    plant.step(5)
    body = mujoco.mj_name2id(plant.model, mujoco.mjtObj.mjOBJ_BODY, "link_7")
    plant.data.xfrc_applied[body, 2] = -10.0  # as a viewer's mouse pulls
    plant.step(100)
    assert plant.snapshot.wrench[2] == pytest.approx(-10.0, abs=0.1)
    plant.data.xfrc_applied[body, 2] = 0.0
    plant.step(2)
    assert not plant.snapshot.wrench.any()


_PROFILED = """
import sys, time
import mujoco
if sys.argv[1] == "own":
    mujoco.set_mjcb_time(time.perf_counter)
from heptarm.sim.plant.plant import Plant
plant = Plant()
timer = plant.data.timer[mujoco.mjtTimer.mjTIMER_POSITION]
before = timer.duration
plant.step(20)
print(timer.duration > before)
"""


@pytest.mark.parametrize(("clock", "is_profiled"), [("own", "True"), ("none", "False")])
def test_the_profiler_of_mujoco_runs_only_with_a_clock_of_the_program(clock: str, is_profiled: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _PROFILED, clock], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == is_profiled
