"""The load of measured torques: exact, with the errors of sensors, with honest sigma; what is refused."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from heptarm import calibration, model
from heptarm.calibration.load_estimate import consistent, load_regressor
from heptarm.calibration.load_motion import _postures, moving_samples
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.model.dynamics import inverse_dynamics_rows
from heptarm.sim.plant.sensor_errors import POSITION_NOISE, TORQUE_NOISE, SensorErrors
from heptarm.values.checks import Array
from heptarm.values.motion.ptp import Ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import Body, robot
from heptarm.values.tool import Tool
from tests.long import few, longer

IIWA = robot("iiwa14")
HOME = deg(0, 30, 0, -90, 0, 60, 0)
RESTS = _postures(IIWA, HOME)
LOAD = Body(
    2.0, np.array([0.01, -0.02, 0.08]), inertia=np.array([0.006, 0.005, 0.004, 0.0005, -0.0004, 0.0002])
)
#: A load whose inertia matters: 3 kg, 30 cm long.
LONG_LOAD = Body(
    3.0, np.array([0.0, 0.01, 0.12]), inertia=np.array([0.03, 0.028, 0.006, 0.001, -0.002, 0.001])
)
#: 4 kg, 60 cm long.
LONG_TOOL = Body(
    4.0, np.array([0.0, 0.02, 0.22]), inertia=np.array([0.1212, 0.1208, 0.002033, 0.0, 0.001, -0.002])
)
STILL = np.zeros(7)
#: States of which each rest is the mean.
STATES = 500


def at_rest(
    seed: int | None, load: Body, declared: Body | None = None, postures: Array = RESTS
) -> calibration.LoadSamples:
    """What the sensors of a seed show in rests, averaged; None: ideal ones."""
    return in_motion(seed, load, declared, postures, np.zeros_like(postures), np.zeros_like(postures), STATES)


def in_motion(
    seed: int | None, load: Body, declared: Body | None, q: Array, dq: Array, ddq: Array, states: int
) -> calibration.LoadSamples:
    errors = None if seed is None else SensorErrors(IIWA, seed)
    noise = np.tile(TORQUE_NOISE * IIWA.tau_max / np.sqrt(states), (len(q), 1))
    true = np.array([model.inverse_dynamics(IIWA, *row, load=load) for row in zip(q, dq, ddq, strict=True)])
    expected = [model.inverse_dynamics(IIWA, *row, load=declared) for row in zip(q, dq, ddq, strict=True)]
    shown = true
    if seed is not None and errors is not None:  # the mean of many readings, drawn at once
        random = np.random.default_rng(len(q) + seed)
        shown = true + errors._gain * true + errors._offset + noise * random.standard_normal(noise.shape)
    return calibration.LoadSamples(q, shown, np.array(expected) - shown, noise, dq, ddq)


def moving(
    seed: int | None, load: Body, declared: Body | None = None, excitation: str = "full"
) -> calibration.LoadSamples:
    """What the sensors of a seed show in the motions of a plan, at 500 Hz; quintic ones instead of PTP."""
    plan = calibration.LoadPlan(IIWA, excitation, RESTS, 0.5, 1.0, 0.0, STILL[:3], STILL[:3])
    goals = [HOME, *(np.asarray(motion.q) for motion in plan.motions if isinstance(motion, Ptp))]
    legs = []
    for before, after in pairwise(goals):
        far = np.abs(after - before)
        by = max(float((1.875 * far / (plan.speed * IIWA.dq_max)).max()), math.sqrt(0.577 * far.max()))
        x = np.arange(0.0, 1.0, 1.0 / (500.0 * by))[:, None]
        shapes = (x**3 * (10 - 15 * x + 6 * x**2), 30 * x**2 * (1 - x) ** 2, 60 * x * (1 - x) * (1 - 2 * x))
        legs.append(np.hstack([(after - before) * shape / by**order for order, shape in enumerate(shapes)]))
        legs[-1][:, :7] += before
    q, dq, ddq = np.split(np.concatenate(legs), 3, axis=1)
    true, expected = (inverse_dynamics_rows(IIWA, q, dq, ddq, load=body) for body in (load, declared))
    shown = true
    if seed is not None:
        errors, random = SensorErrors(IIWA, seed), np.random.default_rng(seed)
        noise = TORQUE_NOISE * IIWA.tau_max * random.standard_normal(q.shape)
        shown = true + errors._gain * true + errors._offset + noise
        q = q + POSITION_NOISE * random.standard_normal(q.shape)
    times = np.arange(len(q)) / 500.0
    recorded = calibration.ArmSamples(times, q, q, shown, expected - shown, shown)
    return moving_samples(recorded, IIWA, declared=declared)


def swings(count: int) -> tuple[Array, Array, Array]:
    """Positions, velocities and accelerations of A4 to A7 that swing, moments in no order."""
    random = np.random.default_rng(0)
    offset, dq, ddq = (random.uniform(-1, 1, (count, 7)) for _ in range(3))
    return (
        HOME + offset * (0, 0, 0, 0.5, 1.2, 0.7, 1.5),
        dq * (0, 0, 0, 0.5, 1, 1, 1),
        ddq * (0, 0, 0, 4, 8, 8, 8),
    )


def test_the_regressor_is_the_dynamics_of_heptarm() -> None:
    random = np.random.default_rng(1)
    for _ in range(5):
        q, dq, ddq = random.uniform(-1.0, 1.0, (3, 7))
        down = random.normal(size=3)
        about = 2.0 * (LOAD.com @ LOAD.com * np.eye(3) - np.outer(LOAD.com, LOAD.com))
        entries = LOAD.inertia + about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        parameters = np.concatenate([[2.0], 2.0 * LOAD.com, entries])
        loaded, bare = (
            model.inverse_dynamics(IIWA, q, dq, ddq, load=one, acceleration=down) for one in (LOAD, None)
        )
        by = load_regressor(IIWA, q, dq, ddq, acceleration=down)
        assert np.allclose(by @ parameters, loaded - bare, atol=1e-10)


@pytest.mark.parametrize(
    "declared", [None, Body(1.2, np.array([0.0, 0.0, 0.06])), Body(4.0, np.array([0.0, 0.0, 0.1]))]
)
def test_ideal_sensors_give_the_exact_load_whatever_is_declared(declared: Body | None) -> None:
    found = calibration.estimate_load(at_rest(None, LOAD, declared), robot="iiwa14", declared=declared)
    assert found.mass == pytest.approx(2.0, abs=2e-3)
    assert np.allclose(found.com, LOAD.com, atol=1e-3)
    assert np.isnan(found.sigma_inertia).all() and not found.is_as_declared
    assert (found.inertia == (np.zeros(6) if declared is None else declared.inertia)).all()


def test_with_noisy_sensors_the_truth_is_within_two_sigma() -> None:
    runs = longer(30, 100)
    inside, masses, centres = np.zeros(4), [], []
    for seed in range(runs):
        found = calibration.estimate_load(at_rest(seed, LOAD), robot=IIWA)
        off = np.abs([found.mass - 2.0, *(found.com - LOAD.com)])
        inside += off <= 2.0 * np.array([found.sigma_mass, *found.sigma_com])
        masses.append(off[0])
        centres.append(np.linalg.norm(found.com - LOAD.com))
    assert (inside >= 0.9 * runs).all(), inside
    assert max(masses) <= 0.02 * 2.0 and max(centres) <= 3e-3


def test_offsets_of_the_sensors_are_separated() -> None:
    errors = SensorErrors(IIWA, 5)
    found = calibration.estimate_load(at_rest(5, LOAD), robot=IIWA)
    off = np.abs(found.offset - errors._offset)
    assert (off <= 3.0 * found.sigma_offset).all()
    assert (np.abs(found.offset[4:] - errors._offset[4:]) < 0.05).all()  # of up to 0.55 Nm


def test_inertia_from_a_motion() -> None:
    runs = longer(10, 100)
    inside = np.zeros(6)
    for seed in range(runs):
        samples = at_rest(seed, LONG_LOAD).joined(in_motion(seed, LONG_LOAD, None, *swings(100), 20))
        found = calibration.estimate_load(samples, robot=IIWA)
        inside += np.abs(found.inertia - LONG_LOAD.inertia) <= 2.0 * found.sigma_inertia
        assert np.allclose(found.inertia[:3], LONG_LOAD.inertia[:3], rtol=0.15)
        Body(found.mass, found.com, inertia=found.inertia)  # a body has it
    assert (inside >= 0.9 * runs).all(), inside


@pytest.mark.parametrize(
    ("excitation", "load", "declared"),
    few([("short", LONG_LOAD, None), ("full", LONG_TOOL, Body(3.0, np.array([0.0, 0.0, 0.2])))], 1),
)
def test_inertia_from_recorded_motions(excitation: str, load: Body, declared: Body | None) -> None:
    runs, off = longer(1, 50), []
    for seed in range(runs):
        samples = at_rest(seed, load, declared).joined(moving(seed, load, declared, excitation))
        found = calibration.estimate_load(samples, robot=IIWA, declared=declared)
        off.append((found.inertia - load.inertia) / found.sigma_inertia)
        assert found.matters == (True, True, True) and "does not matter" not in str(found)
        assert np.allclose(found.inertia[:3], load.inertia[:3], rtol=0.15)
    assert np.abs(off).max() < 4.0
    assert runs == 1 or (np.abs(off) <= 2.0).mean() >= 0.9


def test_an_inertia_that_no_motion_shows_does_not_matter() -> None:
    small = Body(1.0, np.array([0.0, 0.0, 0.05]), inertia=np.array([0.003, 0.0028, 0.001, 0.0, 0.0, 0.0]))
    found = calibration.estimate_load(
        at_rest(None, small).joined(moving(None, small, None, "short")), robot=IIWA
    )
    assert found.matters == (True, True, False)
    assert "zz does not matter: no motion of the arm shows less than 0.002" in str(found)
    assert abs(found.inertia[2] - 0.001) < 3.0 * found.sigma_inertia[2]


def test_motions_too_slow_for_an_inertia_are_refused() -> None:
    times = np.arange(2000) / 500.0
    q = HOME + 0.1 * np.sin(times)[:, None] * np.ones(7)
    slow = calibration.ArmSamples(times, q, q, q, q, q)
    with pytest.raises(CommandRejected, match=r"no axis accelerates by 0\.5 rad/s"):
        moving_samples(slow, IIWA, declared=None)


def test_an_impossible_inertia_becomes_one_that_a_body_can_have() -> None:
    thin = np.array(
        [2.0, 0.02, -0.04, 0.16, 0.01, 0.02, 0.003, 0.0, 0.0, 0.0]
    )  # much too little about the centre
    made = consistent(thin, np.diag([1e-2, 1e-3, 1e-3, 1e-3, *[3e-2] * 6]) ** 2)
    com = made[1:4] / made[0]
    about = np.array([[made[4], made[7], made[8]], [made[7], made[5], made[9]], [made[8], made[9], made[6]]])
    about -= made[0] * (com @ com * np.eye(3) - np.outer(com, com))
    least, middle, most = np.linalg.eigvalsh(about)
    assert made[0] > 0 and least >= -1e-9 and least + middle >= most - 1e-9
    assert abs(made[0] - 2.0) < 0.05 and np.abs(made[1:4] - thin[1:4]).max() < 5e-3


def test_the_result_is_compared_with_the_load_data_in_use() -> None:
    declared = Body(1.2, np.array([0.0, 0.0, 0.06]))
    found = calibration.estimate_load(at_rest(2, LOAD, declared), robot=IIWA, declared=declared)
    assert found.comparison.startswith("declared 1.2 kg, measured ") and "they differ" in found.comparison
    right = calibration.estimate_load(at_rest(2, LOAD, LOAD), robot=IIWA, declared=LOAD)
    assert right.is_as_declared and "they agree" in str(right)
    assert np.allclose(right.inertia, LOAD.inertia)
    old = Tool("gripper", tcp=Pose.at(0, 0, 0.1))
    new = found.to_tool(old)
    assert new.mass == found.mass and new.tcp == old.tcp and (new.com == found.com).all()


def test_a_motionless_log_is_refused() -> None:
    with pytest.raises(CommandRejected, match=r"must differ in their postures: gravity turns by 0.0 deg"):
        calibration.estimate_load(at_rest(0, LOAD, postures=np.tile(HOME, (9, 1))), robot=IIWA)
    turned = np.array([HOME + deg(0, 0, 0, 0, 0, offset, 0) for offset in (0, 25)])
    with pytest.raises(CommandRejected, match="do not determine the load"):
        calibration.estimate_load(at_rest(0, LOAD, postures=turned), robot=IIWA)


def test_what_is_no_load_is_refused() -> None:
    nothing = Body(0.0, np.zeros(3))
    with pytest.raises(CommandRejected, match="mass must be above 0 kg"):
        calibration.estimate_load(at_rest(0, nothing), robot=IIWA)
    with pytest.raises(CommandRejected, match="the load data in use are too large"):
        calibration.estimate_load(at_rest(0, nothing, LOAD), robot=IIWA, declared=LOAD)
    heavy = Body(16.0, np.array([0.0, 0.0, 0.1]))
    with pytest.raises(LimitError, match=r"mass must be in \(0, 14\] kg, the rated load"):
        calibration.estimate_load(at_rest(0, heavy), robot=IIWA)


def test_a_touched_table_is_named_by_its_posture() -> None:
    samples = at_rest(0, LOAD)
    touched = samples.tau_ext.copy()
    touched[3] += (0, 9, 0, 12, 0, 4, 0)
    spoilt = calibration.LoadSamples(samples.q, samples.tau, touched, samples.noise)
    with pytest.raises(CommandRejected, match=r"do not fit one load, sample \d least.*touch something"):
        calibration.estimate_load(spoilt, robot=IIWA)


def test_samples_of_other_shapes_are_refused() -> None:
    with pytest.raises(ShapeError, match="tau must have shape"):
        calibration.LoadSamples(RESTS, RESTS[:3], RESTS, RESTS)
    with pytest.raises(LimitError, match="noise"):
        calibration.LoadSamples(RESTS, RESTS, RESTS, np.full_like(RESTS, np.nan))
