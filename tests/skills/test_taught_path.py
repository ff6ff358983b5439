"""How far an arm was from a taught path, and how late: compared with what is known of made-up states."""

from __future__ import annotations

import math

import numpy as np
import pytest

from heptarm.skills.taught_path import TaughtPath
from heptarm.values.checks import Array
from heptarm.values.motion.trajectory import Trajectory


def swinging(seconds: float, period: float, *, rate: float = 100.0) -> Trajectory:
    """A1 swings, and so do the others, more slowly and less."""
    t = np.arange(0.0, seconds, 1.0 / rate)
    others = [0.3 * np.sin(2.0 * np.pi * t / (7.3 + axis)) for axis in range(6)]
    return Trajectory.of(t, np.column_stack([0.8 * np.sin(2.0 * np.pi * t / period), *others]))


def states(of: Trajectory, late: float, *, noise: float = 0.0) -> tuple[list[float], list[Array]]:
    """Times, and the positions of an arm that is late by some time."""
    times = np.arange(0.5, of.duration, 0.0103)
    q = of.positions(times - late) + noise * np.random.default_rng(0).standard_normal((len(times), 7))
    return times.tolist(), list(q)


def test_states_on_a_long_path_deviate_by_nothing() -> None:
    long = swinging(300.0, 4.0)
    _, seen = states(long, 0.1)
    assert TaughtPath(long).deviation(seen) < 1e-9


@pytest.mark.parametrize("seconds", [8.0, 120.0])
def test_the_farthest_state_counts_wherever_the_path_is_nearest(seconds: float) -> None:
    path = swinging(seconds, 4.0)
    _, seen = states(path, 0.1, noise=1e-4)
    aside = path.q[len(path) // 3] + [0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0]
    fine = path.positions(np.linspace(0.0, path.duration, 200_000))
    expected = float(np.abs(fine - aside).max(axis=1).min())
    assert expected > 5e-3
    for order in (slice(None), slice(None, None, -1)):
        found = TaughtPath(path).deviation([*seen[:50], aside, *seen[50:]][order])
        assert found == pytest.approx(expected, abs=3e-4) and found > expected - 1e-5


@pytest.mark.parametrize("late", [0.0, 0.03, 0.25])
@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_the_lag_is_that_of_the_pass_that_the_arm_follows(late: float, noise: float) -> None:
    t = np.arange(0.0, 8.0, 0.01)
    only_a1 = np.zeros((len(t), 7))
    only_a1[:, 0] = 0.8 * np.sin(2.0 * np.pi * t / 4.0)
    for path in (Trajectory.of(t, only_a1), swinging(8.0, 4.0), swinging(300.0, 4.0)):
        assert TaughtPath(path).lag(*states(path, late, noise=noise)) == pytest.approx(late, abs=2e-3)


def test_rests_show_no_lag() -> None:
    t = np.array([0.0, 5.0, 6.0, 30.0, 31.0, 60.0])
    q = np.outer([0.0, 0.0, 0.5, 0.5, 0.0, 0.0], np.ones(7))
    path = Trajectory.of(t, q)
    assert TaughtPath(path).lag(*states(path, 0.05, noise=1e-5)) == pytest.approx(0.05, abs=2e-3)


def test_of_no_states_there_is_no_lag_and_no_deviation() -> None:
    path = TaughtPath(Trajectory.of([0.0, 1.0], np.zeros((2, 7))))
    assert path.deviation([]) == 0.0 and math.isnan(path.lag([], []))
    assert path.deviation([np.full(7, 0.1)]) == pytest.approx(0.1)
    assert math.isnan(path.lag([0.0, 0.5], [np.zeros(7)] * 2)), "nothing moves"


def test_a_slow_path_shows_a_lag() -> None:
    path = Trajectory.of([0.0, 100.0], [np.zeros(7), np.full(7, 0.1)])
    assert TaughtPath(path).lag(*states(path, 0.5)) == pytest.approx(0.5, abs=1e-3)
