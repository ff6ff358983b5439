"""Inverse kinematics: complete, exact, continuous, and with KUKA's redundancy."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from heptarm.errors import LimitError, ShapeError, Unreachable
from heptarm.model import inverse_kinematics as ik
from heptarm.model.kinematics import forward
from heptarm.values.pose import Pose, Redundancy, deg
from heptarm.values.robot import RobotModel
from tests.long import longer
from tests.model.arms import MODELS, denavit_hartenberg, random_q

pytestmark = pytest.mark.parametrize("robot", MODELS, ids=lambda m: m.name)


def check_complete(robot: RobotModel, count: int, seed: int) -> None:
    """Random reachable poses, nothing else given: solved within the limits, to 1e-9 m and rad."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        wanted = denavit_hartenberg(robot, random_q(robot, rng))
        q = ik.solve(robot, wanted)
        robot.check(q)
        reached = denavit_hartenberg(robot, q)
        assert np.linalg.norm(reached[:3, 3] - wanted[:3, 3]) < 1e-9
        assert Pose.from_matrix(reached).angle_to(Pose.from_matrix(wanted)) < 1e-9


def test_complete(robot: RobotModel) -> None:
    check_complete(robot, longer(2000, 10_000), 10)


def test_redundancy_and_back(robot: RobotModel) -> None:
    """q -> pose, E1, Status -> q."""
    rng = np.random.default_rng(12)
    for _ in range(2000):
        q = random_q(robot, rng)
        own = ik.redundancy(robot, q)
        again = ik.solve(robot, forward(robot, q), e1=own.e1, status=own.status)
        assert np.abs(again - q).max() < 1e-8
        assert ik.redundancy(robot, again).status == own.status


def test_takes_poses(robot: RobotModel) -> None:
    q = deg(10, 30, -20, -80, 15, 50, 5)
    pose = Pose.from_matrix(forward(robot, q))
    assert np.abs(ik.solve(robot, pose, near=q) - q).max() < 1e-8


def test_near_keeps_arm_angle_and_status(robot: RobotModel) -> None:
    rng = np.random.default_rng(13)
    for _ in range(200):
        q = random_q(robot, rng, 0.8)
        moved = forward(robot, q + rng.normal(scale=1e-3, size=7))
        own = ik.redundancy(robot, q)
        found = ik.solve(robot, moved, near=q)
        now = ik.redundancy(robot, found)
        robot.check(found)
        if ik.inside(robot, ik.raw(robot, *ik.rows(moved), own.e1, own.status, q.tolist())):
            assert now.status == own.status
            assert abs((now.e1 - own.e1 + pi) % (2 * pi) - pi) < 1e-6


def test_near_itself_is_its_own_solution(robot: RobotModel) -> None:
    rng = np.random.default_rng(14)
    for _ in range(300):
        q = random_q(robot, rng)
        assert np.abs(ik.solve(robot, forward(robot, q), near=q) - q).max() < 1e-7


def test_near_chooses_the_closest_when_its_arm_angle_is_impossible(robot: RobotModel) -> None:
    rng = np.random.default_rng(15)
    ranges = robot.q_max - robot.q_min
    beaten = count = 0
    for _ in range(60):
        near, wanted = random_q(robot, rng, 0.7), forward(robot, random_q(robot, rng))
        found = ik.solve(robot, wanted, near=near)
        own = ik.redundancy(robot, near)
        if np.allclose(ik.redundancy(robot, found).e1, own.e1):
            continue
        count += 1
        status = ik.redundancy(robot, found).status
        others = [q for q in ik.solve_all(robot, wanted) if ik.redundancy(robot, q).status == status]
        beaten += min(np.sum(((q - near) / ranges) ** 2) for q in others) < np.sum(
            ((found - near) / ranges) ** 2
        )
    assert count > 10
    assert beaten <= 0.05 * count


def test_status_and_turn_are_signs(robot: RobotModel) -> None:
    rng = np.random.default_rng(16)
    for _ in range(300):
        q = random_q(robot, rng)
        own = ik.redundancy(robot, q)
        wrist = denavit_hartenberg(robot, q) @ np.array([0, 0, -robot.d_wf, 1.0])
        ahead = wrist[0] * np.cos(q[0]) + wrist[1] * np.sin(q[0])
        assert own.status == (ahead < 0) + 2 * (q[3] < 0) + 4 * (q[5] <= 0)
        assert [own.turn >> i & 1 for i in range(7)] == [int(v < 0) for v in q]


def test_arm_angle_is_zero_with_a3_at_zero(robot: RobotModel) -> None:
    for q in (
        deg(20, 40, 0, -60, 30, 40, 10),
        deg(-20, 30, 0, 50, 30, -40, 10),
        deg(5, -60, 0, -50, 0, 30, 0),
    ):
        assert ik.redundancy(robot, q).e1 == pytest.approx(0.0, abs=1e-9)


def test_all_branches(robot: RobotModel) -> None:
    rng = np.random.default_rng(17)
    for _ in range(100):
        q = random_q(robot, rng)
        wanted = forward(robot, q)
        own = ik.redundancy(robot, q)
        found = ik.solve_all(robot, wanted, e1=own.e1)
        assert 1 <= len(found) <= 8
        assert min(np.abs(other - q).max() for other in found) < 1e-8
        assert len({ik.redundancy(robot, other).status for other in found}) == len(found)
        for other in [*found, *ik.solve_all(robot, wanted)]:
            assert ik.inside(robot, other.tolist())
            assert np.abs(forward(robot, other) - wanted).max() < 1e-9


def test_intervals_are_exact(robot: RobotModel) -> None:
    """Against a fine grid: feasible inside, infeasible outside."""
    rng = np.random.default_rng(18)
    grid = np.linspace(-pi, pi, 181)[:-1]
    for _ in range(25):
        wanted = forward(robot, random_q(robot, rng))
        r, p = ik.rows(wanted)
        for status in range(8):
            spans = ik.intervals(robot, wanted, status)
            for e1 in grid.tolist():
                inside = any(a <= e1 + turn <= b for a, b in spans for turn in (0.0, 2 * pi))
                edge = any(abs(e1 + turn - x) < 1e-6 for s in spans for x in s for turn in (0.0, 2 * pi))
                assert edge or inside == ik.inside(robot, ik.raw(robot, r, p, e1, status))


def test_intervals_find_what_a_grid_would_miss(robot: RobotModel) -> None:
    """Close to six limits at once, hardly any arm angle is feasible."""
    corner = 0.9999 * robot.q_max * np.array([-1, 1, -1, 1, 1, 0.094, 1])
    wanted = forward(robot, corner)
    status = ik.redundancy(robot, corner).status
    spans = ik.intervals(robot, wanted, status)
    assert 0 < sum(b - a for a, b in spans) < 0.001
    found = ik.solve(robot, wanted, status=status)
    robot.check(found)
    assert np.abs(forward(robot, found) - wanted).max() < 1e-9


@pytest.mark.parametrize("small", [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("axes", [(1,), (3,), (5,), (1, 5), (1, 3), (3, 5), (1, 3, 5)])
def test_exact_at_singularities(robot: RobotModel, axes: tuple[int, ...], small: float) -> None:
    rng = np.random.default_rng(19)
    for _ in range(10):
        q = random_q(robot, rng)
        for axis in axes:
            q[axis] = small * rng.choice([-1, 1])
        wanted = forward(robot, q)
        own = ik.redundancy(robot, q)
        exact = ik.raw(robot, *ik.rows(wanted), own.e1, own.status, q.tolist())
        assert np.abs(forward(robot, np.array(exact)) - wanted).max() < 1e-9
        assert np.abs(forward(robot, ik.solve(robot, wanted, near=q)) - wanted).max() < 1e-9


def test_singular_wrist_keeps_a5_of_near(robot: RobotModel) -> None:
    q = deg(10, 30, 20, -80, 35, 0, -20)
    assert np.abs(ik.solve(robot, forward(robot, q), near=q) - q).max() < 1e-9


def test_wrist_over_the_base(robot: RobotModel) -> None:
    """Where A1 alone is not determined by the wrist, the pose is still met."""
    for sign in (1, -1):
        q4 = sign * 1.0
        tilt = -np.arctan2(-robot.d_ew * np.sin(q4), robot.d_se + robot.d_ew * np.cos(q4))
        q = np.array([0.4, tilt, 0.0, q4, 0.3, 0.6, -0.2])
        wanted = forward(robot, q)
        assert np.abs(forward(robot, ik.solve(robot, wanted, near=q)) - wanted).max() < 1e-9


def test_a_path_through_the_wrist_singularity_is_continuous(robot: RobotModel) -> None:
    start = deg(0, 30, 0, -60, 0, 20, 0)
    own = ik.redundancy(robot, start)
    first = Pose.from_matrix(forward(robot, start))
    q = start.tolist()
    for k in range(1, 401):
        # turning about the flange's y axis takes A6 from 20 to -20 deg
        pose = first @ Pose.xyz_abc(0, 0, 0, 0, -np.radians(40) * k / 400, 0)
        following = ik.raw(robot, *ik.rows(pose), own.e1, own.status, q, continuous=True)
        assert max(abs(a - b) for a, b in zip(following, q, strict=True)) < 0.01
        q = list(following)
    assert q[5] < 0


def test_unreachable_reports_why(robot: RobotModel) -> None:
    far = robot.d_se + robot.d_ew
    with pytest.raises(
        Unreachable, match=rf"the {robot.title} reaches .* to {far:.3f} m .bring the target"
    ) as e:
        ik.solve(robot, Pose.xyz_abc(2.0, 0, 0.3))
    assert isinstance(e.value, LimitError)
    assert e.value.code == 51
    with pytest.raises(Unreachable, match="every arm position"):
        ik.solve(robot, forward(robot, deg(0, 0, 0, -140, 0, 0, 0)))  # the elbow would be bent too much
    q = deg(0, 30, 0, -90, 0, 60, 0)
    with pytest.raises(Unreachable, match="with that E1 or Status .*leave E1 and Status free"):
        ik.solve(robot, forward(robot, q), e1=pi, status=0)


def test_what_is_not_given_may_be_said(robot: RobotModel) -> None:
    wanted = forward(robot, deg(0, 30, 0, -90, 0, 60, 0))
    nothing = Redundancy()
    assert np.array_equal(
        ik.solve(robot, wanted, e1=nothing.e1, status=nothing.status), ik.solve(robot, wanted)
    )
    with pytest.raises(LimitError, match="status must be .* got 8"):
        ik.solve(robot, wanted, status=8)
    with pytest.raises(ShapeError, match="near must have shape"):
        ik.solve(robot, wanted, near=[0.0] * 6)


def test_redundancy_is_a_value(robot: RobotModel) -> None:
    own = ik.redundancy(robot, deg(0, 30, 0, -90, 0, 60, 0))
    assert own == Redundancy(own.e1, 2, 8)
