"""Arcs and what follows one after the other, against differences of what they themselves return."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.planning.geometry import Arc
from heptarm.planning.lookahead import PlanSamples
from heptarm.planning.planner import plan
from heptarm.planning.time_scaling import ProfileSequence, TabulatedProfile
from heptarm.values.robot import robot
from tests.sim import motions

CENTRE, RADIUS = np.array([0.4, -0.1, 0.3]), 0.25


@pytest.mark.parametrize("sweep", [0.5, 2.0, 5.0])
def test_an_arc_has_the_tangent_and_the_curvature_of_its_points(sweep: float) -> None:
    x, y = np.array([1.0, 2.0, 2.0]) / 3.0, np.array([2.0, 1.0, -2.0]) / 3.0

    def at(angle: float) -> np.ndarray:
        return np.asarray(CENTRE + RADIUS * (np.cos(angle) * x + np.sin(angle) * y))

    arc = Arc(at(0.0), at(0.4 * sweep), at(sweep))
    assert (arc.sweep, arc.radius, arc.length) == pytest.approx((sweep, RADIUS, sweep * RADIUS))
    h = 1e-4
    for s in (0.1, 0.35, 0.6, 0.9):
        before, now, after = (np.array(arc.point(one)) for one in (s - h, s, s + h))
        assert now == pytest.approx(at(s * sweep), abs=1e-12)
        assert arc.direction(s) == pytest.approx((after - before) / (2 * h * arc.length), abs=1e-6)
        assert arc.curvature(s) == pytest.approx((after - 2 * now + before) / (h * arc.length) ** 2, abs=1e-4)


def test_profiles_follow_each_other() -> None:
    speed = np.sin(np.linspace(0.0, np.pi, 50)) ** 2
    first, second = TabulatedProfile(0.01, speed, 0.0, 0.4), TabulatedProfile(0.02, speed, 0.4, 1.0)
    both = ProfileSequence([first, second])
    assert both.duration == pytest.approx(0.49 + 0.98)
    for time in (0.0, 0.2, 0.48, 0.5, 1.0, 1.4):
        expected = first.at(time) if time < 0.49 else second.at(time - 0.49)
        assert both.at(time) == pytest.approx(expected, abs=1e-9), time
    assert both.at(9.0) == (1.0, 0.0, 0.0)
    place, v, a = first.at(0.123)
    h = 1e-6
    assert v == pytest.approx((first.at(0.123 + h)[0] - first.at(0.123 - h)[0]) / (2 * h), rel=1e-6)
    assert first.at(0.12)[0] < place < first.at(0.13)[0] and a > 0.0


def test_a_hold_is_sampled_at_both_its_ends() -> None:
    start = np.radians([0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0])
    samples = PlanSamples.of(plan(robot("iiwa14"), motions.hold(1.5), start), 0.01)
    assert samples.t.tolist() == [0.0, 1.5]
    assert samples.q.shape == samples.dq.shape == samples.ddq.shape == (2, 7)
    assert (samples.q == start).all() and not samples.dq.any()
