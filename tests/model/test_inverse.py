"""Inverse kinematics: complete, exact, continuous, with Sunrise's redundancy; free joints stay where they are."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm import model
from heptarm.errors import CommandRejected, LimitError, ShapeError, Unreachable
from heptarm.model.inverse_kinematics import PathInverse, inside
from heptarm.values.pose import Pose, Redundancy, deg
from heptarm.values.robot import ROBOTS, RobotModel
from tests.long import longer
from tests.model.arms import MODELS, denavit_hartenberg, random_q
from tests.oracles import inverse_kinematics as oracle

each_robot = pytest.mark.parametrize("robot", MODELS, ids=lambda m: m.name)

HERE = Pose.of((0.0, 0.0, 0.0))
#: Postures that people teach.
CANDLE = deg(0, 0, 0, 0, 0, 0, 0)
ROUND = {
    "A2, A4 and A6 at 0": deg(20, 0, 40, 0, -20, 0, 10),
    "A2 at 0": deg(20, 0, 40, -90, 0, 60, 0),
    "A6 at 0": deg(0, 45, 0, -90, 0, 0, 0),
    "wrist over the shoulder": deg(0, 30, 0, -60, 50, 0, -20),
    "candle": CANDLE,
    "A3 at a right angle": deg(0, 0, 90, -90, 0, 90, 0),
}


def surplus(robot: RobotModel, q: np.ndarray, noise: np.ndarray) -> float:
    """How much farther than allowed the solution next to q is, for the pose of q + noise [rad]."""
    found = model.solve(robot, model.forward(robot, q + noise), near=q)
    robot.check(found)
    assert np.array_equal(found, model.solve(robot, model.forward(robot, q + noise), near=q))
    assert np.array_equal(found, model.solve_batch(robot, model.forward(robot, q + noise)[None], near=q)[0])
    return float(np.abs(found - q).max() - max(10.0 * np.abs(noise).max(), 1e-6))


# -------------------------------------------------------------------------------------------------- free joints stay


@st.composite
def round_postures(draw: st.DrawFn) -> tuple[RobotModel, np.ndarray, np.ndarray]:
    """A robot at multiples of 15 or 45 degrees, and noise of its joints."""
    robot = ROBOTS[draw(st.sampled_from(sorted(ROBOTS)))]
    step = draw(st.sampled_from((15, 45)))
    most = np.floor(np.degrees(robot.q_max) / step + 1e-9).astype(int).tolist()
    q = deg(*(step * draw(st.integers(-most[i], most[i])) for i in range(7)))
    size = draw(st.sampled_from((0.0, *(10.0**k for k in range(-16, -4)))))
    return robot, q, size * np.array(draw(st.lists(st.floats(-1, 1), min_size=7, max_size=7)))


@settings(max_examples=longer(250, 20_000), deadline=None)
@given(round_postures())
def test_a_pose_of_a_round_posture_has_it_as_a_solution(
    given_: tuple[RobotModel, np.ndarray, np.ndarray],
) -> None:
    robot, q, noise = given_
    assert surplus(robot, q, noise) <= 0.0


@each_robot
@pytest.mark.parametrize("noise", [0.0, 1e-16, 1e-13, 1e-10, 1e-8, 1e-5])
def test_taught_postures_stay(robot: RobotModel, noise: float) -> None:
    rng = np.random.default_rng(21)
    for q in ROUND.values():
        for _ in range(20):
            assert surplus(robot, q, noise * rng.uniform(-1, 1, 7)) <= 0.0


@each_robot
def test_many_round_postures_in_one_call(robot: RobotModel) -> None:
    rng = np.random.default_rng(22)
    most = np.floor(np.degrees(robot.q_max) / 15 + 1e-9)
    for size in (0.0, 1e-12, 1e-9, 1e-7, 1e-5):
        q = np.radians(15 * rng.integers(-most, most + 1, (4000, 7)))
        q[rng.random(q.shape) < 0.3] = 0.0
        noise = rng.uniform(-size, size, q.shape)
        poses = model.forward_batch(robot, q + noise)
        found = model.solve_batch(robot, poses, near=q)
        allowed = np.maximum(10.0 * np.abs(noise).max(axis=1), 1e-6)
        assert (np.abs(found - q).max(axis=1) <= allowed).all()
        assert np.abs(model.forward_batch(robot, found) - poses).max() < 2e-9 + (size > 0) * 2e-5


@each_robot
def test_into_the_candle_moves_only_the_joints_that_it_needs(robot: RobotModel) -> None:
    """A smooth stream of poses into the candle swung joints by 115 degrees; it needs 10."""
    start, q = deg(0, 5, 0, -10, 0, 5, 0), deg(0, 5, 0, -10, 0, 5, 0)
    for part in np.linspace(0.0, 1.0, 201):
        q = model.solve(robot, model.forward(robot, (1.0 - part) * start), near=q)
        assert np.abs(q - start).max() <= deg(10.1)[0]
    assert np.abs(q).max() < deg(0.01)[0]


@each_robot
def test_to_the_candle_from_elsewhere(robot: RobotModel) -> None:
    start = deg(10, 20, 5, -40, 0, 40, 5)
    found = model.solve(robot, model.forward(robot, CANDLE), near=start)
    assert np.abs(found - start).max() <= deg(40.01)[0]


@each_robot
def test_a_path_through_the_wrist_singularity_is_continuous(robot: RobotModel) -> None:
    start = deg(0, 30, 0, -60, 0, 20, 0)
    first, q, path = Pose.from_matrix(model.forward(robot, start)), start, PathInverse(robot, HERE)
    for k in range(1, 401):
        # turning about the flange's y axis takes A6 from 20 to -20 deg
        pose = first @ Pose.xyz_abc(0, 0, 0, 0, -np.radians(40) * k / 400, 0)
        following = path.joints(pose.xyz.tolist(), pose.quat.tolist(), q)
        assert np.abs(following - q).max() < 0.01
        assert np.abs(model.solve(robot, pose, near=q) - q).max() < 0.01
        q = following
    assert q[5] < 0 and q[2] == 0.0


@each_robot
def test_a_pose_at_a_limit_is_reached(robot: RobotModel) -> None:
    q = robot.q_max * [0.5, 1.0, 0.5, -1.0, 0.5, 1.0, 0.5]
    for noise in (0.0, 1e-9, 1e-5):
        found = model.solve(robot, model.forward(robot, q + noise * np.sign(q)), near=q)
        robot.check(found)
        assert np.abs(found - q).max() <= max(10 * noise, 1e-6)


@each_robot
def test_nearest_of_all(robot: RobotModel) -> None:
    """Never more than the preference for A3 and Status beyond the nearest of all solutions by a dense search."""
    rng = np.random.default_rng(15)
    for _ in range(8):
        near, wanted = random_q(robot, rng, 0.7), model.forward(robot, random_q(robot, rng))
        found = model.solve(robot, wanted, near=near)
        others = [
            q
            for status in range(8)
            for low, high in model.intervals(robot, wanted, status)
            for angle in np.linspace(low, high, 40)[1:-1].tolist()
            if inside(robot, q := oracle.raw(robot, *oracle.rows(wanted), angle, status))
        ]
        nearest = min(float(np.linalg.norm(np.array(q) - near)) for q in others)
        away = float(np.linalg.norm(found - near))
        assert away <= 5.0 * nearest + 1e-7
        if abs(found[2] - near[2]) > 1e-7 and (np.abs(found - near) > pi / 2).any():
            assert away <= 1.01 * nearest


# ----------------------------------------------------------------------------------------------------- complete, exact


@each_robot
def test_complete(robot: RobotModel) -> None:
    """Random reachable poses, nothing else given: solved within the limits, to 1e-9 m and rad."""
    rng = np.random.default_rng(10)
    for _ in range(longer(500, 10_000)):
        wanted = denavit_hartenberg(robot, random_q(robot, rng))
        q = model.solve(robot, wanted)
        robot.check(q)
        reached = denavit_hartenberg(robot, q)
        assert np.linalg.norm(reached[:3, 3] - wanted[:3, 3]) < 1e-9
        assert Pose.from_matrix(reached).angle_to(Pose.from_matrix(wanted)) < 1e-9


@each_robot
def test_takes_poses(robot: RobotModel) -> None:
    q = deg(10, 30, -20, -80, 15, 50, 5)
    pose = Pose.from_matrix(model.forward(robot, q))
    assert np.abs(model.solve(robot, pose, near=q) - q).max() < 1e-8


@each_robot
def test_near_keeps_a3_and_status(robot: RobotModel) -> None:
    rng = np.random.default_rng(13)
    kept = 0
    for _ in range(200):
        q = random_q(robot, rng, 0.8)
        found = model.solve(robot, model.forward(robot, q + rng.normal(scale=1e-3, size=7)), near=q)
        robot.check(found)
        assert np.linalg.norm(found - q) < 5.0 * 1e-3 * 7
        kept += found[2] == q[2]
    assert kept > 180


@each_robot
@pytest.mark.parametrize("small", [0.0, 1e-12, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4])
@pytest.mark.parametrize("axes", [(1,), (3,), (5,), (1, 5), (1, 3), (3, 5), (1, 3, 5)])
def test_exact_at_singularities(robot: RobotModel, axes: tuple[int, ...], small: float) -> None:
    rng = np.random.default_rng(19)
    for _ in range(10):
        q = random_q(robot, rng)
        for axis in axes:
            q[axis] = small * rng.choice([-1, 1])
        wanted = model.forward(robot, q)
        own = model.redundancy(robot, q)
        for found in (
            model.solve(robot, wanted, near=q),
            model.solve(robot, wanted, near=q, e1=own.e1, status=own.status),
        ):
            assert np.abs(model.forward(robot, found) - wanted).max() < 1e-9


@each_robot
def test_wrist_over_the_base(robot: RobotModel) -> None:
    """Where A1 alone is not determined by the wrist, the pose is still met, and A1 stays."""
    for sign in (1, -1):
        q4 = sign * 1.0
        tilt = -np.arctan2(-robot.d_ew * np.sin(q4), robot.d_se + robot.d_ew * np.cos(q4))
        q = np.array([0.4, tilt, 0.0, q4, 0.3, 0.6, -0.2])
        assert np.abs(model.solve(robot, model.forward(robot, q), near=q) - q).max() < 1e-9


# ---------------------------------------------------------------------------------------------------------- redundancy


@each_robot
def test_e1_is_the_angle_of_a3(robot: RobotModel) -> None:
    q = deg(20, 40, -35, -60, 30, 40, 10)
    own = model.redundancy(robot, q)
    assert own == Redundancy(q[2], 2, 0b0001100)
    for e1 in deg(-60, -20, 0, 15):
        found = model.solve(robot, model.forward(robot, q), e1=e1, near=q)
        assert found[2] == pytest.approx(e1, abs=1e-12)
        assert np.abs(model.forward(robot, found) - model.forward(robot, q)).max() < 1e-9


@each_robot
def test_redundancy_and_back(robot: RobotModel) -> None:
    """q -> pose, E1, Status -> q."""
    rng = np.random.default_rng(12)
    for _ in range(2000):
        q = random_q(robot, rng)
        own = model.redundancy(robot, q)
        again = model.solve(robot, model.forward(robot, q), e1=own.e1, status=own.status)
        assert np.abs(again - q).max() < 1e-8
        assert model.redundancy(robot, again).status == own.status


@each_robot
def test_round_postures_and_back(robot: RobotModel) -> None:
    """A posture's own E1 and Status give it back, next to it; of 972 such postures 120 failed."""
    steps = [
        np.array(one)
        for one in ((-90, 0, 90), (-45, 0, 60), (-90, 0, 90), (-90, 0), (-90, 0, 90), (-60, 0, 45))
    ]
    grid = np.stack(np.meshgrid(*steps, [0.0, 45.0], indexing="ij"), axis=-1).reshape(-1, 7)
    q = np.radians(grid)
    own = model.redundancy_batch(robot, q)
    found = model.solve_batch(robot, model.forward_batch(robot, q), e1=own.e1, status=own.status, near=q)
    assert len(q) == 972
    assert np.abs(found - q).max() < 1e-6


@each_robot
@pytest.mark.parametrize("near", [None, deg(0, 30, 0, -90, 0, 60, 0)], ids=["alone", "from elsewhere"])
def test_a_straight_arm_with_a6_at_0_is_found_by_its_e1_and_status(
    robot: RobotModel, near: np.ndarray | None
) -> None:
    """Noise of 1e-16 in the pose is 1e-8 rad in A4 to A6 there, whose signs are Status: many were refused."""
    rng = np.random.default_rng(5)
    q = np.radians(15 * rng.integers(-7, 8, (longer(300, 10_000), 7)))
    q[:, [3, 5]] = 0.0
    q[q[:, 1] == 0.0, 1] = 0.5
    own, poses = model.redundancy_batch(robot, q), model.forward_batch(robot, q)
    found = model.solve_batch(robot, poses, e1=own.e1, status=own.status, near=near)
    assert np.isfinite(found).all()
    assert np.abs(model.forward_batch(robot, found) - poses).max() < 1e-7
    assert np.abs(found[:, 2] - q[:, 2]).max() < 1e-6


@each_robot
@pytest.mark.parametrize("near", [None, deg(0, 30, 0, -90, 0, 60, 0)], ids=["alone", "from elsewhere"])
@pytest.mark.parametrize("noise", [0.0, 1e-6])
def test_stretched_upwards_with_a1_and_a5_half_a_turn_apart_is_found_by_its_e1_and_status(
    robot: RobotModel, near: np.ndarray | None, noise: float
) -> None:
    """90,0,0,0,90,90,0: A1 is free there, and with that of `near` A5 would be half a turn: all were refused."""
    rng = np.random.default_rng(5)
    q = np.radians(15 * rng.integers(-6, 7, (longer(100, 5_000), 7)))
    q[:, [1, 3]] = 0.0
    q[:, 0] = np.radians(15 * rng.integers(1, 11, len(q)))
    q[:, 4] = np.pi - q[:, 0]
    q[::2, [0, 4]] *= -1.0
    own = model.redundancy_batch(robot, q)
    poses = model.forward_batch(robot, q + noise * rng.uniform(-1.0, 1.0, q.shape))
    found = model.solve_batch(robot, poses, e1=own.e1, status=own.status, near=near)
    assert np.isfinite(found).all()
    assert np.abs(model.forward_batch(robot, found) - poses).max() < 1e-7
    assert np.abs(found[:, 2] - q[:, 2]).max() < max(1e-6, 100.0 * noise)


@each_robot
def test_kukas_sample_moves_in_the_null_space(robot: RobotModel) -> None:
    """Sunrise's sample application: from 0,20,0,-110,0,-40,90 to the same frame with E1 at -80 degrees and back."""
    start = deg(0, 20, 0, -110, 0, -40, 90)
    pose, q, path = Pose.from_matrix(model.forward(robot, start)), start, PathInverse(robot, HERE)
    for degrees in (*range(0, -81, -1), *range(-80, 1)):
        q = path.joints(pose.xyz.tolist(), pose.quat.tolist(), q, a3=float(np.radians(degrees)))
        robot.check(q)
        assert q[2] == pytest.approx(np.radians(degrees), abs=1e-12)
    assert np.abs(q - start).max() < 1e-6


@each_robot
def test_status_and_turn_are_signs(robot: RobotModel) -> None:
    rng = np.random.default_rng(16)
    for _ in range(300):
        q = random_q(robot, rng)
        own = model.redundancy(robot, q)
        wrist = denavit_hartenberg(robot, q) @ np.array([0, 0, -robot.d_wf, 1.0])
        ahead = wrist[0] * np.cos(q[0]) + wrist[1] * np.sin(q[0])
        assert own.status == (ahead < 0) + 2 * (q[3] < 0) + 4 * (q[5] <= 0)
        assert [own.turn >> i & 1 for i in range(7)] == [int(v < 0) for v in q]


@each_robot
def test_all_branches(robot: RobotModel) -> None:
    rng = np.random.default_rng(17)
    for _ in range(100):
        q = random_q(robot, rng)
        wanted = model.forward(robot, q)
        own = model.redundancy(robot, q)
        found = model.solve_all(robot, wanted, e1=own.e1)
        assert 1 <= len(found) <= 8
        assert min(np.abs(other - q).max() for other in found) < 1e-8
        assert len({model.redundancy(robot, other).status for other in found}) == len(found)
        for other in [*found, *model.solve_all(robot, wanted)]:
            assert inside(robot, other.tolist())
            assert np.abs(model.forward(robot, other) - wanted).max() < 1e-9


# ----------------------------------------------------------------------------------------------------------- arm angle


@each_robot
def test_arm_angle_is_that_of_the_oracle(robot: RobotModel) -> None:
    rng = np.random.default_rng(23)
    for _ in range(500):
        q = random_q(robot, rng)
        status = model.redundancy(robot, q).status
        angle = model.arm_angle(robot, q)
        known = oracle.arm_angle(robot, q.tolist(), bool(status & 1))
        assert abs((angle - known + pi) % (2 * pi) - pi) < 1e-7
        wanted = model.forward(robot, q)
        found = model.solve(robot, wanted, arm_angle=angle, status=status)
        assert np.abs(found - q).max() < 1e-7
        by_oracle = oracle.raw(robot, *oracle.rows(wanted), known, status)
        assert np.abs(found - np.array(by_oracle)).max() < 1e-7


@each_robot
def test_arm_angle_is_zero_with_a3_at_zero(robot: RobotModel) -> None:
    for q in (
        deg(20, 40, 0, -60, 30, 40, 10),
        deg(-20, 30, 0, 50, 30, -40, 10),
        deg(5, -60, 0, -50, 0, 30, 0),
    ):
        assert model.arm_angle(robot, q) == pytest.approx(0.0, abs=1e-9)


@each_robot
def test_intervals_are_those_of_the_oracle(robot: RobotModel) -> None:
    rng = np.random.default_rng(18)
    for _ in range(40):
        wanted = model.forward(robot, random_q(robot, rng))
        for status in range(8):
            spans = model.intervals(robot, wanted, status)
            known = oracle.intervals(robot, wanted, status)
            assert len(spans) == len(known)
            assert np.allclose(spans, known, atol=1e-7)
            for low, high in spans:
                q = model.solve(robot, wanted, arm_angle=(low + high) / 2, status=status)
                assert model.redundancy(robot, q).status == status


@each_robot
def test_intervals_find_what_a_grid_would_miss(robot: RobotModel) -> None:
    """Close to six limits at once, hardly any arm angle is feasible."""
    corner = 0.9999 * robot.q_max * np.array([-1, 1, -1, 1, 1, 0.094, 1])
    wanted = model.forward(robot, corner)
    status = model.redundancy(robot, corner).status
    spans = model.intervals(robot, wanted, status)
    assert 0 < sum(b - a for a, b in spans) < 0.001
    found = model.solve(robot, wanted, status=status)
    robot.check(found)
    assert np.abs(model.forward(robot, found) - wanted).max() < 1e-9


# ------------------------------------------------------------------------------------------------------------- refusals


@each_robot
def test_unreachable_reports_why(robot: RobotModel) -> None:
    far = robot.d_se + robot.d_ew
    with pytest.raises(
        Unreachable, match=rf"the {robot.title} reaches .* to {far:.3f} m .bring the target"
    ) as e:
        model.solve(robot, Pose.xyz_abc(2.0, 0, 0.3))
    assert isinstance(e.value, LimitError)
    assert e.value.code == 51
    with pytest.raises(Unreachable, match="every arm position"):
        model.solve(
            robot, model.forward(robot, deg(0, 0, 0, -140, 0, 0, 0))
        )  # the elbow would be bent too much
    wanted = model.forward(robot, deg(0, 30, 0, -90, 0, 60, 0))
    with pytest.raises(Unreachable, match="with that E1 or Status .*leave E1 or Status free"):
        model.solve(robot, wanted, e1=3.0 * 0.98, status=0)
    with pytest.raises(
        Unreachable, match=r"E1 is the angle of A3, which must be in \[-170, 170\] deg .* got 180"
    ):
        model.solve(robot, wanted, e1=pi, status=2)
    with pytest.raises(CommandRejected, match="both e1 and arm_angle"):
        model.solve(robot, wanted, e1=0.1, arm_angle=0.1)


@each_robot
def test_what_is_not_given_may_be_said(robot: RobotModel) -> None:
    wanted = model.forward(robot, deg(0, 30, 0, -90, 0, 60, 0))
    nothing = Redundancy()
    assert np.array_equal(
        model.solve(robot, wanted, e1=nothing.e1, status=nothing.status), model.solve(robot, wanted)
    )
    with pytest.raises(LimitError, match="status must be .* got 8"):
        model.solve(robot, wanted, status=8)
    with pytest.raises(ShapeError, match="near must have shape"):
        model.solve(robot, wanted, near=[0.0] * 6)


def test_a_pose_out_of_reach_is_refused_with_the_distance_of_its_wrist() -> None:
    arm = ROBOTS["iiwa14"]
    turned = Pose.xyz_abc(1.2, 0.4, arm.d_bs + 0.3, 0.7, -0.4, 0.2)
    wrist = turned.xyz - arm.d_wf * turned.rotation[:, 2] - (0.0, 0.0, arm.d_bs)
    with pytest.raises(Unreachable, match=rf"the wrist would be {np.linalg.norm(wrist):.3f} m") as error:
        model.solve(arm, turned, near=np.zeros(7))
    assert f"to {arm.d_se + arm.d_ew:.3f} m" in str(error.value)
