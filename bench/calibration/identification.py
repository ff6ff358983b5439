"""Identification of an arm whose numbers are hidden in the simulator: how far off, how honest, how well it predicts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.measure.figure import Figure, benchmark
from heptarm import calibration
from heptarm.calibration import FittedArm
from tests.calibration.hidden_arm import HIDDEN, IIWA, TWO_SIGMA, computed, drawn, recorded, trajectory

#: Durations of the recording that identifies, and of the other one that is predicted [s].
RECORDED, OTHER = 600.0, 30.0
#: Runs in which the truth has to be within two standard deviations, and the fraction of these that is enough.
RUNS, ENOUGH = 100, 0.9
#: Speeds at which friction is compared, in both directions [rad/s].
SPEEDS = (0.005, 0.02, 0.1, 0.3)


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
