"""The inner loops of the timing in C against the same with numpy; tests of motions prove that limits hold."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.planning import time_scaling
from heptarm.planning.time_scaling import PathConstraints
from tests.oracles import path_timing


def made(seed: int) -> PathConstraints:
    """Limits of a random path of two segments, with a coordinate that has none but of its jerk."""
    random = np.random.default_rng(seed)
    s = np.concatenate([np.linspace(0.0, 0.4, 30), np.linspace(0.4, 1.0, 50)])
    shape = len(s), 9
    limits = [random.uniform(1.0, 9.0, 9) * np.ones(shape) for _ in range(3)]
    limits[0][:, 8] = limits[1][:, 8] = np.inf
    derivatives = [random.normal(size=shape).cumsum(axis=0) * 0.1 for _ in range(3)]
    return PathConstraints(
        s=s,
        first=derivatives[0],
        second=derivatives[1],
        third=derivatives[2],
        fastest=random.uniform(0.5, 2.0, len(s)),
        velocity=limits[0],
        acceleration=limits[1],
        jerk=limits[2],
        braking=np.ones(9),
        braking_jerk=np.ones(9),
    )


@pytest.mark.parametrize("seed", range(5))
def test_the_loops_give_the_same_numbers(seed: int) -> None:
    path, random = made(seed), np.random.default_rng(100 + seed)
    count = len(path.s)
    reaches, square = random.uniform(0.0, 0.2, count), random.uniform(0.0, 4.0, count)
    least = time_scaling.least_around(path.s, square, reaches)
    np.testing.assert_array_equal(least, path_timing.least_around(path.s, square, reaches))
    square[0] = square[-1] = 0.0
    free, taken = random.uniform(0.1, 5.0, (7, count)).T, random.uniform(0.0, 3.0, (7, count)).T
    found = time_scaling.reachable(path.s, free, taken, square)
    np.testing.assert_allclose(
        found, path_timing.reachable(path.s, free, taken, square), rtol=1e-12, atol=1e-14
    )
    assert (found <= square).all() and (found < square).any()
    speed = np.sin(np.linspace(0.0, np.pi, 700)) * random.uniform(0.5, 2.0)
    factors = time_scaling.Excess(path).of(2e-3, speed)
    np.testing.assert_allclose(factors, path_timing.excess(path, 2e-3, speed), rtol=1e-9, atol=1e-12)
    assert factors.max() > 0.1
