"""Joint offsets and errors of the links from measured points: exact without noise, honest with it."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm import calibration, model
from heptarm.calibration import links
from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.checks import Array
from heptarm.values.robot import robot
from tests.long import longer

IIWA = robot("iiwa14")
TIP = np.array([0.02, -0.01, 0.12])


def postures(count: int, seed: int = 0) -> Array:
    return np.random.default_rng(seed).uniform(0.8 * IIWA.q_min, 0.8 * IIWA.q_max, (count, 7))


def true(seed: int, *, moved: bool) -> Array:
    """Unknowns of an arm that was made and mastered within the usual accuracy."""
    random = np.random.default_rng(seed)
    x = np.zeros(51)
    if moved:
        x[:6] = [1.0, -2.0, 0.3, 0.2, -0.4, 1.1]
    x[6:9] = TIP
    x[9:16] = random.normal(0.0, 5e-3, 7)
    x[16:37], x[37:] = random.normal(0.0, links.ORIGIN, 21), random.normal(0.0, links.TILT, 14)
    return x


def test_the_chain_is_that_of_the_model() -> None:
    q, x = postures(20), np.zeros(51)
    for name in ("iiwa7", "iiwa14"):
        one = robot(name)
        expected = [model.forward(one, row)[:3, 3] for row in q]
        assert np.allclose(links._points(one, q, x), expected, atol=1e-9)


def test_offsets_from_points_of_a_tracker() -> None:
    runs, inside = longer(2, 100), np.zeros(7)
    for seed in range(runs):
        hidden, q = true(seed, moved=True), postures(80, seed)
        noise = np.random.default_rng(seed).normal(0.0, 5e-5, (80, 3))
        points = links._points(IIWA, q, hidden) + noise
        found = calibration.kinematics(q, points, robot=IIWA, tip=TIP + 0.01)
        inside += np.abs(found.offset - hidden[9:16]) <= 2.0 * found.sigma_offset
        assert found.before > 5e-4 and found.after < 1.2e-4
        assert found.is_known[1:6].all() and not found.is_known[0]
        assert np.abs(found.offset - hidden[9:16])[1:6].max() < 2.5e-3
    assert inside.sum() >= 0.9 * 7 * runs, inside
    assert "not known" in str(found)


def test_with_the_base_known_the_first_joint_is_found() -> None:
    hidden, q = true(7, moved=False), postures(60)
    found = calibration.kinematics(q, links._points(IIWA, q, hidden), robot="iiwa14", is_base_known=True)
    assert found.is_known[0] and abs(found.offset[0] - hidden[9]) < 1.5e-3


def test_what_is_no_measurement_is_refused() -> None:
    q = postures(30)
    points = links._points(IIWA, q, np.zeros(51))
    with pytest.raises(ShapeError, match=r"points must have shape \(30, 3\)"):
        calibration.kinematics(q, points[:5], robot=IIWA)
    with pytest.raises(ShapeError, match="n >= 20"):
        calibration.kinematics(q[:5], points[:5], robot=IIWA)
    q[:, 2] = 0.1
    with pytest.raises(CommandRejected, match="0.000 rad in A3"):
        calibration.kinematics(q, points, robot=IIWA)
