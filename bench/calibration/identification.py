"""Identification of an arm whose numbers are hidden in the simulator: how far off, how honest, how well it predicts."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.figure import Figure, benchmark
from heptarm import calibration
from heptarm.calibration import FittedArm
from heptarm.calibration.excitation import swing
from heptarm.calibration.fri_delay import delay_of
from tests.calibration.hidden_arm import (
    HIDDEN,
    IIWA,
    START,
    TWO_SIGMA,
    commanded,
    computed,
    drawn,
    number,
    recorded,
    trajectory,
)

#: Durations of the recording that identifies, and of the other one that is predicted [s].
RECORDED, OTHER = 600.0, 30.0
#: Runs in which the truth has to be within two standard deviations, and the fraction of these that is enough.
RUNS, ENOUGH = 100, 0.9
#: Speeds at which friction is compared, in both directions [rad/s].
SPEEDS = (0.005, 0.02, 0.1, 0.3)
#: Name of the delay of FRI commands, and what swings A7 by FRI.
DELAY, SWING = "fri_command_delay", {"angle": 0.1, "seconds": 2.0, "count": 2}


@benchmark("identification")
def identification() -> Iterator[Figure]:
    """Identify a simulated arm with hidden numbers and noisy sensors from 600 s at 1 kHz; predict another recording."""
    fit = calibration.simulator(recorded(HIDDEN, RECORDED), robot=IIWA)
    detail = {"seconds": RECORDED}
    yield Figure("identified_friction", _friction_off(fit.arm), "fraction", limit=0.05, detail=detail)
    off = np.abs(fit.arm["stiffness"].value / HIDDEN["stiffness"].value - 1.0)
    yield Figure("identified_stiffness", float(off.max()), "fraction", limit=0.05, detail=detail)
    tried = calibration.validate(fit.arm, recorded(HIDDEN, OTHER, seed=11))
    yield Figure("identified_prediction", float(tried.ratio.max()), "by noise", limit=1.2, detail=detail)


@benchmark("identification_sigma")
def identification_sigma() -> Iterator[Figure]:
    """Fraction of 100 arms, drawn at random, whose numbers are within two sigma of the identified ones."""
    along = trajectory(20.0)
    inside = dict.fromkeys(TWO_SIGMA, 0.0)
    for seed in range(RUNS):
        hidden = drawn(seed)
        found = calibration.simulator(computed(hidden, along, seed=seed), robot=IIWA).arm
        for name in TWO_SIGMA:
            if name in found:
                off = np.abs(found[name].value - hidden[name].value)
                inside[name] += float((off <= 2.0 * found[name].sigma).mean()) / RUNS
    worst = min(inside, key=lambda name: inside[name])
    yield Figure(
        "identified_within_two_sigma",
        inside[worst],
        "fraction",
        limit=ENOUGH,
        at_least=True,
        detail={"runs": RUNS, "worst": worst},
    )


@benchmark("fri_delay")
def fri_delay() -> Iterator[Figure]:
    """Delay of FRI commands, hidden in a session of the virtual cabinet; and of 100 sessions, drawn at random."""
    hidden = HIDDEN.with_numbers([number(DELAY, 0.004)])
    with tempfile.TemporaryDirectory() as folder:
        arm_file, run = Path(folder) / "hidden.toml", Path(folder) / "run.mcap"
        hidden.save(arm_file)
        with ha.connect(f"sim://iiwa14?fitted={arm_file}", watchdog=5.0, timeout=60.0) as arm:
            arm.move(ha.ptp(START))
            with arm.record(run), arm.fri("position", period_ms=2, law=swing, params=SWING) as session:
                session.wait(4.0)
        found = calibration.fri_command_delay(run, state_delay=float(hidden["state_delay"].value[0]))
    detail = {"sigma_ms": 1e3 * found.sigma, "cycles": found.cycles, "hidden_ms": 4.0}
    yield Figure("fri_delay", 1e3 * abs(found.delay - 0.004), "ms", limit=0.1, detail=detail)
    inside = [[_delay_off(seed, has_set_points=known) for seed in range(RUNS)] for known in (True, False)]
    each = (np.array(inside) <= 2.0).mean(axis=1)
    yield Figure(
        "fri_delay_within_two_sigma",
        float(each.min()),
        "fraction",
        limit=ENOUGH,
        at_least=True,
        detail={"runs": RUNS, "each": each.tolist()},
    )


def _delay_off(seed: int, *, has_set_points: bool) -> float:
    """Error of the delay of a session, with set-points or measured positions alone, by its standard deviation."""
    delay = 1e-3 * (seed % 8)
    arm = drawn(seed).with_numbers([number(DELAY, delay), number("state_delay", 0.002)])
    seen = commanded(arm, seed=seed, period_ms=(1, 2, 5)[seed % 3], has_set_points=has_set_points)
    found = delay_of([seen], state_delay=0.002)
    return math.inf if found is None else abs(found.delay - delay) / found.sigma


def _friction_off(arm: FittedArm) -> float:
    """Largest relative error of the friction curve."""
    found, true = arm.friction, HIDDEN.friction
    assert found is not None and true is not None
    pairs = [
        (found.torque(np.full(7, sign * speed)), true.torque(np.full(7, sign * speed)))
        for speed in SPEEDS
        for sign in (1.0, -1.0)
    ]
    return max(float(np.abs(one / other - 1.0).max()) for one, other in pairs)
