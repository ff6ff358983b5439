"""Torques and wrenches: the sensors show the load on the arm."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.kinematics import forward, jacobian
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from tests.sim import motions
from tests.sim.driving import ready


def test_at_rest_the_sensors_show_gravity_and_nothing_external() -> None:
    from heptarm import model

    plant = ready()
    plant.step(300)
    state = plant.snapshot
    assert state.tau_ext == pytest.approx(np.zeros(7), abs=1e-9)
    assert state.tau == pytest.approx(model.gravity(plant.robot, state.q), abs=0.05)


@pytest.mark.parametrize("force", [(0.0, 0.0, -20.0), (15.0, -10.0, 5.0)])
def test_a_push_shows_in_the_joints_and_in_the_wrench(force: tuple[float, float, float]) -> None:
    plant = ready()
    plant.apply_wrench(force)
    plant.step(600)
    state = plant.snapshot
    wanted = jacobian(plant.robot, state.q)[:3].T @ np.array(force)
    assert state.tau_ext == pytest.approx(wanted, abs=0.02 * float(np.linalg.norm(wanted)))
    assert state.wrench[:3] == pytest.approx(force, abs=0.02 * float(np.linalg.norm(force)))
    assert np.abs(state.q - state.q_cmd).max() < 1e-3, "position control holds against a push"
    plant.apply_wrench((0.0, 0.0, 0.0))
    plant.step(600)
    assert np.abs(plant.snapshot.tau_ext).max() < 1e-9


def test_a_push_may_be_limited_in_time() -> None:
    plant = ready()
    plant.apply_wrench((0.0, 10.0, 0.0), duration=0.1)
    plant.step(50)
    assert plant.snapshot.wrench[1] == pytest.approx(10.0, abs=0.3)
    plant.step(100)
    assert np.abs(plant.snapshot.wrench).max() < 1e-9


def test_the_floor_pushes_back() -> None:
    plant = Plant("iiwa14", q=(0.0, 1.1, 0.0, -1.0, 0.0, 1.0, 0.0))
    plant.step(50)
    assert np.abs(plant.snapshot.wrench).max() < 1e-9
    height = float(forward(plant.robot, plant.snapshot.q)[2, 3])
    down = (0.0, 0.0, -height - 0.01, 0.0, 0.0, 0.0, 1.0)
    plant.submit(MotionCommand(1, motions.lin_rel(down, (0, 0, 0, 1), velocity=0.2)))
    for _ in range(6000):
        plant.tick()
        if plant.snapshot.wrench[2] > 20.0:
            break
    assert plant.snapshot.wrench[2] > 20.0, "the floor should push the flange up"
    assert (plant.snapshot.tau_ext != 0.0).any()


def test_torques_stay_within_the_data_sheet() -> None:
    plant = ready()
    plant.apply_wrench((0.0, 0.0, -900.0))
    plant.step(200)
    assert (np.abs(plant.snapshot.tau_cmd) <= plant.robot.tau_max).all()
