"""Loads on the flange: declared ones are compensated, others count as external forces."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from heptarm.model import dynamics
from heptarm.model.kinematics import forward
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.robot import Body, symmetric
from tests.sim import motions
from tests.sim.driving import READY, Ear

G = 9.81
LOAD = Body(3.0, np.array((0.02, 0.0, 0.1)), inertia=np.array((0.02, 0.03, 0.025, 0.001, 0.0, 0.002)))
NOTHING = Body(0.0, np.zeros(3))


def held(*, declared: Body | None = None, hanging: Body | None = None) -> Plant:
    plant = Plant("iiwa14", q=READY)
    if declared is not None:
        plant.set_load_data(declared)
    if hanging is not None:
        plant.set_payload(hanging)
    plant.step(500)
    return plant


def weight(plant: Plant, load: Body) -> Array:
    """Force and torque that a load's weight exerts at the flange, base axes."""
    pose = forward(plant.robot, plant.snapshot.q)
    force = np.array((0.0, 0.0, -G * load.mass))
    return np.concatenate([force, np.cross(pose[:3, :3] @ load.com, force)])


def test_a_declared_load_is_carried_and_nobody_feels_it() -> None:
    bare, loaded = held().snapshot, held(declared=LOAD).snapshot
    assert np.abs(loaded.q - np.array(READY)).max() < 1e-6
    assert np.abs(loaded.tau_ext).max() < 1e-9
    assert np.abs(loaded.wrench).max() < 1e-9
    more = loaded.tau - bare.tau
    assert np.abs(more).max() > 5.0  # the motors hold it
    robot = Plant("iiwa14").robot
    expected = dynamics.gravity(robot, READY, load=LOAD) - dynamics.gravity(robot, READY)
    assert np.allclose(more, expected, atol=0.02)


def test_a_load_that_was_not_declared_is_an_external_force() -> None:
    plant = held(hanging=LOAD)
    seen = plant.snapshot
    assert np.allclose(seen.wrench, weight(plant, LOAD), atol=0.05)
    assert np.abs(seen.tau_ext).max() > 10.0
    assert np.abs(seen.q - np.array(READY)).max() < 2e-3  # position control holds it all the same


def test_a_change_of_the_load_takes_no_new_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tools come and go all day; MuJoCo's state has an arena of 13 MB, of which freed ones leave used pages behind."""
    plant = held(declared=LOAD, hanging=LOAD)
    plant.set_load_data(NOTHING)  # both models have been changed once
    made: list[mujoco.MjModel] = []
    monkeypatch.setattr(mujoco, "MjData", made.append)
    for _ in range(3):
        plant.set_payload(NOTHING)
        plant.set_load_data(LOAD)
        plant.set_payload(LOAD)
        plant.set_load_data(NOTHING)
    assert not made


def test_declaring_it_takes_the_force_away() -> None:
    plant = held(hanging=LOAD)
    plant.set_load_data(LOAD)
    plant.step(500)
    assert np.abs(plant.snapshot.wrench).max() < 1e-6
    plant.set_load_data(Body(5.0, LOAD.com, inertia=LOAD.inertia))
    plant.step(500)
    lacking = Body(2.0, LOAD.com)
    assert np.allclose(plant.snapshot.wrench, -weight(plant, lacking), atol=0.05)


def test_a_declared_load_that_does_not_hang_there_lifts_the_arm() -> None:
    plant = held(declared=LOAD, hanging=NOTHING)
    assert np.allclose(plant.snapshot.wrench, -weight(plant, LOAD), atol=0.05)


def test_a_spring_sags_by_the_weight_it_does_not_know() -> None:
    stiffness = 800.0
    sag = []
    for load in (NOTHING, LOAD):
        plant = held(hanging=load)
        plant.submit(
            MotionCommand(1, motions.hold(), mode=JointImpedance(stiffness, damping=0.7), listener=Ear())
        )
        plant.step(2000)
        sag.append(plant.snapshot.q - np.array(READY))
    expected = dynamics.gravity(plant.robot, plant.snapshot.q) - dynamics.gravity(
        plant.robot, plant.snapshot.q, load=LOAD
    )
    assert np.abs(sag[0]).max() < 1e-6
    assert np.allclose(sag[1] * stiffness, expected, rtol=0.02, atol=0.05)


@pytest.mark.parametrize("which", [LOAD, NOTHING])
def test_the_simulated_dynamics_are_those_of_the_model_with_the_load(which: Body) -> None:
    plant = held(declared=which)
    plant.submit(MotionCommand(1, motions.ptp((0.3, 0.7, 0.1, -1.1, 0.2, 0.8, 0.3)), listener=Ear()))
    plant.step(150)
    mass = np.zeros((plant.model.nv, plant.model.nv))
    mujoco.mj_fullM(plant.model, plant.data, mass)
    rotors = np.diag(plant.model.dof_armature[:7])
    expected = dynamics.mass_matrix(plant.robot, plant.snapshot.q, load=which)
    assert np.allclose(mass[:7, :7] - rotors, expected, atol=0.02)


def test_a_load_changes_without_a_jerk_while_the_arm_rests() -> None:
    plant = held()
    plant.set_load_data(LOAD)
    fastest = 0.0
    for _ in range(300):
        plant.tick()
        fastest = max(fastest, float(np.abs(plant.snapshot.dq).max()))
    assert fastest < 1e-4


def test_inertia_counts_as_it_was_given() -> None:
    body = Body(1.0, np.zeros(3), inertia=np.array((0.3, 0.2, 0.25, 0.02, 0.01, -0.03)))
    plant = Plant("iiwa14", q=READY)
    before = _spatial(plant)
    plant.set_load_data(body)
    plant.step(1)
    assert np.allclose(_spatial(plant) - before, symmetric(body.inertia), atol=2e-3)


def _spatial(plant: Plant) -> Array:
    """Inertia of the last link about its centre of mass, its own axes."""
    import mujoco

    index = int(plant.model.site("flange").bodyid[0])
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, plant.model.body_iquat[index])
    axes = turn.reshape(3, 3)
    inertia: Array = axes @ np.diag(plant.model.body_inertia[index]) @ axes.T
    return inertia
