"""Contact under position control: the joints yield like a robot's, and nothing drives the force up at rest."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from heptarm.model.kinematics import forward, jacobian
from heptarm.planning.seam import MeasuringFrame, WrenchAbove, WrenchComponents
from heptarm.sim.control_laws.laws import STIFFNESS
from heptarm.sim.controller.command import ConditionWatch, MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.world import Box
from heptarm.values.checks import Array
from heptarm.values.mode.compliance import pressing
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.robot import robot
from tests.sim import motions
from tests.sim.driving import READY, ready, run

#: The flange points down.
DOWN = (0.0, 0.5236, 0.0, -1.5708, 0.0, 1.0472, 0.0)
ALL = WrenchComponents(7)
FLANGE = MeasuringFrame(point_moves=True, point=(0.0,) * 3, axes_move=True, axes=(0.0, 0.0, 0.0, 1.0))
POSTURES = [
    READY,
    (0.0,) * 7,
    (0.3, 1.4, -0.5, -0.3, 0.8, 0.2, 0.0),
    (1.0, -0.6, 2.0, 1.9, -2.0, -1.5, 1.0),
    (0.0, 1.57, 0.0, 0.0, 0.0, 0.0, 0.0),
]


def over_table(gap: float) -> Plant:
    """An arm that rests so far above a table [m]."""
    top = float(forward(robot("iiwa14"), DOWN)[2, 3]) - gap
    return Plant("iiwa14", q=DOWN, boxes=[Box((0.6, 0.0, 0.5 * top), (0.6, 0.6, top))])


def pressed(plant: Plant) -> float:
    """The vertical force of all contacts [N]."""
    total, one = 0.0, np.zeros(6)
    for index in range(plant.data.ncon):
        mujoco.mj_contactForce(plant.model, plant.data, index, one)
        total += abs(plant.data.contact[index].frame[2]) * one[0]
    return total


def touched(speed: float, *, until: float) -> tuple[Plant, Array]:
    """Move down until a force [N] and tick on for a second; the forces of every tick."""
    plant = over_table(0.01)
    watch = ConditionWatch(
        WrenchAbove(frame=FLANGE, components=ALL, threshold=until), lambda: None, breaks=True
    )
    down = (0.0, 0.0, -0.1, 0.0, 0.0, 0.0, 1.0)
    plant.submit(MotionCommand(1, motions.lin_rel(down, (0, 0, 0, 1), velocity=speed), watches=(watch,)))
    forces = []
    while not plant.idle:
        plant.tick()
        forces.append(float(np.linalg.norm(plant.snapshot.wrench[:3])))
    for _ in range(1000):
        plant.tick()
        forces.append(float(np.linalg.norm(plant.snapshot.wrench[:3])))
    return plant, np.array(forces)


@pytest.mark.parametrize("force", [(0.0, 0.0, -40.0), (25.0, -10.0, 5.0)])
def test_a_load_deflects_each_joint_by_its_torque(force: tuple[float, float, float]) -> None:
    plant = ready()
    plant.apply_wrench(force)
    plant.step(1500)
    state = plant.snapshot
    deflection = state.q - state.q_cmd
    torque = jacobian(plant.robot, state.q)[:3].T @ np.array(force)
    assert deflection == pytest.approx(torque / STIFFNESS, rel=0.02, abs=1e-6)
    plant.apply_wrench((0.0, 0.0, 0.0))
    plant.step(1000)
    assert np.abs(plant.snapshot.q - state.q_cmd).max() < 1e-5


def test_the_hand_is_as_stiff_as_an_lbr() -> None:
    plant = ready()
    jac = jacobian(plant.robot, plant.snapshot.q)[:3]
    stiffness = 1.0 / np.linalg.eigvalsh(jac @ np.diag(1.0 / STIFFNESS) @ jac.T)
    assert stiffness.min() > 1e4 and stiffness.max() < 1e6  # [N/m]


@pytest.mark.parametrize("q", POSTURES)
def test_a_blow_dies_away_in_every_posture(q: tuple[float, ...]) -> None:
    plant = Plant("iiwa14", q=q, monitored=False)
    plant.apply_wrench((60.0, -80.0, 50.0), (5.0, 5.0, 5.0), duration=0.01)
    plant.step(40)
    early = float(np.abs(plant.snapshot.dq).max())
    plant.step(460)
    assert early > 1e-4
    assert float(np.abs(plant.snapshot.dq).max()) < 0.02 * early
    assert np.abs(plant.snapshot.q - np.array(q)).max() < 1e-4


@pytest.mark.parametrize(("speed", "most"), [(0.01, 28.0), (0.02, 35.0), (0.05, 80.0)])
def test_a_contact_stays_near_its_threshold(speed: float, most: float) -> None:
    plant, forces = touched(speed, until=20.0)
    assert 20.0 < forces.max() < most
    rest = forces[-1]
    assert rest < most and np.abs(forces[-500:] - rest).max() < 1.0
    assert forces[-200:].mean() == pytest.approx(forces[-800:-600].mean(), abs=0.3), (
        "it must not grow at rest"
    )
    assert np.median([_speed(plant) for _ in range(200)]) < 1e-3, (
        "a contact at rest trembles, by chance at each moment"
    )


def _speed(plant: Plant) -> float:
    """Of the fastest joint, after a tick [rad/s]."""
    plant.tick()
    return float(np.abs(plant.snapshot.dq).max())


def test_a_contact_ends_its_motion_soon() -> None:
    _, forces = touched(0.02, until=20.0)
    fired = int(np.argmax(forces > 20.0))
    assert len(forces) - 1000 - fired < 400


def test_a_compliant_hold_relaxes_a_contact_for_good() -> None:
    plant, forces = touched(0.05, until=20.0)
    run(plant, MotionCommand(2, motions.hold(0.2), mode=JointImpedance(1000.0, damping=1.0)))
    plant.step(500)
    assert float(np.linalg.norm(plant.snapshot.wrench[:3])) < 0.3 * forces[-1]


@pytest.mark.parametrize("friction", [0.3, 1.0])
def test_a_press_along_a_table_keeps_its_force(friction: float) -> None:
    """A surface that was hard from the first micrometre on lost contact in 27 % of the ticks."""
    plant = over_table(0.0)
    plant.model.geom_friction[:, 0] = friction
    ahead = (0.08, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    plant.submit(
        MotionCommand(1, motions.lin_rel(ahead, (0, 0, 0, 1), velocity=0.05), mode=pressing("z", 15.0))
    )
    forces = []
    while not plant.idle:
        plant.tick()
        forces.append(pressed(plant))
    slid = np.array(forces[300:])
    assert len(slid) > 1000 and (slid > 0.0).all()
    assert np.sqrt(np.mean((slid - 15.0) ** 2)) < 1.5


def test_brakes_that_close_in_contact_hold_and_open_without_a_step() -> None:
    plant, forces = touched(0.02, until=20.0)
    from heptarm.sim.controller.safety import StopRequest

    before = plant.snapshot.q
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    plant.step(300)
    assert plant.snapshot.tau_cmd == pytest.approx(np.zeros(7)), "the brakes are closed"
    assert float(np.linalg.norm(plant.snapshot.wrench[:3])) == pytest.approx(forces[-1], abs=1.0)
    plant.safety.withdraw()
    plant.resume()
    plant.step(300)
    assert np.abs(plant.snapshot.q - before).max() < 2e-5
