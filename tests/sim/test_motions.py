"""Motions of the plant end at their targets, follow straight lines, and keep every limit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm.model.kinematics import forward
from heptarm.planning.motion import PlanError
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.pose import Pose
from heptarm.values.robot import ROBOTS
from tests.sim import motions
from tests.sim.driving import READY, Ear, numbers, ready, run

SEVENTH = (0.1,) * 7


def pose_of(plant: Plant) -> Pose:
    return Pose.from_matrix(forward(plant.robot, plant.snapshot.q))


@pytest.mark.parametrize("model", ["iiwa7", "iiwa14"])
def test_a_ptp_arrives_within_1e_4_rad_and_reports_it_once(model: str) -> None:
    plant, ear = ready(model), Ear()
    goal = (0.4, 0.2, -0.3, -1.0, 0.5, 0.6, -0.7)
    run(plant, MotionCommand(1, motions.ptp(goal), listener=ear))
    assert np.abs(plant.snapshot.q - goal).max() <= 1e-4
    assert ear.causes == ["started", "done"]


def test_a_ptp_is_a_straight_line_in_joint_space() -> None:
    plant = ready()
    goal = np.array((0.4, 0.2, -0.3, -1.0, 0.5, 0.6, -0.7))
    track = run(plant, MotionCommand(1, motions.ptp(tuple(goal))))
    travel = goal - READY
    s = (track.q_cmd - READY) @ travel / (travel @ travel)
    assert np.abs(track.q_cmd - READY - s[:, None] * travel).max() < 1e-9


@pytest.mark.parametrize("fraction", [1.0, 0.3, 0.05])
def test_relative_speed_scales_each_axis_before_the_slowest_counts(fraction: float) -> None:
    plant = ready()
    track = run(plant, MotionCommand(1, motions.ptp((0.9, *READY[1:]), joint_velocity=(fraction,) * 7)))
    peak = np.abs(track.dq).max(axis=0)
    assert peak[0] == pytest.approx(fraction * plant.robot.dq_max[0], rel=0.02)


def test_acceleration_and_jerk_stay_within_the_limits() -> None:
    plant = ready()
    track = run(plant, MotionCommand(1, motions.ptp((0.9, 0.1, 0.2, -0.9, -0.3, 0.4, 0.5))))
    assert (np.abs(track.acceleration) <= plant.robot.ddq_max * 1.001).all()
    jerk = np.abs(np.diff(track.acceleration, axis=0)) * 1e3
    assert (jerk <= plant.robot.dddq_max * 1.01).all()


def test_a_ptp_to_a_pose_takes_the_arm_position_that_was_named() -> None:
    plant = ready()
    goal = np.array((0.3, 0.4, 0.2, -1.1, 0.1, 0.8, 0.2))
    from heptarm.model.inverse_kinematics import redundancy

    named = redundancy(plant.robot, goal.tolist())
    target = Pose.from_matrix(forward(plant.robot, goal))
    wanted = (named.e1, named.status, named.turn)
    run(plant, MotionCommand(1, motions.ptp_pose(numbers(target), redundancy=wanted)))
    assert np.abs(plant.snapshot.q - goal).max() < 2e-4


TCP = Pose.xyz_abc(0.05, 0.0, 0.15, 0.3, 0.2, 0.0)


@pytest.mark.parametrize("tcp", [Pose.at(), TCP], ids=["flange", "tool"])
def test_a_lin_is_straight_on_the_measured_pose(tcp: Pose) -> None:
    plant = ready()
    start = pose_of(plant) @ tcp
    goal = Pose(start.xyz + [0.05, 0.25, -0.1], (start @ Pose.xyz_abc(a=0.4, b=-0.2)).quat)
    track = run(plant, MotionCommand(1, motions.lin(numbers(goal)), tcp=numbers(tcp)))
    poses = [Pose.from_matrix(forward(plant.robot, q)) @ tcp for q in track.q[::10]]
    travel, angle = goal.xyz - start.xyz, start.angle_to(goal)
    for pose in poses:
        s = np.clip((pose.xyz - start.xyz) @ travel / (travel @ travel), 0, 1)
        assert np.linalg.norm(start.xyz + s * travel - pose.xyz) <= 0.5e-3
        assert abs(start.angle_to(pose) - s * angle) <= np.radians(0.2)
    assert poses[-1].distance_to(goal) < 2e-4 and poses[-1].angle_to(goal) < 5e-4


def test_cartesian_speed_is_reached_and_not_exceeded() -> None:
    plant = ready()
    offset = (0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 1.0)
    track = run(plant, MotionCommand(1, motions.lin_rel(offset, (0, 0, 0, 1), velocity=0.1)))
    points = np.array([forward(plant.robot, q)[:3, 3] for q in track.q_cmd])
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) * 1e3
    assert speed.max() == pytest.approx(0.1, rel=0.01)


def test_a_lin_rel_in_base_axes_and_in_the_tool_s_own() -> None:
    plant = ready()
    before = pose_of(plant)
    run(plant, MotionCommand(1, motions.lin_rel((0.0, 0.0, -0.1, 0, 0, 0, 1), (0, 0, 0, 1))))
    assert pose_of(plant).xyz == pytest.approx(before.xyz - [0, 0, 0.1], abs=1e-4)
    middle = pose_of(plant)
    run(plant, MotionCommand(2, motions.lin_rel(numbers(Pose.xyz_abc(0.03, 0.0, 0.05, a=0.3)))))
    moved = middle.inverse() @ pose_of(plant)
    assert moved.xyz == pytest.approx([0.03, 0.0, 0.05], abs=2e-4)
    assert moved.abc[0] == pytest.approx(0.3, abs=1e-3)


def test_a_hold_lasts_as_long_as_it_reports() -> None:
    plant = ready()
    track = run(plant, MotionCommand(1, motions.hold(0.25)))
    assert 250 <= len(track.q) <= 260
    assert np.ptp(track.q_cmd, axis=0).max() == 0.0


@pytest.mark.parametrize(
    ("order", "kind", "words"),
    [
        (MotionCommand(1, motions.ptp((0, 2.2, 0, 0, 0, 0, 0))), "joint_limit", "violates limit A2"),
        (MotionCommand(1, motions.ptp((3.1, 2.2, 0, 0, 0, 0, 0))), "joint_limit", "A1 A2"),
        (MotionCommand(1, motions.ptp_pose((2.0, 0, 0, 0, 0, 0, 1))), "unreachable", "not reachable"),
        (
            MotionCommand(1, motions.lin_rel((3.0, 0, 0, 0, 0, 0, 1), (0, 0, 0, 1))),
            None,
            "Can not plan motion",
        ),
        (MotionCommand(1, motions.spl((0.5, 0, 0.5, 0, 1, 0, 0))), "planning", "segment of a spline"),
    ],
)
def test_what_cannot_be_planned_is_refused_and_changes_nothing(
    order: MotionCommand, kind: str | None, words: str
) -> None:
    plant = ready()
    with pytest.raises(PlanError, match=words) as caught:
        plant.submit(order)
    assert kind in (None, caught.value.kind)
    assert plant.idle
    plant.step(50)
    assert plant.snapshot.order == 0 and np.abs(plant.snapshot.q - READY).max() < 1e-4


@settings(max_examples=12, deadline=None)
@given(st.lists(st.floats(-0.97, 0.97), min_size=7, max_size=7))
def test_any_reachable_ptp_keeps_positions_and_speeds_within_limits(fractions: list[float]) -> None:
    robot = ROBOTS["iiwa14"]
    plant = Plant("iiwa14", q=tuple(robot.q_max * 0.3))
    plant.model.opt.disableflags |= 1 << 4  # no contacts: a random goal may lie inside the floor
    goal = tuple(robot.q_max * fractions)
    track = run(plant, MotionCommand(1, motions.ptp(goal)))
    assert (np.abs(track.q) <= robot.q_max + 1e-3).all()
    assert (np.abs(track.dq) <= robot.dq_max * 1.02).all()
    assert np.abs(track.q[-1] - goal).max() <= 1e-4


def test_the_same_commands_give_the_same_states_bit_by_bit() -> None:
    tracks = []
    for _ in range(2):
        plant = ready()
        orders = (
            MotionCommand(1, motions.ptp((0.4, 0.2, -0.3, -1.0, 0.5, 0.6, -0.7))),
            MotionCommand(2, motions.lin_rel((0, 0, 0.05, 0, 0, 0, 1))),
        )
        tracks.append(run(plant, *orders))
    assert np.array_equal(tracks[0].q, tracks[1].q) and np.array_equal(tracks[0].dq, tracks[1].dq)


@pytest.mark.parametrize("part", [1.0, 0.3])
def test_a_lin_keeps_every_axis_speed_acceleration_and_jerk(part: float) -> None:
    plant = ready()
    robot = plant.robot
    offset = numbers(Pose.xyz_abc(-0.1, 0.4, 0.1, a=0.4))
    order = MotionCommand(
        1,
        motions.lin_rel(
            offset, (0, 0, 0, 1), joint_jerk=(part,) * 7, velocity=3.0, acceleration=50.0, jerk=900.0
        ),
    )
    track = run(plant, order)
    assert (np.abs(np.diff(track.q_cmd, axis=0)) * 1e3 <= robot.dq_max * 1.01).all()
    assert (np.abs(track.acceleration) <= robot.ddq_max * 1.02).all()
    assert (np.abs(np.diff(track.acceleration, axis=0)) * 1e3 <= part * robot.dddq_max * 1.1).all()


def test_no_axis_is_too_fast_between_the_samples_of_a_path() -> None:
    """A random program found A1 at 1.0000076 of its speed, between two samples by which the path is timed."""
    start = np.radians([43.232, 37.773, 23.685, -62.927, -15.449, 17.339, 37.122])
    plant = Plant("iiwa14", q=tuple(start.tolist()))
    goal = Pose.from_matrix(forward(plant.robot, np.radians([0, 30, -60, -90, 0, 45, -15])))
    track = run(plant, MotionCommand(1, motions.lin(numbers(goal))))
    fastest = float((np.abs(np.diff(track.q_cmd, axis=0)) * 1e3 / plant.robot.dq_max).max())
    assert 0.999 < fastest <= 1.0
    assert pose_of(plant).distance_to(goal) < 1e-3
