"""Straight servo motions through the whole stack, limits that a kind of stream does not obey, and the home position."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.mode.impedance import CartesianImpedance
from tests.conftest import RunningCabinet
from tests.retry import retry, starved

SPEED = 1.0  # streams by this machine's clock


@pytest.fixture
def arm(cabinet: RunningCabinet) -> Iterator[ha.Arm]:
    """An arm at home; patient, for busy machines."""
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
        yield arm


def _there(pose: ha.Pose, goal: ha.Pose) -> bool:
    return pose.distance_to(goal) < 1e-3 and pose.angle_to(goal) < 1e-3


def test_poses_are_followed_on_straight_lines(arm: ha.Arm) -> None:
    assert "servo_lin" in arm.capabilities
    places = []
    with arm.servo("lin", rate=50, speed_mps=0.1, acceleration_mps2=0.5, watchdog=2.0) as sv:
        start = sv.start.pose
        goal = ha.Pose.of(start.xyz + [0.0, 0.08, -0.06], start.quat) @ ha.Pose.xyz_abc(0, 0, 0, 0.2, 0, 0)
        while sv.tick() and sv.t < 30.0 and not _there(arm.state.pose, goal):
            sv.set(goal)
            places.append(arm.state.pose.xyz)
        assert len(places) > 10 and _there(arm.state.pose, goal)
        while sv.tick() and sv.stats.refused == 0 and sv.t < 20.0:
            sv.set(ha.Pose.of([3.0, 0, 0], start.quat))
    assert "not reachable" in sv.stats.text
    travel = (goal.xyz - start.xyz) / np.linalg.norm(goal.xyz - start.xyz)
    off = np.array(places) - start.xyz
    assert np.linalg.norm(off - np.outer(off @ travel, travel), axis=1).max() < 2e-3


def test_before_a_limit_it_rests_on_its_line_and_reports_which_axis(arm: ha.Arm) -> None:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 155)))
    with arm.servo("lin", rate=50, speed_radps=1.0, acceleration_radps2=4.0, watchdog=2.0) as sv:
        start = sv.start.pose
        goal = start @ ha.Pose.xyz_abc(0, 0, 0, np.radians(50), 0, 0)  # as A7 at -155 deg reaches it
        limit = arm.robot.q_max[6]
        while sv.tick() and sv.t < 30.0 and arm.state.q_cmd[6] < limit - 2e-3:
            sv.set(goal)
        assert limit - 2e-3 <= arm.state.q_cmd[6] < limit
        assert sv.stats.slowdown.reason == "limit of A7" and "limit of A7" in str(sv.stats)
        while sv.tick() and sv.t < 60.0 and not _there(arm.state.pose, start):
            sv.set(start)
        assert _there(arm.state.pose, start) and sv.active
    assert sv.result is not None and sv.result.cause is ha.Cause.CANCELLED


def test_a_straight_servo_is_compliant_and_renewed_after_its_time_out(arm: ha.Arm) -> None:
    compliant = CartesianImpedance((1500.0,) * 3 + (150.0,) * 3, damping=0.7)
    with arm.servo("lin", watchdog=2.0, goal_timeout=0.1, mode=compliant, speed_mps=0.2) as sv:
        start = sv.start.pose
        sv.set(start)
        sent = arm.state.stamp
        arm.wait_until(lambda state: state.stamp > sent + 400_000_000)  # reached, and timed out
        goal = ha.Pose.of(start.xyz + [0.0, 0.03, 0.0], start.quat)
        sv.set(goal)
        arm.wait_until(lambda state: state.pose.distance_to(goal) < 5e-3, timeout=20.0)
        sv.change(CartesianImpedance((800.0,) * 3 + (100.0,) * 3, damping=0.9))
    assert sv.stats.refused == 0


@pytest.mark.parametrize(
    ("kind", "settings", "word"),
    [
        ("lin", {"speed": 0.5}, "speed is a fraction"),
        ("lin", {"acceleration": 0.5}, "acceleration is a fraction"),
        ("lin", {"engine": "direct"}, "engine"),
        ("lin", {"speed_mps": 11.0}, "speed_mps"),
        ("lin", {"speed_radps": 0.0}, "speed_radps"),
        ("lin", {"acceleration_mps2": float("nan")}, "acceleration_mps2"),
        ("pose", {"speed_mps": 0.1}, "speed_mps applies"),
        ("joint", {"acceleration_radps2": 1.0}, "acceleration_radps2 applies"),
        ("joint", {"speed_timeout": 11.0}, "speed_timeout"),
        ("joint", {"speed_timeout": 0.5, "engine": "direct"}, "speed_timeout applies"),
        ("pose", {"speed_timeout": 0.5}, "speed_timeout applies"),
    ],
)
def test_limits_that_a_kind_does_not_obey_are_refused(
    arm: ha.Arm, kind: str, settings: dict[str, Any], word: str
) -> None:
    with pytest.raises(ha.CommandRejected, match=word):
        arm.servo(kind, **settings)  # type: ignore[call-overload]


def test_the_direct_engine_takes_no_velocity(arm: ha.Arm) -> None:
    with arm.servo("joint", engine="direct", watchdog=1.0) as sv:
        with pytest.raises(ha.CommandRejected, match="takes no velocity"):
            sv.set(sv.start.q, np.zeros(7))
        sv.set(sv.start.q)


def test_home_is_where_the_cabinet_reports(arm: ha.Arm) -> None:
    assert "ptp_home" in arm.capabilities
    seen = arm.move([ha.ptp_home(speed=0.8, blend_rel=0.2), ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))])
    assert seen.arrived
    assert arm.move(ha.ptp_home(speed=0.8)).arrived
    assert np.abs(arm.state.q).max() < 1e-3
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))


def test_the_velocity_of_a_target_is_kept_as_long_as_wanted(arm: ha.Arm) -> None:
    velocity = np.array([0, 0, 0, 0, 0, 0, 0.1])

    def keep() -> None:
        with arm.servo("joint", watchdog=2.0, speed=0.5, acceleration=1.0, speed_timeout=1.0) as sv:
            goal = sv.start.q + 0.02 * np.sign(velocity)
            sv.set(goal, velocity)
            passed = arm.wait_until(lambda state: state.q[6] > goal[6] + 0.06)
            assert passed.q[6] < goal[6] + 0.2

    retry(keep, starved)
