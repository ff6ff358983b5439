"""Safety functions that depend on the load: what they count, when they stop the arm, what they refuse."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from heptarm.model import dynamics
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.safety_monitor import (
    LASTING,
    UNLIMITED,
    ExternalTorqueMonitor,
    SafetyLimits,
    parse_safety,
)
from heptarm.values.robot import Body, robot
from tests.sim import motions
from tests.sim.driving import READY

LOAD = Body(3.0, np.array((0.02, 0.0, 0.1)), inertia=np.array((0.02, 0.03, 0.025, 0.001, 0.0, 0.002)))
NOTHING = Body(0.0, np.zeros(3))
HOLD = MotionCommand(1, motions.hold())
FAST = MotionCommand(1, motions.ptp((1.2, 0.2, 0.3, -1.0, 0.4, 0.5, -0.8)))
#: Largest torque of the load at READY [Nm].
WEIGHT = float(
    np.abs(
        dynamics.gravity(robot("iiwa14"), READY, load=LOAD) - dynamics.gravity(robot("iiwa14"), READY)
    ).max()
)


def moving(
    limit: float, order: MotionCommand, *, declared: Body, counted: Body, hanging: Body | None = None
) -> Plant:
    """A plant that has begun a motion: loads of the controller, of the safety functions, and the true one."""
    plant = Plant("iiwa14", q=READY, limits=SafetyLimits(limit))
    plant.set_load_data(declared)
    plant.set_safety_load(counted, workpiece=counted.mass)
    if hanging is not None:
        plant.set_payload(hanging)
    plant.step(400)  # at rest: nothing is monitored
    assert not plant.safety.stop_requested
    plant.submit(order)
    plant.step(10 * LASTING)
    return plant


def stopped(plant: Plant) -> bool:
    return StopRequest.PROTECTIVE_STOP in plant.safety.stop_requests


@pytest.mark.parametrize(("part", "stops"), [(0.95, True), (1.05, False)])
def test_what_does_not_count_is_an_external_torque_of_its_weight(part: float, stops: bool) -> None:
    lifted = moving(part * WEIGHT, HOLD, declared=LOAD, counted=NOTHING)
    assert stopped(lifted) is stops
    missing = moving(part * WEIGHT, HOLD, declared=NOTHING, counted=LOAD)
    assert stopped(missing) is stops


def test_a_counted_load_is_none_however_fast_it_moves() -> None:
    plant = moving(0.5, FAST, declared=LOAD, counted=LOAD)
    plant.step(600)
    assert np.abs(plant.snapshot.dq).max() > 0.5 and not stopped(plant)


def test_acceleration_is_no_external_torque_where_only_the_safety_functions_know_the_load() -> None:
    """The motion controller does not know what hangs there, so the two models differ in inertia as well."""
    plant = moving(1.0, FAST, declared=NOTHING, counted=LOAD, hanging=LOAD)
    assert np.abs(plant.snapshot.tau_ext).max() > 10.0
    for _ in range(600):
        plant.tick()
        assert not stopped(plant)
    assert np.abs(plant.snapshot.dq).max() > 0.5


def test_a_push_counts_like_a_weight_and_the_stop_stays_until_it_is_withdrawn() -> None:
    plant = moving(12.0, HOLD, declared=LOAD, counted=LOAD)
    plant.apply_wrench((0.0, 0.0, -40.0), duration=0.1)
    plant.step(200)
    assert stopped(plant)
    plant.safety.withdraw()
    plant.resume()
    plant.step(200)
    assert not stopped(plant)


def test_a_short_torque_does_not_stop() -> None:
    plant = Plant("iiwa14", q=READY)
    plant.step(1)
    monitor = ExternalTorqueMonitor(plant.model, SafetyLimits(10.0))
    monitor.follow(plant.data)
    load = np.array((0.0, 11.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    own = (monitor._counted.mass, monitor._counted.bias, np.zeros(7))
    for _ in range(3):
        assert not any(monitor.check(load, *own) for _ in range(LASTING - 1))
        assert not monitor.check(0.9 * load, *own)
    reasons = [monitor.check(-load, *own) for _ in range(LASTING)]
    assert reasons[-1] == "safety function: external torque of A2 is 11 Nm, limit 10 Nm"


def test_a_safety_workpiece_may_be_as_heavy_as_allowed() -> None:
    plant = Plant("iiwa14", q=READY, limits=SafetyLimits(workpiece=5.0))
    plant.set_safety_load(LOAD, workpiece=5.0)
    with pytest.raises(ValueError, match="5.1 kg, the safety configuration allows 5 kg"):
        plant.set_safety_load(LOAD, workpiece=5.1)


def test_limits_are_read_from_a_text() -> None:
    assert parse_safety("") is UNLIMITED
    assert parse_safety("25") == SafetyLimits(25.0)
    assert parse_safety("inf,5") == SafetyLimits(inf, 5.0)


@pytest.mark.parametrize("text", ["x", "25,", "0", "25,-1", "nan", "1,2,3"])
def test_other_texts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="safety must be TORQUE or TORQUE,MASS above 0"):
        parse_safety(text)
