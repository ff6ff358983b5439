"""Velocities: twists exact away from singularities, bounded in them; paths within every limit, and why they slow."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.inverse_kinematics import arm_angle
from heptarm.model.kinematics import forward, jacobian
from heptarm.model.velocity import (
    MARGIN,
    ElbowTask,
    Slowdown,
    VelocityPath,
    joint_velocity,
    limited_twist,
    ramped_twist,
    resolved_pose,
    resolved_twist,
    wall_velocity,
)
from heptarm.values.pose import Pose
from heptarm.values.robot import ROBOTS, robot
from tests.long import few, longer

HOME = np.radians([0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0])


@pytest.mark.parametrize("model", ROBOTS)
def test_away_from_singularities_the_twist_is_exact(model: str) -> None:
    arm = ROBOTS[model]
    rng = np.random.default_rng(3)
    for _ in range(20):
        twist = rng.normal(size=6)
        dq = joint_velocity(arm, HOME, twist)
        np.testing.assert_allclose(jacobian(arm, HOME) @ dq, twist, atol=1e-9)


def test_the_twist_of_a_tool_is_that_of_its_point() -> None:
    arm = robot("iiwa14")
    flange = forward(arm, HOME)
    point = flange[:3, 3] + 0.2 * flange[:3, 2]
    dq = joint_velocity(arm, HOME, np.array([0.0, 0.0, 0.0, 0.3, 0.0, 0.0]), point)
    step = 1e-6
    moved = forward(arm, HOME + step * dq)
    np.testing.assert_allclose((moved[:3, 3] + 0.2 * moved[:3, 2] - point) / step, 0.0, atol=1e-5)


@pytest.mark.parametrize("q", [np.zeros(7), np.radians([0, 0, 0, -90, 0, 0, 0]), HOME * 1e-3])
def test_in_a_singularity_no_joint_is_fast(q: np.ndarray) -> None:
    arm = robot("iiwa14")
    for axis in range(6):
        dq = joint_velocity(arm, q, 0.1 * np.eye(6)[axis])
        assert np.abs(dq).max() < 1.0
        # damping slows down, and never turns the motion around
        assert (jacobian(arm, q) @ dq)[axis] >= -1e-12


def test_a_path_through_a_singularity_has_no_steps() -> None:
    arm = robot("iiwa14")
    twist = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
    speeds = [joint_velocity(arm, HOME * (1.0 - s), twist) for s in np.linspace(0.0, 1.0, 2001)]
    assert max(np.abs(b - a).max() for a, b in zip(speeds, speeds[1:])) < 0.05  # noqa: RUF007


def test_a_limit_keeps_the_direction_of_a_twist() -> None:
    twist = limited_twist(np.array([0.3, 0.4, 0.0, 0.0, 0.0, 0.1]), 0.25, 0.5)
    np.testing.assert_allclose(twist, [0.15, 0.2, 0.0, 0.0, 0.0, 0.05])
    assert limited_twist(np.zeros(6), 0.25, 0.5).tolist() == [0.0] * 6


def test_a_ramp_goes_straight_to_its_goal_and_ends_there() -> None:
    twist, goal = np.array([0.0, 0.1, 0, 0, 0, 0.0]), np.array([0.1, 0.0, 0, 0, 0, 0.2])
    steps = [twist]
    while len(steps) < 200 and not np.array_equal(steps[-1], goal):
        steps.append(ramped_twist(steps[-1], goal, 0.01, 0.005))
    changes = np.diff(steps, axis=0)
    assert np.array_equal(steps[-1], goal)
    assert np.linalg.norm(changes[:, :3], axis=1).max() <= 0.01 + 1e-12
    assert np.linalg.norm(changes[:, 3:], axis=1).max() <= 0.005 + 1e-12
    line = (goal - twist) / np.linalg.norm(goal - twist)
    np.testing.assert_allclose(changes, np.outer(changes @ line, line), atol=1e-12)


def path(q: np.ndarray = HOME, *, speed: float = 0.5, acceleration: float = 0.2) -> VelocityPath:
    arm = robot("iiwa14")
    return VelocityPath(
        q,
        speed=speed * arm.dq_max,
        acceleration=acceleration * arm.ddq_max,
        q_min=arm.q_min + MARGIN,
        q_max=arm.q_max - MARGIN,
    )


def run(
    one: VelocityPath, command: np.ndarray, steps: int, dt: float = 0.01
) -> tuple[np.ndarray, np.ndarray, list[Slowdown]]:
    """Positions, accelerations and slowdowns of so many steps."""
    q, dq, why = [one.q], [one.dq], []
    for _ in range(steps):
        why.append(one.advance(command, dt))
        q.append(one.q)
        dq.append(one.dq)
    return np.array(q), np.diff(dq, axis=0) / dt, why


def test_a_path_reaches_its_velocity_with_a_limited_acceleration_and_keeps_the_direction() -> None:
    one, arm = path(), robot("iiwa14")
    command = np.array([0.4, 0.0, 0.1, 0.0, 0.0, 0.0, -0.2])
    q, acceleration, why = run(one, command, 100)
    np.testing.assert_allclose(one.dq, command)
    assert np.abs(acceleration).max() <= 0.2 * arm.ddq_max[0] * (1 + 1e-9)
    moved = q[-1] - q[0]
    np.testing.assert_allclose(moved, command * (moved[0] / 0.4), atol=1e-12)
    assert all(one.factor == 1.0 and not one.reason for one in why)
    _, _, why = run(one, 20.0 * command, 100)
    np.testing.assert_allclose(one.dq, 0.5 * arm.dq_max[0] / 0.4 * command)
    assert why[-1].reason == "speed of A1" and 0.0 < why[-1].factor < 0.2


@pytest.mark.parametrize("others", [0.0, 1.0])
@pytest.mark.parametrize("dt", [0.004, 0.01, 0.03])
def test_a_joint_brakes_before_its_limit_and_may_leave_it(others: float, dt: float) -> None:
    one, arm = path(speed=1.0), robot("iiwa14")
    command = np.array([0.05 * others, 0, 0, 0, 0, 0, 0.8])
    q, acceleration, why = run(one, command, round(10.0 / dt), dt)
    assert arm.q_max[6] - 2.0 * MARGIN < q[-1, 6] and q[:, 6].max() <= arm.q_max[6] - MARGIN + 1e-12
    assert np.abs(acceleration).max() <= 0.2 * arm.ddq_max[6] * 1.5
    assert why[-1].reason == "limit of A7" and why[-1].factor < 0.01
    assert np.abs(one.dq).max() < 1e-3, "the others have stopped, too: the direction stays"
    away, _, why = run(one, -command, 50, dt)
    assert away[-1, 6] < away[0, 6] - 0.01 and why[-1].factor == 1.0


def test_a_fast_joint_beside_a_limit_brakes_no_harder_than_it_may() -> None:
    start = HOME.copy()
    start[6] = robot("iiwa14").q_max[6] - 0.05
    one = path(start, speed=1.0)
    q, acceleration, _ = run(one, np.array([1.0, 0, 0, 0, 0, 0, 0.05]), 600)
    assert q[:, 6].max() <= robot("iiwa14").q_max[6] - MARGIN + 1e-12
    assert np.abs(acceleration).max() <= 2.0 * (1 + 1e-9)


def test_a_twist_into_the_stretched_arm_slows_down_and_reports_the_singularity() -> None:
    arm = robot("iiwa14")
    one = path(acceleration=0.2, speed=0.3)
    elbow = ElbowTask(arm, one.q)
    twist, least, jumps, before = np.array([0.1, 0, 0, 0, 0, 0.0]), 1.0, 0.0, np.zeros(7)
    for _ in range(2000):
        dq, singular = resolved_twist(arm, one, twist, elbow=elbow)
        one.advance(dq, 0.01)
        jumps, before = max(jumps, float(np.abs(one.dq - before).max())), one.dq
        if singular.reason:
            assert singular.reason == "singularity"
            least = min(least, singular.factor)
    assert least < 0.1 and jumps <= 0.2 * arm.ddq_max[0] * 0.01 * (1 + 1e-9)
    assert abs(one.q[3]) < 0.1, "it is stretched"
    assert np.abs(one.dq).max() < 0.05, "and almost at rest"


def test_a_point_slides_along_a_wall() -> None:
    place, low, high = np.zeros(3), np.full(3, -1.0), np.array([0.1, 1.0, 1.0])
    for _ in range(1000):
        velocity = wall_velocity(np.array([0.2, 0.05, 0.0]), place - low, high - place, 1.0)
        place = place + 0.01 * velocity
        assert place[0] <= 0.1
    np.testing.assert_allclose(place, [0.1, 0.5, 0.0], atol=1e-3)
    outside = np.array([0.3, 0.0, 0.0])
    assert wall_velocity(np.array([0.2, 0, 0]), outside - low, high - outside, 1.0)[0] == 0.0
    assert wall_velocity(np.array([-0.2, 0, 0]), outside - low, high - outside, 1.0)[0] == -0.2


# ------------------------------------------------------------------------------------------- the elbow

ELBOW_STARTS = [
    (20, 40, 30, -80, 20, 60, 10),
    # the same for a few seconds more
    *(
        pytest.param(start, marks=pytest.mark.slow)
        for start in ((0, 30, 0, -90, 0, 60, 0), (90, -45, 45, 90, -45, 45, 0))
    ),
]


def elbow_angle(q: np.ndarray, start: np.ndarray) -> float:
    """By how much the arm angle differs from that at the start [rad]."""
    arm = robot("iiwa14")
    return float((arm_angle(arm, q) - arm_angle(arm, start) + np.pi) % (2 * np.pi) - np.pi)


def driven(
    start: np.ndarray, twist: np.ndarray, seconds: float, *, elbow: ElbowTask | None = None
) -> tuple[VelocityPath, list[Slowdown]]:
    """A path along a twist in the axes of the flange, and what slowed it down after half a second."""
    arm, one, why = robot("iiwa14"), path(start, acceleration=0.5), []
    task = elbow or ElbowTask(arm, start)
    for step in range(round(seconds * 100)):
        axes = forward(arm, one.q)[:3, :3]
        dq, singular = resolved_twist(
            arm, one, np.concatenate([axes @ twist[:3], axes @ twist[3:]]), elbow=task
        )
        least = one.advance(dq, 0.01)
        if step > 50:
            why += [singular, least]
    return one, why


@pytest.mark.parametrize("model", ["iiwa7", "iiwa14"])
def test_a_turn_about_the_axis_of_the_flange_turns_a7_only(model: str) -> None:
    arm = ROBOTS[model]
    one, elbow = path(), ElbowTask(arm, HOME)
    for step in range(330):
        turn = 0.4 if step < 300 else 0.0
        dq, _ = resolved_twist(
            arm, one, turn * np.concatenate([np.zeros(3), forward(arm, one.q)[:3, 2]]), elbow=elbow
        )
        one.advance(dq, 0.01)
    np.testing.assert_allclose(np.degrees(one.q - HOME), [0, 0, 0, 0, 0, 0, 68.755], atol=2e-3)


@pytest.mark.parametrize("start", few(ELBOW_STARTS))
@pytest.mark.parametrize("seed", range(longer(1, 20)))
def test_after_a_minute_of_twists_that_return_the_elbow_is_where_it_was(
    start: tuple[float, ...], seed: int
) -> None:
    arm, random, q = robot("iiwa14"), np.random.default_rng(seed), np.radians(start)
    one, elbow, dt = path(q, speed=0.5), ElbowTask(arm, q), 0.02
    begin, twist, goal_twist, farthest = Pose.from_matrix(forward(arm, q)), np.zeros(6), np.zeros(6), 0.0
    for step in range(3000):
        here = Pose.from_matrix(forward(arm, one.q))
        back = here.displacement(begin)
        farthest = max(farthest, here.distance_to(begin))
        if step % 25 == 0:
            goal_twist = random.normal(size=6) * np.repeat([0.1, 0.3], 3)
        goal = goal_twist.copy()
        if step > 2500:
            goal = 3.0 * back
        else:  # within 0.15 m and 0.5 rad
            goal[:3] += back[:3] * (np.linalg.norm(back[:3]) > 0.15)
            goal[3:] += back[3:] * (np.linalg.norm(back[3:]) > 0.5)
        twist = ramped_twist(twist, limited_twist(goal, 0.25, 0.5), dt, 2.0 * dt)
        one.advance(resolved_twist(arm, one, twist, elbow=elbow)[0], dt)
    assert Pose.from_matrix(forward(arm, one.q)).distance_to(begin) < 1e-6 and farthest > 0.1
    assert abs(np.degrees(elbow_angle(one.q, q))) < 0.5
    assert np.degrees(np.abs(one.q - q)).max() < 0.5


def test_the_elbow_moves_before_a_limit_slows_the_twist_down() -> None:
    start = np.radians([0, 30, 0, -90, 0, 60, 170.0])
    one, why = driven(start, np.array([0, 0, 0, 0, 0, 0.2]), 2.0)
    flange = [Pose.from_matrix(forward(robot("iiwa14"), q)) for q in (start, one.q)]
    # A7 has 5 deg left, and the flange turns by 22
    assert np.degrees(flange[0].angle_to(flange[1])) > 20.0 and flange[0].distance_to(flange[1]) < 2e-3
    assert one.q[6] <= robot("iiwa14").q_max[6] - MARGIN + 1e-9
    assert min(slow.factor for slow in why) > 0.7
    assert abs(np.degrees(elbow_angle(one.q, start))) > 5.0


def test_with_a_posture_the_joints_come_near_to_it_and_the_flange_stays() -> None:
    arm, posture = robot("iiwa14"), np.radians([25, 32, -35, -90, 20, 60, -10])
    one, _ = driven(HOME, np.zeros(6), 4.0, elbow=ElbowTask(arm, HOME, posture=posture))
    here, before = (Pose.from_matrix(forward(arm, q)) for q in (one.q, HOME))
    assert here.distance_to(before) < 1e-3
    null = np.linalg.svd(jacobian(arm, one.q))[2][6]
    assert abs(null @ (posture - one.q)) < 1e-3, "no nearer place of the elbow"
    assert np.linalg.norm(posture - one.q) < 0.5 * np.linalg.norm(posture - HOME)


@pytest.mark.parametrize("start", [(20, 40, 100, -80, -120, 70, 10), (0, 30, 0, -90, 0, 60, 160)])
def test_in_the_center_the_joints_are_farther_from_their_limits(start: tuple[float, ...]) -> None:
    arm, q = robot("iiwa14"), np.radians(start)
    one, _ = driven(q, np.zeros(6), 4.0, elbow=ElbowTask(arm, q, elbow="center"))
    free = [0, 1, 2, 4, 5, 6]  # A4 depends on the pose alone
    before, after = (float((1.0 - np.abs(x) / arm.q_max)[free].min()) for x in (q, one.q))
    assert after > before + 0.1
    assert Pose.from_matrix(forward(arm, q)).distance_to(Pose.from_matrix(forward(arm, one.q))) < 3e-3


def test_nobody_moves_the_elbow_while_nothing_is_commanded() -> None:
    arm = robot("iiwa14")
    for elbow in (
        ElbowTask(arm, HOME, elbow="center"),
        ElbowTask(arm, HOME, posture=HOME + 0.2),
        ElbowTask(arm, HOME),
    ):
        one = path(HOME + 0.1)
        dq, _ = resolved_twist(arm, one, np.zeros(6), elbow=elbow, idle=True)
        assert not dq.any()


@pytest.mark.parametrize("start", few(ELBOW_STARTS))
def test_poses_that_return_bring_the_elbow_back(start: tuple[float, ...]) -> None:
    arm, first = robot("iiwa14"), np.radians(start)
    begin, q, elbow = Pose.from_matrix(forward(arm, first)), first, ElbowTask(arm, first)
    least = 0.0
    for t in np.linspace(0.0, 6.0 * np.pi, 900):
        offset = [0.08 * (np.cos(t) - 1.0), 0.08 * np.sin(t), 0.05 * np.sin(2 * t)]
        pose = Pose.of(begin.xyz + offset, begin.quat) @ Pose.xyz_abc(
            0, 0, 0, 0.3 * np.sin(t), 0.2 * np.sin(3 * t), 0
        )
        there = resolved_pose(arm, pose, q, elbow=elbow, reach=0.02)
        assert Pose.from_matrix(forward(arm, there)).distance_to(pose) < 1e-9
        assert np.abs(there - q).max() < 0.1, "no jump"
        q = there
        least = max(least, abs(elbow_angle(q, first)))
    assert np.degrees(np.abs(q - first)).max() < 0.01 and np.degrees(least) < 0.1


def test_with_a_posture_poses_bring_the_elbow_to_it() -> None:
    arm, posture = robot("iiwa14"), np.radians([25, 32, -35, -90, 20, 60, -10])
    pose, q = Pose.from_matrix(forward(arm, HOME)), HOME
    elbow = ElbowTask(arm, HOME, posture=posture)
    for _ in range(100):
        there = resolved_pose(arm, pose, q, elbow=elbow, reach=0.02)
        assert np.abs(there - q).max() < 0.03
        q = there
    assert Pose.from_matrix(forward(arm, q)).distance_to(pose) < 1e-9
    assert np.linalg.norm(posture - q) < 0.5 * np.linalg.norm(posture - HOME)
