"""The arithmetic of a tick in C does what the one in Python does: two plants follow the same scripts."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
import pytest

from heptarm._library import SWITCH, Unavailable
from heptarm.planning.seam import StateWords
from heptarm.planning.table import ahead_library
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant import native
from heptarm.sim.plant.native import tick_library
from heptarm.sim.plant.plant import Plant
from tests.sim import motions
from tests.sim.driving import READY
from tests.sim.plant_scripts import PLANT_SCRIPTS

try:
    tick_library()
except Unavailable as reason:
    pytest.skip(f"no compiled part: {reason}", allow_module_level=True)

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
    """Without the compiled parts."""
    try:
        with monkeypatch.context() as patched:
            patched.setenv(SWITCH, "1")
            tick_library.cache_clear()
            ahead_library.cache_clear()
            yield
    finally:
        tick_library.cache_clear()
        ahead_library.cache_clear()


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


def test_a_robot_that_cannot_compile_computes_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    with in_python(monkeypatch):
        plant = Plant("iiwa7", q=READY)
        plant.step(5)
    assert plant.shared.read(5) is not None


def test_a_mujoco_that_does_not_show_its_functions_is_called_from_python(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tick_library.cache_clear()
    with monkeypatch.context() as patched:
        patched.setattr(native, "_CALLED", {"mj_no_such_function": "step1"})
        with pytest.raises(Unavailable, match="shows no mj_no_such_function"):
            native._mujoco()
        plant = Plant("iiwa7", q=READY)
        plant.step(5)
    tick_library.cache_clear()
    assert plant.shared.read(5) is not None


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
