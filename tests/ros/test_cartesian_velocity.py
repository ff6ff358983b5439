"""Joint velocities of twists: exact away from singularities, bounded in them, halted before joint limits."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.kinematics import forward, jacobian
from heptarm.ros.node.cartesian_velocity import joint_velocity, limited_twist, limited_velocity
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


def test_limits_keep_the_direction() -> None:
    twist = limited_twist(np.array([0.3, 0.4, 0.0, 0.0, 0.0, 0.1]), 0.25, 0.5)
    np.testing.assert_allclose(twist, [0.15, 0.2, 0.0, 0.0, 0.0, 0.05])
    assert limited_twist(np.zeros(6), 0.25, 0.5).tolist() == [0.0] * 6
    arm = robot("iiwa14")
    dq = np.array([9.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0])
    limited = limited_velocity(arm, HOME, dq, 0.5)
    np.testing.assert_allclose(limited, dq * limited[0] / 9.0)
    np.testing.assert_allclose(limited[0], 0.5 * arm.dq_max[0])


def test_the_arm_halts_before_a_joint_limit_and_may_leave_it() -> None:
    arm = robot("iiwa14")
    q, dq = HOME.copy(), 0.5 * np.eye(7)[6]
    for _ in range(2000):
        q = q + 0.01 * limited_velocity(arm, q, dq, 1.0)
    assert arm.q_max[6] - 0.02 < q[6] <= arm.q_max[6]
    q[6] = arm.q_max[6]
    assert limited_velocity(arm, q, dq, 1.0)[6] == 0.0
    assert limited_velocity(arm, q, -dq, 1.0)[6] == -0.5
