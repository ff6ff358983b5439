"""Velocities: twists exact away from singularities, bounded in them; paths within every limit, and why they slow."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.kinematics import forward, jacobian
from heptarm.model.velocity import (
    MARGIN,
    ElbowTask,
    Slowdown,
    VelocityPath,
    joint_velocity,
    limited_twist,
    ramped_twist,
    resolved_twist,
    wall_velocity,
)
from heptarm.values.robot import ROBOTS, robot

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
