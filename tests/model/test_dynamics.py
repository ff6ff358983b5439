"""Dynamics against MuJoCo, pinocchio (where installed) and the laws they must obey."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from heptarm.errors import LimitError, ShapeError
from heptarm.model.dynamics import (
    GRAVITY,
    centrifugal_matrix,
    coriolis,
    coriolis_matrix,
    forward_dynamics,
    gravity,
    inverse_dynamics,
    mass_matrix,
)
from heptarm.model.kinematics import forward, jacobian
from heptarm.values.robot import ROBOTS, Body, Friction, RobotModel
from tests.model.arms import random_q
from tests.oracles import dynamics as oracle

ALL = list(ROBOTS.values())
LOAD = Body(3.0, np.array((0.02, -0.01, 0.08)), np.array((0.02, 0.03, 0.025, 0.001, -0.002, 0.003)))


def by_name(robot: RobotModel) -> str:
    return robot.name


def mujoco_model(robot: RobotModel, load: Body | None = None) -> tuple[Any, Any]:
    """The plant's model reduced to rigid-body dynamics, optionally with a load."""
    mujoco = pytest.importorskip("mujoco")
    from heptarm.sim.plant.world import specification

    spec = specification(robot.name)
    if load is not None:
        xx, yy, zz, xy, xz, yz = load.inertia
        tool = spec.body("link_7").add_body(name="load", pos=robot.links.flange)
        tool.mass, tool.ipos, tool.fullinertia = load.mass, load.com, [xx, yy, zz, xy, xz, yz]
        tool.explicitinertial = True
    model = spec.compile()
    model.dof_armature[:] = 0
    model.dof_damping[:] = 0
    return model, mujoco.MjData(model)


@pytest.mark.parametrize("robot", ALL, ids=by_name)
@pytest.mark.parametrize("load", [None, LOAD], ids=["bare", "loaded"])
def test_that_of_mujoco(robot: RobotModel, load: Body | None) -> None:
    mujoco = pytest.importorskip("mujoco")
    model, data = mujoco_model(robot, load)
    rng = np.random.default_rng(20)
    full = np.zeros((model.nv, model.nv))
    # MuJoCo 3 knows the inertia of a body to seven digits only
    loose = 1e5 if mujoco.__version__.startswith("3.") else 1.0
    for _ in range(50):
        q, dq, ddq = random_q(robot, rng), rng.normal(size=7), rng.normal(size=7)
        data.qpos[:7], data.qvel[:7], data.qacc[:7] = q, dq, ddq
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        assert np.abs(mass_matrix(robot, q, load=load) - full[:7, :7]).max() < 1e-12 * loose
        bias = coriolis(robot, q, dq, load=load) + gravity(robot, q, load=load)
        assert np.abs(bias - data.qfrc_bias[:7]).max() < 1e-11 * loose
        tau = full[:7, :7] @ ddq + data.qfrc_bias[:7]
        assert np.abs(inverse_dynamics(robot, q, dq, ddq, load=load) - tau).max() < 1e-11 * loose
        assert np.abs(forward_dynamics(robot, q, dq, tau, load=load) - ddq).max() < 1e-8 * loose


@pytest.mark.parametrize("robot", ALL, ids=by_name)
def test_links_are_those_of_the_plant(robot: RobotModel) -> None:
    pytest.importorskip("mujoco")
    model, _ = mujoco_model(robot)
    links = robot.links
    for index in range(7):
        body = model.body(f"link_{index + 1}")
        assert body.mass[0] == links.mass[index]
        assert np.array_equal(body.pos, links.origin[index])
        assert np.abs(body.ipos - links.com[index]).max() < 1e-15


@pytest.mark.parametrize("robot", ALL, ids=by_name)
def test_that_of_pinocchio(robot: RobotModel) -> None:
    pin = pytest.importorskip("pinocchio")
    links = robot.links
    model = pin.Model()
    parent = 0
    y, z = (pin.JointModelRY, pin.JointModelRZ)
    minus_y = lambda: pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0]))  # noqa: E731
    for index, joint in enumerate((z, y, z, minus_y, z, y, z)):
        place = pin.SE3(np.eye(3), links.origin[index].copy())
        parent = model.addJoint(parent, joint(), place, f"A{index + 1}")
        inertia = pin.Inertia(float(links.mass[index]), links.com[index].copy(), links.inertia[index].copy())
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    data = model.createData()
    rng = np.random.default_rng(21)
    for _ in range(30):
        q, dq, ddq = random_q(robot, rng), rng.normal(size=7), rng.normal(size=7)
        upper = np.triu(pin.crba(model, data, q))
        assert np.abs(mass_matrix(robot, q) - (upper + np.triu(upper, 1).T)).max() < 1e-12
        assert np.abs(inverse_dynamics(robot, q, dq, ddq) - pin.rnea(model, data, q, dq, ddq)).max() < 1e-11
        assert np.abs(gravity(robot, q) - pin.computeGeneralizedGravity(model, data, q)).max() < 1e-11


def test_centrifugal_torques_are_those_of_the_mass_matrix() -> None:
    """By Christoffel's symbols: b[k, i] = dM[k, i]/dq[i] - dM[i, i]/dq[k] / 2."""
    robot, h = ROBOTS["iiwa14"], 1e-6
    q = random_q(robot, np.random.default_rng(23))
    slopes = [
        (mass_matrix(robot, q + h * one, load=LOAD) - mass_matrix(robot, q - h * one, load=LOAD)) / (2 * h)
        for one in np.eye(7)
    ]
    wanted = [[slopes[i][k, i] - 0.5 * slopes[k][i, i] for i in range(7)] for k in range(7)]
    assert np.abs(centrifugal_matrix(robot, q, load=LOAD) - wanted).max() < 1e-8


@pytest.mark.parametrize("robot", ALL, ids=by_name)
def test_laws(robot: RobotModel) -> None:
    rng = np.random.default_rng(22)
    h = 1e-6
    for _ in range(20):
        q, dq, ddq = random_q(robot, rng), rng.normal(size=7), rng.normal(size=7)
        m, c = mass_matrix(robot, q, load=LOAD), coriolis_matrix(robot, q, dq, load=LOAD)
        assert np.abs(m - m.T).max() < 1e-13
        assert np.linalg.eigvalsh(m).min() > 0
        rate = (mass_matrix(robot, q + h * dq, load=LOAD) - mass_matrix(robot, q - h * dq, load=LOAD)) / (
            2 * h
        )
        passive = rate - 2 * c
        assert np.abs(passive + passive.T).max() < 1e-8
        assert np.allclose(coriolis(robot, q, 2 * dq), 4 * coriolis(robot, q, dq), atol=1e-10)
        tau = inverse_dynamics(robot, q, dq, ddq, load=LOAD)
        assert np.abs(forward_dynamics(robot, q, dq, tau, load=LOAD) - ddq).max() < 1e-9


@pytest.mark.parametrize("robot", ALL, ids=by_name)
def test_gravity_is_the_slope_of_the_potential(robot: RobotModel) -> None:
    """The load adds the wrench of its weight, mapped by the Jacobian."""
    rng = np.random.default_rng(23)
    for _ in range(20):
        q = random_q(robot, rng)
        fraction = gravity(robot, q, load=LOAD) - gravity(robot, q)
        point = (forward(robot, q) @ np.append(LOAD.com, 1.0))[:3]
        weight = LOAD.mass * np.array(GRAVITY)
        assert np.abs(fraction + jacobian(robot, q, point)[:3].T @ weight).max() < 1e-10
        assert np.abs(gravity(robot, q, acceleration=(0, 0, 0))).max() == 0.0
    assert np.abs(gravity(robot, np.zeros(7))).max() < 0.5  # upright, hardly anything to hold


@pytest.mark.parametrize(("name", "moving"), [("iiwa7", 19.04), ("iiwa14", 22.85)])
def test_moving_mass(name: str, moving: float) -> None:
    assert ROBOTS[name].links.mass.sum() == pytest.approx(moving, abs=0.01)


def test_friction_acts_against_the_motion() -> None:
    robot = ROBOTS["iiwa14"]
    friction = Friction(viscous=[0.5] * 7, coulomb=2.0)
    q, dq, ddq = np.full(7, 0.3), np.array([1.0, -1.0, 0.5, 0.0, 0.2, -0.2, 0.1]), np.full(7, 0.1)
    added = inverse_dynamics(robot, q, dq, ddq, friction=friction) - inverse_dynamics(robot, q, dq, ddq)
    assert added == pytest.approx(0.5 * dq + 2.0 * np.sign(dq), abs=1e-6)
    tau = inverse_dynamics(robot, q, dq, ddq, load=LOAD, friction=friction)
    assert forward_dynamics(robot, q, dq, tau, load=LOAD, friction=friction) == pytest.approx(ddq, abs=1e-9)
    assert friction.torque(np.full(7, 0.01)) == pytest.approx(0.5 * 0.01 + 2.0 * np.tanh(1.0))
    assert (Friction().torque(dq) == 0.0).all() and Friction(1.0) == Friction([1.0] * 7)


def test_refuses() -> None:
    with pytest.raises(LimitError, match=r"coulomb\[2\] must be in \[0, 1000\], got -1"):
        Friction(1.0, [0, 0, -1, 0, 0, 0, 0])
    with pytest.raises(LimitError, match=r"transition must be in \(0, 10\] rad/s"):
        Friction(1.0, transition=0.0)
    with pytest.raises(LimitError, match=r"mass must be in \[0, 50\] kg, got -1 kg"):
        Body(-1.0, np.zeros(3))
    with pytest.raises(LimitError, match="principal moments 0, 0, 1"):
        Body(1.0, np.zeros(3), np.eye(6)[2])
    with pytest.raises(ShapeError, match="com must have shape"):
        Body(1.0, (0, 0))  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="dq must have shape"):
        coriolis(ROBOTS["iiwa7"], np.zeros(7), np.zeros(6))


@pytest.mark.parametrize("robot", ALL, ids=by_name)
@pytest.mark.parametrize("load", [None, LOAD], ids=["bare", "loaded"])
def test_that_of_the_oracle_in_python(robot: RobotModel, load: Body | None) -> None:
    rng = np.random.default_rng(32)
    for _ in range(30):
        q, dq = random_q(robot, rng), rng.normal(size=7)
        pairs = (
            (mass_matrix(robot, q, load=load), oracle.mass_matrix(robot, q, load=load)),
            (coriolis_matrix(robot, q, dq, load=load), oracle.coriolis_matrix(robot, q, dq, load=load)),
            (coriolis(robot, q, dq, load=load), oracle.coriolis(robot, q, dq, load=load)),
            (gravity(robot, q, load=load), oracle.gravity(robot, q, load=load)),
        )
        assert max(np.abs(ours - known).max() for ours, known in pairs) < 1e-12
