"""Forward kinematics and Jacobians against other ways to compute them."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.errors import LimitError, ShapeError
from heptarm.model.kinematics import flange, forward, jacobian, jacobian_derivative, manipulability, nullspace
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import RobotModel
from tests.model.arms import MODELS, denavit_hartenberg, random_q
from tests.oracles import kinematics as oracle

pytestmark = pytest.mark.parametrize("robot", MODELS, ids=lambda m: m.name)


def test_forward_is_that_of_denavit_hartenberg(robot: RobotModel) -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        q = random_q(robot, rng)
        assert np.abs(forward(robot, q) - denavit_hartenberg(robot, q)).max() < 1e-14


def test_forward_is_that_of_mujoco(robot: RobotModel) -> None:
    mujoco = pytest.importorskip("mujoco")
    from heptarm.sim.plant.world import specification

    model = specification(robot.name).compile()
    data = mujoco.MjData(model)
    site = data.site("flange")
    j = np.zeros((6, model.nv))
    rng = np.random.default_rng(2)
    for _ in range(100):
        q = random_q(robot, rng)
        data.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_jacSite(model, data, j[:3], j[3:], site.id)
        t = forward(robot, q)
        assert np.abs(t[:3, 3] - site.xpos).max() < 1e-12
        assert np.abs(t[:3, :3] - site.xmat.reshape(3, 3)).max() < 1e-12
        assert np.abs(jacobian(robot, q) - j[:, :7]).max() < 1e-12


def test_known_positions(robot: RobotModel) -> None:
    reach = robot.d_bs + robot.d_se + robot.d_ew + robot.d_wf
    assert Pose.from_matrix(forward(robot, np.zeros(7))) == Pose.at(z=reach)
    # A4 at -90 deg brings the forearm forward, along +x
    t = forward(robot, deg(0, 0, 0, -90, 0, 0, 0))
    assert np.allclose(t[:3, 3], (robot.d_ew + robot.d_wf, 0, robot.d_bs + robot.d_se))


def test_floats_and_arrays_agree(robot: RobotModel) -> None:
    q = [0.1, 0.2, 0.3, -0.4, 0.5, 0.6, 0.7]
    columns, p = flange(robot, q)
    t = forward(robot, q)
    assert np.array_equal(t[:3, :3], np.array(columns).T)
    assert tuple(t[:3, 3]) == p


def test_jacobian_is_the_derivative(robot: RobotModel) -> None:
    rng = np.random.default_rng(3)
    h = 1e-6
    for _ in range(30):
        q = random_q(robot, rng)
        j = jacobian(robot, q)
        for axis in range(7):
            step = np.zeros(7)
            step[axis] = h
            after, before = forward(robot, q + step), forward(robot, q - step)
            spin = (after[:3, :3] - before[:3, :3]) @ forward(robot, q)[:3, :3].T / (2 * h)
            assert np.abs((after[:3, 3] - before[:3, 3]) / (2 * h) - j[:3, axis]).max() < 1e-8
            assert np.abs(np.array([spin[2, 1], spin[0, 2], spin[1, 0]]) - j[3:, axis]).max() < 1e-8


def test_jacobian_of_a_tool_point(robot: RobotModel) -> None:
    q = deg(10, 30, -20, -80, 15, 50, 5)
    tool = np.array([0.05, -0.02, 0.2, 1.0])
    h = 1e-6
    point = (forward(robot, q) @ tool)[:3]
    numeric = np.array(
        [
            (forward(robot, q + h * e) @ tool - forward(robot, q - h * e) @ tool)[:3] / (2 * h)
            for e in np.eye(7)
        ]
    ).T
    assert np.abs(jacobian(robot, q, point)[:3] - numeric).max() < 1e-8


def test_links_are_those_of_mujoco(robot: RobotModel) -> None:
    mujoco = pytest.importorskip("mujoco")
    from heptarm.sim.plant.world import specification

    model = specification(robot.name).compile()
    data = mujoco.MjData(model)
    j = np.zeros((6, model.nv))
    rng = np.random.default_rng(6)
    for _ in range(20):
        q = random_q(robot, rng)
        data.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for link in range(1, 8):
            body = data.body(f"link_{link}")
            pose = forward(robot, q, link=link)
            assert np.abs(pose[:3, 3] - body.xpos).max() < 1e-9
            assert np.abs(pose[:3, :3].ravel() - body.xmat).max() < 1e-9
            point = (pose @ [0.03, -0.02, 0.1, 1.0])[:3]
            mujoco.mj_jac(model, data, j[:3], j[3:], point, body.id)
            assert np.abs(jacobian(robot, q, point, link=link) - j[:, :7]).max() < 1e-9


def test_the_table_of_denavit_and_hartenberg_is_the_robot(robot: RobotModel) -> None:
    assert robot.dh.shape == (7, 4)
    for q in np.random.default_rng(7).uniform(robot.q_min, robot.q_max, (20, 7)):
        pose = np.eye(4)
        for (a, alpha, d, theta), angle in zip(robot.dh, q):
            c, s, ca, sa = np.cos(theta + angle), np.sin(theta + angle), np.cos(alpha), np.sin(alpha)
            pose = pose @ [
                [c, -s * ca, s * sa, a * c],
                [s, c * ca, -c * sa, a * s],
                [0, sa, ca, d],
                [0, 0, 0, 1],
            ]
        assert np.abs(pose - forward(robot, q)).max() < 1e-14


def test_jacobian_derivative_is_the_derivative(robot: RobotModel) -> None:
    rng = np.random.default_rng(4)
    h = 1e-6
    for _ in range(30):
        q, dq = random_q(robot, rng), rng.normal(size=7)
        numeric = (jacobian(robot, q + h * dq) - jacobian(robot, q - h * dq)) / (2 * h)
        assert np.abs(jacobian_derivative(robot, q, dq) - numeric).max() < 1e-8


def test_manipulability_vanishes_at_a_singularity(robot: RobotModel) -> None:
    assert manipulability(robot, np.zeros(7)) < 1e-9
    assert manipulability(robot, deg(0, 30, 0, -90, 0, 60, 0)) > 0.01


def test_nullspace(robot: RobotModel) -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        q = random_q(robot, rng, 0.9)
        n = nullspace(robot, q)
        assert np.abs(n @ n - n).max() < 1e-9
        assert np.abs(jacobian(robot, q) @ n).max() < 1e-9
        assert np.trace(n) == pytest.approx(1.0)
        # along it the pose stays and only the arm angle moves
        step = 1e-5 * n[np.argmax(np.abs(np.diag(n)))]
        assert np.abs(forward(robot, q + step) - forward(robot, q)).max() < 1e-9


def test_refuses(robot: RobotModel) -> None:
    with pytest.raises(ShapeError, match=r"q must have shape \(7,\), got \(6,\)"):
        forward(robot, np.zeros(6))
    with pytest.raises(LimitError, match=r"q\[2\] .*nan"):
        jacobian(robot, [0, 0, np.nan, 0, 0, 0, 0])
    with pytest.raises(ShapeError, match=r"link 4 must be given with a point of it .*link=4"):
        jacobian(robot, np.zeros(7), link=4)
    with pytest.raises(LimitError, match=r"link must be in \[1, 7\]"):
        forward(robot, np.zeros(7), link=8)


def test_that_of_the_oracle_in_python(robot: RobotModel) -> None:
    rng = np.random.default_rng(31)
    for _ in range(200):
        q = random_q(robot, rng)
        assert np.abs(forward(robot, q) - oracle.forward(robot, q)).max() < 1e-14
        point = rng.normal(size=3)
        for link, at in ((7, None), (7, point), (4, point)):
            assert (
                np.abs(jacobian(robot, q, at, link=link) - oracle.jacobian(robot, q, at, link=link)).max()
                < 1e-14
            )
        for link in range(1, 8):
            assert np.abs(forward(robot, q, link=link) - oracle.forward(robot, q, link=link)).max() < 1e-14
