"""No law breaks the arm: the guard of torques against laws that try to, on the simulated plant with its drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.torque_guard import TorqueGuard
from heptarm.model.dynamics import ROTOR, mass_matrix, rigid_bodies
from heptarm.values.robot import robot
from tests.long import few, longer

from .adversaries import Trial

ARM = robot("iiwa14")
HOME = np.radians([0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0])
STILL = np.zeros(7)
#: Wrenches that tripped a drive: in motions through a singular posture, and at a limit.
HARD = (83, 143, 226, 229, 235, 339)
PERIOD = 1e-3


def guard() -> TorqueGuard:
    made = TorqueGuard(Limits.of(ARM), rigid_bodies(ARM, rotor=ROTOR))
    made.start()
    return made


@pytest.mark.parametrize("block", range(longer(4, 100)))
def test_no_law_brings_an_axis_beyond_its_speed_or_to_a_limit(block: int) -> None:
    """Random gains, wrong signs, noise, 1e12, NaN; loads, periods, stiffness and noise of the sensors."""
    size = longer(4, 10)
    for seed in range(block * size, (block + 1) * size):
        trial = Trial(seed).run(longer(0.8, 1.5))
        assert not trial.error, f"{trial.name}: {trial.error}"
        assert trial.speed.max() <= 0.95, f"{trial.name}: {trial.speed.max():.3f} of the robot's speed"
        assert trial.nearest >= np.radians(1.0), f"{trial.name}: {np.degrees(trial.nearest):.2f} deg"


@pytest.mark.timeout(longer(300, 3600))
def test_no_law_of_a_wrench_trips_a_drive() -> None:
    """A wrench has one direction less than the arm, so it cannot bound every axis in every singular posture."""
    seeds = [*range(longer(4, 400)), *HARD]
    found = [Trial(seed, by_wrench=True).run(0.8) for seed in seeds]
    assert not [one.name for one in found if one.error]
    assert not [one.name for one in found if one.nearest < np.radians(-0.5)]
    fast = [one.name for one in found if one.speed.max() > 0.95]
    assert len(fast) <= 0.02 * len(seeds) + 1, fast


def test_without_the_guard_laws_of_a_wrench_do_break_the_arm() -> None:
    found = [Trial(seed, is_guarded=False, by_wrench=True).run(0.8) for seed in range(4)]
    assert sum(bool(one.error) for one in found) >= 3


@pytest.mark.parametrize("seed", few([12, 9, 15, 21]))
def test_at_the_end_the_torques_unwind_the_spring(seed: int) -> None:
    """It threw the arm back at 1.4 times an axis' speed when a session ended with a wound spring."""
    trial = Trial(seed, is_ending=True).run(6.0)
    assert not trial.error
    assert np.abs(trial.final_effort).max() < 5.0


def test_without_the_guard_such_laws_do_break_the_arm() -> None:
    found = [Trial(seed, is_guarded=False).run(0.8) for seed in (0, 1, 2, 3, 4, 5)]
    assert sum(one.speed.max() > 0.95 or bool(one.error) for one in found) >= 3


def test_torques_of_a_calm_law_pass_unchanged() -> None:
    tau = [20.0, -30.0, 10.0, 15.0, -5.0, 4.0, -2.0]
    made = guard()
    assert not made.was_limited
    for _ in range(20):
        assert made.limit(tau, q=HOME, dq=STILL, period=PERIOD) == tau
        assert not made.was_limited
    assert made.report.lines == []


def test_a_torque_beyond_its_limit_is_cut_and_reported_by_axis() -> None:
    made = TorqueGuard(replace(Limits.of(ARM), tau_max=(5.0,) * 7), rigid_bodies(ARM, rotor=ROTOR))
    made.start()
    sent = made.limit([8.0, *[0.0] * 6], q=HOME, dq=STILL, period=PERIOD)
    assert made.was_limited and sent[0] == pytest.approx(5.0)
    assert made.report.lines == ["A1: torque limited in 1 cycle: 8 Nm requested, 5 allowed"]


def test_an_axis_near_its_limit_brakes_and_the_others_keep_their_accelerations() -> None:
    made, q, dq = guard(), HOME.copy(), STILL.copy()
    q[5], dq[5] = ARM.q_max[5] - 0.08, 1.0
    asked = np.array([10.0, -20.0, 8.0, 10.0, -4.0, 20.0, 2.0])
    sent = np.array(made.limit(asked.tolist(), q=q, dq=dq, period=PERIOD))
    mass = mass_matrix(ARM, q) + 0.1 * np.eye(7)
    wanted, found = np.linalg.solve(mass, asked), np.linalg.solve(mass, sent)
    assert found[5] < -1.0 < wanted[5], "A6 brakes"
    others = [0, 1, 2, 3, 4, 6]
    assert found[others] == pytest.approx(wanted[others], abs=1e-9)
    assert made.was_limited and any(line.startswith("A6: position limited") for line in made.report.lines)


def test_at_the_end_the_torques_bring_the_arm_to_rest() -> None:
    trial = Trial(3, is_ending=True).run(1.6)
    assert not trial.error and np.abs(trial.final_speed).max() < 0.02


@pytest.mark.parametrize("broken", [np.full(7, np.nan), np.full(7, np.inf), np.full(7, -5e302)])
def test_without_positions_there_are_no_torques(broken: np.ndarray) -> None:
    made = guard()
    assert made.limit([50.0] * 7, q=broken, dq=STILL, period=PERIOD) == [0.0] * 7
    assert made.limit([5.0] * 7, q=HOME, dq=broken, period=PERIOD) == [0.0] * 7
    assert made.limit([5.0] * 7, q=HOME, dq=STILL, period=PERIOD) == [5.0] * 7
    assert np.isfinite(made.words).all()
