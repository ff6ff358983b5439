"""What is late or lost moves no axis beyond its limits, whatever the client was commanding."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.values.checks import Array
from tests.long import longer
from tests.sim_fri.lockstep import Line, Lockstep
from tests.sim_fri.test_ends import START, TARGET

#: Rounding, relative.
EXACT = 1.0 + 1e-6


def largest(session: Lockstep) -> tuple[Array, Array]:
    """Velocity and acceleration of the set-points, as fractions of each axis' limits; no position limit is passed."""
    robot, q = session.plant.robot, np.array([session.start] * 2 + [one.q_cmd for one in session.track])
    assert (q >= robot.q_min).all() and (q <= robot.q_max).all()
    speed = np.diff(q, axis=0) * 1e3
    change = np.diff(speed, axis=0) * 1e3
    return (np.abs(speed) / robot.dq_max).max(axis=0), (np.abs(change) / robot.ddq_max).max(axis=0)


def bad_line(random: np.random.Generator, *, first: int) -> Line:
    """A line that works while the arm gets fast, then is late or loses something for a while, again and again."""
    left, state = first, "good"

    def next_one() -> int | None:
        nonlocal left, state
        if left == 0:
            state = "good" if state != "good" else str(random.choice(["late", "lost", "jitter"]))
            left = int(random.integers(20, 100) if state == "good" else random.integers(1, 12))
        left -= 1
        match state:
            case "good":
                return 0
            case "late":
                return left  # all arrive together
            case "jitter":
                return int(random.integers(0, 4))
            case _:
                return None

    return next_one


@pytest.mark.parametrize("period", [1, 5, 10])
@pytest.mark.parametrize("seed", range(longer(2, 200)))
def test_late_and_lost_datagrams_move_no_axis_beyond_its_limits(period: int, seed: int) -> None:
    """On a busy machine five axes once moved with 1.25 of their velocity when late answers arrived together."""
    random = np.random.default_rng(seed)
    session = Lockstep(q=START, period_ms=period)
    session.back = bad_line(random, first=300 // period)
    if seed % 2:
        session.there = bad_line(random, first=300 // period)
    for _ in range(4):
        session.command(TARGET * random.choice([-1.0, 1.0], 7) * random.uniform(0.2, 1.0, 7))
        session.run(float(random.uniform(0.1, 0.4)))
    session.run(0.3)
    velocity, acceleration = largest(session)
    assert np.ptp([one.q_cmd for one in session.track], axis=0).max() > 0.1, "the arm has moved"
    assert velocity.max() <= EXACT, velocity
    assert acceleration.max() <= EXACT, acceleration
