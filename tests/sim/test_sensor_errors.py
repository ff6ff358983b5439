"""Noisy sensors and friction: off unless they are wanted, the same for a seed, of the stated size."""

from __future__ import annotations

import numpy as np
import pytest

import heptarm as ha
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant import sensor_errors as errors
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.sensor_errors import SensorErrors, parse_sensors, sensor_errors
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.robot import robot
from tests.sim import motions
from tests.sim.driving import READY, run

IIWA = robot("iiwa14")


def noisy(seed: int = 1) -> Plant:
    return Plant("iiwa14", q=READY, errors=SensorErrors(IIWA, seed))


def seen(plant: Plant, ticks: int) -> tuple[Array, Array, Array]:
    """Shown positions, torques and external torques of each tick, shape (n, 7)."""
    rows = []
    for _ in range(ticks):
        plant.tick()
        state = plant.snapshot
        rows.append((state.q, state.tau, state.tau_ext))
    q, tau, external = (np.array(column) for column in zip(*rows, strict=True))
    return q, tau, external


def test_sensors_are_ideal_unless_noisy_ones_are_wanted() -> None:
    plant = Plant("iiwa14", q=READY)
    plant.step(300)
    assert not plant.snapshot.tau_ext.any()
    assert parse_sensors("ideal") is None and sensor_errors(IIWA, "ideal") is None
    assert (parse_sensors("noisy"), parse_sensors("noisy:12")) == (0, 12)


@pytest.mark.parametrize("text", ["", "loud", "noisy:", "noisy:-1", "noisy:x", "ideal:3", "Noisy"])
def test_other_words_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="sensors must be ideal, noisy or noisy:SEED"):
        parse_sensors(text)
    if text:
        with pytest.raises(ha.HeptarmError, match="sensors must be ideal"):
            ha.connect(f"sim://iiwa14?sensors={text}")


def test_the_same_seed_shows_the_same() -> None:
    first, again, other = seen(noisy(3), 200), seen(noisy(3), 200), seen(noisy(4), 200)
    for one, same in zip(first, again, strict=True):
        assert (one == same).all()
    assert (first[1] != other[1]).any()


def test_the_errors_are_of_the_stated_size() -> None:
    ideal = Plant("iiwa14", q=READY)
    _, true, _ = seen(ideal, 500)
    q, tau, external = (part[100:] for part in seen(noisy(), 600))
    true_mean = true[-1]
    spread = tau.std(axis=0)
    assert spread == pytest.approx(errors.TORQUE_NOISE * IIWA.tau_max, rel=0.3, abs=errors.TORQUE_STEP / 2)
    bias = np.abs(tau.mean(axis=0) - true_mean)
    assert (bias <= errors.OFFSET * IIWA.tau_max + errors.GAIN * np.abs(true_mean) + 0.05).all()
    assert bias.max() > 0.05
    assert np.abs(external.mean(axis=0)) == pytest.approx(bias, abs=0.05), (
        "what sensors show too much is no load"
    )
    steps = tau / errors.TORQUE_STEP
    assert steps == pytest.approx(np.round(steps), abs=1e-6)
    assert 0.5e-5 < q.std(axis=0).max() < 3e-5


def test_positions_stay_accurate() -> None:
    plant = noisy()
    goal = np.array(READY) + 0.3
    run(plant, MotionCommand(1, motions.ptp(tuple(goal))))
    assert np.abs(plant.snapshot.q - goal).max() < 5e-4  # friction by the stiffness of the joints


def test_friction_slows_a_compliant_joint_down() -> None:
    overshoots = []
    for plant in (Plant("iiwa14", q=READY), noisy()):
        plant.submit(MotionCommand(1, motions.hold(3.0), mode=JointImpedance(100.0)))
        plant.step(100)
        plant.apply_wrench((0.0, 6.0, 0.0), duration=0.2)
        path = []
        for _ in range(1500):
            plant.tick()
            path.append(plant.snapshot.q[0] - READY[0])
        overshoots.append(-min(path))
    assert overshoots[0] > 2e-3 and overshoots[1] < 0.2 * overshoots[0]
