"""Kinematics of many poses at once equal those of one pose at a time."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm import model
from heptarm.errors import LimitError, ShapeError, Unreachable
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import RobotModel
from tests.model.arms import MODELS, random_q

pytestmark = pytest.mark.parametrize("robot", MODELS, ids=lambda m: m.name)

#: More than two chunks.
COUNT = 5000
#: The stretched arm, A2 = 0, A6 = 0, A3 = 0, the wrist above the shoulder.
SPECIAL = np.radians(
    [
        [0, 0, 0, 0, 0, 0, 0],
        [10, 0, 20, -80, 15, 50, 5],
        [10, 30, -20, -80, 15, 0, 5],
        [10, 30, 0, -80, 0, 50, 5],
        [0, 0, 0, -90, 0, 90, 0],
        [30, -40, 0, 80, 0, -60, 0],
    ]
)


def _arms(robot: RobotModel, seed: int, count: int = COUNT) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.vstack([SPECIAL, *(random_q(robot, rng) for _ in range(count - len(SPECIAL)))])


def test_forward_and_jacobian_are_those_of_one_pose(robot: RobotModel) -> None:
    q = _arms(robot, 1)
    poses, jacobians = model.forward_batch(robot, q), model.jacobian_batch(robot, q)
    assert poses.shape == (COUNT, 4, 4) and jacobians.shape == (COUNT, 6, 7)
    for row in range(0, COUNT, 7):
        assert np.abs(poses[row] - model.forward(robot, q[row])).max() < 1e-14
        assert np.abs(jacobians[row] - model.jacobian(robot, q[row])).max() < 1e-14


def test_redundancy_is_that_of_one_pose(robot: RobotModel) -> None:
    q = _arms(robot, 2)
    found = model.redundancy_batch(robot, q)
    for row in range(0, COUNT, 7):
        one = model.redundancy(robot, q[row].tolist())
        assert found.e1[row] == one.e1 == q[row, 2]
        assert (found.status[row], found.turn[row]) == (one.status, one.turn)


def test_inverse_keeps_the_redundancy(robot: RobotModel) -> None:
    """q -> pose, E1, Status -> q."""
    q = _arms(robot, 3)
    own = model.redundancy_batch(robot, q)
    again = model.solve_batch(robot, model.forward_batch(robot, q), e1=own.e1, status=own.status)
    free = slice(len(SPECIAL), None)  # where a singularity leaves no choice
    assert np.abs(again[free] - q[free]).max() < 1e-7
    assert np.abs(model.forward_batch(robot, again) - model.forward_batch(robot, q)).max() < 1e-9


def test_inverse_is_that_of_one_pose(robot: RobotModel) -> None:
    """The same numbers, also where no arm position has this E1 and Status."""
    rng = np.random.default_rng(4)
    poses = model.forward_batch(robot, _arms(robot, 4, 400))
    e1, status = rng.uniform(-3.0, 3.0, 400), rng.integers(0, 8, 400)
    near = rng.uniform(robot.q_min, robot.q_max, (400, 7))
    for given in ({"e1": e1, "status": status}, {"near": near}, {"e1": e1}, {}):
        found = model.solve_batch(robot, poses[: len(e1)], **given)
        solved = 0
        for row in range(0, 400, 5 if "near" not in given else 20):
            one = {key: value[row].tolist() for key, value in given.items()}
            try:
                alone = model.solve(robot, poses[row], **one)
            except Unreachable:
                assert np.isnan(found[row]).all()
            else:
                solved += 1
                assert np.array_equal(found[row], alone)
        assert solved > 5


def test_near_decides_at_singularities(robot: RobotModel) -> None:
    q = _arms(robot, 5, 300)
    again = model.solve_batch(robot, model.forward_batch(robot, q), near=q)
    assert np.abs(again - q).max() < 1e-7
    for row in range(len(SPECIAL)):
        alone = model.solve(robot, model.forward(robot, q[row]), near=q[row].tolist())
        assert np.abs(again[row] - alone).max() < 1e-9


def test_one_hint_for_all(robot: RobotModel) -> None:
    near = deg(10, 30, -20, -80, 15, 50, 5)
    q = near + np.random.default_rng(6).normal(scale=0.02, size=(50, 7))
    found = model.solve_batch(robot, model.forward_batch(robot, q), near=near)
    own, wanted = model.redundancy_batch(robot, found), model.redundancy(robot, near)
    assert np.abs(own.e1 - wanted.e1).max() < 1e-9 and (own.status == wanted.status).all()


def test_out_of_reach_is_nan_and_the_others_are_solved(robot: RobotModel) -> None:
    q = deg(10, 30, -20, -80, 15, 50, 5)
    poses = model.forward_batch(robot, np.array([q, q, q]))
    poses[1, 0, 3] += 3.0
    found = model.solve_batch(robot, poses, near=q)
    assert np.isnan(found[1]).all() and np.abs(found[[0, 2]] - q).max() < 1e-9


def test_none_at_all(robot: RobotModel) -> None:
    nothing = np.zeros((0, 7))
    assert model.forward_batch(robot, nothing).shape == (0, 4, 4)
    assert model.jacobian_batch(robot, nothing).shape == (0, 6, 7)
    assert model.solve_batch(robot, np.zeros((0, 4, 4)), e1=0.0, status=2).shape == (0, 7)


@pytest.mark.parametrize(
    "turn",
    [np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3)), 1.1 * np.eye(3), 1e200 * np.eye(3), np.eye(3)[[1, 0, 2]]],
    ids=["left-handed", "zero", "scaled", "huge", "exchanged"],
)
def test_matrices_without_a_rotation_are_refused_as_poses_refuse_them(robot: RobotModel, turn: Array) -> None:
    words = "must be orthonormal and right-handed, got"
    poses = model.forward_batch(robot, np.full((3, 7), 0.3))
    poses[1, :3, :3] = turn
    with pytest.raises(ShapeError, match=rf"the rotation of poses\[1\] {words}"):
        model.solve_batch(robot, poses)
    for call in (model.solve, model.solve_all, lambda arm, pose: model.intervals(arm, pose, 2)):
        with pytest.raises(ShapeError, match=f"the rotation of pose {words}"):
            call(robot, poses[1])
    with pytest.raises(ShapeError, match=f"the rotation of matrix {words}"):
        Pose.from_matrix(poses[1])


def test_refuses(robot: RobotModel) -> None:
    with pytest.raises(ShapeError, match=r"q must have shape \(n, 7\), got \(7,\)"):
        model.forward_batch(robot, np.zeros(7))
    with pytest.raises(LimitError, match=r"q\[1, 2\] .*nan"):
        model.jacobian_batch(robot, [[0.0] * 7, [0, 0, np.nan, 0, 0, 0, 0]])
    poses = model.forward_batch(robot, np.zeros((3, 7)))
    with pytest.raises(LimitError, match=r"status must be an integer in \[0, 7\], got 8"):
        model.solve_batch(robot, poses, e1=0.0, status=[2, 8, 2])
    with pytest.raises(ShapeError, match=r"e1 must be one number or have shape \(3,\), got \(2,\)"):
        model.solve_batch(robot, poses, e1=[0.0, 0.1], status=2)
    with pytest.raises(ShapeError, match=r"near must have shape \(7,\) or \(3, 7\)"):
        model.solve_batch(robot, poses, near=np.zeros((2, 7)))
