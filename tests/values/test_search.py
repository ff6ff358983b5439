"""The spiral of a search, and the impedance that presses."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import heptarm as ha
from heptarm.modes import pressing


def test_a_spiral_covers_its_disc_to_within_half_its_pitch() -> None:
    pattern = ha.spiral(0.003, pitch=4e-4)
    points = np.concatenate([np.zeros((1, 2)), pattern.points])
    fine = np.concatenate(
        [a + np.linspace(0, 1, 20)[:, None] * (b - a) for a, b in itertools.pairwise(points)]
    )
    random = np.random.default_rng(5)
    for place in random.uniform(-0.0029, 0.0029, (300, 2)):
        if np.linalg.norm(place) < 0.003 - 2e-4:
            assert np.linalg.norm(fine - place, axis=1).min() < 0.52 * pattern.pitch
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.sum() == pytest.approx(pattern.length, rel=0.03)
    assert np.linalg.norm(points[-1]) == pytest.approx(0.003)


def test_a_spiral_has_no_more_points_than_a_spline_takes() -> None:
    widest = ha.spiral(0.05, pitch=7e-4)
    assert len(ha.spline([ha.Pose.of((*point, 0.0)) for point in widest.points]).segments) <= 1000
    with pytest.raises(ha.LimitError, match="pitch"):
        ha.spiral(0.05, pitch=1e-4)


@pytest.mark.parametrize(
    ("name", "values"),
    [("radius", {"radius": 0.0}), ("radius", {"radius": 1.0}), ("pitch", {"radius": 0.003, "pitch": 0.01}),
     ("speed_mps", {"radius": 0.003, "speed_mps": 0.0}), ("radius", {"radius": float("nan")})],
)  # fmt: skip
def test_a_spiral_outside_its_ranges_is_refused(name: str, values: dict[str, float]) -> None:
    with pytest.raises(ha.LimitError, match=name):
        ha.spiral(**values)


def test_pressing_is_compliant_and_pushes_along_one_axis_only() -> None:
    mode = pressing("-y", 12.0, frame="base", stiffness=2500.0, along=150.0, turning=250.0)
    assert mode.stiffness.tolist() == [2500.0, 150.0, 2500.0, 250.0, 250.0, 250.0]
    assert mode.additional_force.tolist() == [0.0, -12.0, 0.0, 0.0, 0.0, 0.0] and mode.frame == "base"


def test_pressing_refuses_what_is_no_axis_and_too_strong_a_force() -> None:
    with pytest.raises(ha.ShapeError, match="direction"):
        pressing("a", 1.0)
    with pytest.raises(ha.ShapeError, match="name of an axis"):
        pressing((0, 0, 1), 1.0)  # type: ignore[arg-type]
    with pytest.raises(ha.LimitError, match="force"):
        pressing("z", -1.0)
