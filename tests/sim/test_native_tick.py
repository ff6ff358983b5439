"""The arithmetic of a tick in C does what the one in Python does: two plants have the same courses."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.io.compiled import SWITCH, Unavailable
from heptarm.sim.plant.native import tick_library
from heptarm.sim.plant.plant import Plant
from heptarm.sim.seam import StateWords
from tests.sim.courses import COURSES
from tests.sim.driving import READY

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
#: Sums of products are rounded otherwise than numpy's; the arm's feedback keeps that from growing.
SAME = 2e-12


@pytest.mark.parametrize("name", COURSES)
def test_every_state_of_a_course_is_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = COURSES[name].record()
    with monkeypatch.context() as patched:
        patched.setenv(SWITCH, "1")
        tick_library.cache_clear()
        expected = COURSES[name].record()
    tick_library.cache_clear()
    assert (found[:, WHOLE].view(np.int64) == expected[:, WHOLE].view(np.int64)).all()
    scale = np.maximum(1.0, np.abs(expected))
    assert np.abs(np.nan_to_num((found - expected) / scale)).max() < SAME
    assert (np.isnan(found) == np.isnan(expected)).all()
    assert np.ptp(found[:, StateWords.Q], axis=0).max() > 1e-3  # something has moved


def test_a_robot_that_cannot_compile_computes_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(SWITCH, "1")
    tick_library.cache_clear()
    plant = Plant("iiwa7", q=READY)
    plant.step(5)
    tick_library.cache_clear()
    assert plant.shared.read(5) is not None
