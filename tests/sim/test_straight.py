"""Straight servo motions on the plant: straight lines, limits along each axis, braking on the line."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.command import Order
from heptarm.planning.seam import ServoTiming, StraightLimits
from heptarm.sim.plant.plant import Plant
from heptarm.values.arrays import Array
from heptarm.values.pose import Pose
from tests.sim.driving import READY, Ear, numbers, ready

LIMITS = StraightLimits(velocity=(0.2, 0.2, 0.2, 0.5, 0.5, 0.5), acceleration=(1.0, 1.0, 1.0, 3.0, 3.0, 3.0))
TCP = Pose.xyz_abc(0.02, 0.0, 0.15, 0.3, 0.0, 0.2)


def serving(tcp: Pose | None = None, **terms: object) -> tuple[Plant, Ear, Pose]:
    plant, ear = ready(), Ear()
    tip = tcp or Pose.of((0.0, 0.0, 0.0))
    wanted: dict[str, object] = {"straight_limits": LIMITS, "tcp": numbers(tip), "listener": ear, **terms}
    plant.submit(Order(7, "straight", **wanted))  # type: ignore[arg-type]
    plant.step(2)
    return plant, ear, Pose.from_matrix(forward(plant.robot, np.array(READY))) @ tip


def places(plant: Plant, ticks: int, tcp: Pose | None = None) -> tuple[Array, list[Pose]]:
    """Commanded positions of the motion frame, tick by tick."""
    seen = []
    for _ in range(ticks):
        plant.tick()
        pose = Pose.from_matrix(forward(plant.robot, plant.snapshot.q_cmd))
        seen.append(pose if tcp is None else pose @ tcp)
    return np.array([pose.xyz for pose in seen]), seen


def beside(line: Array, start: Array, end: Array) -> float:
    """Largest distance of points from a line [m]."""
    travel = (end - start) / np.linalg.norm(end - start)
    off = line - start
    return float(np.linalg.norm(off - np.outer(off @ travel, travel), axis=1).max())


def test_from_rest_the_motion_frame_goes_straight_and_turns_in_step() -> None:
    plant, _, start = serving(TCP)
    goal = Pose.of(start.xyz + [0.05, 0.12, -0.08], start.quat) @ Pose.xyz_abc(0, 0, 0, 0.4, 0.2, 0.0)
    plant.shared.post(7, goal.array)
    line, poses = places(plant, 2500, TCP)
    assert poses[-1].distance_to(goal) < 1e-9 and poses[-1].angle_to(goal) < 1e-9
    assert beside(line, start.xyz, goal.xyz) < 1e-6
    fraction = np.linalg.norm(line - start.xyz, axis=1) / start.distance_to(goal)
    turned = np.array([start.angle_to(pose) for pose in poses]) / start.angle_to(goal)
    assert np.abs(fraction - turned).max() < 1e-6


@pytest.mark.parametrize("tick", [100, 200, 300])
def test_a_target_that_comes_again_while_the_acceleration_has_a_kink_changes_nothing(tick: int) -> None:
    plant, _, start = serving()
    goal = Pose.of(start.xyz + [0.0, 0.08, -0.06], start.quat) @ Pose.xyz_abc(0, 0, 0, 0.2, 0, 0)
    plant.shared.post(7, goal.array)
    before, _ = places(plant, tick)
    plant.shared.post(7, goal.array)
    after, _ = places(plant, 100)
    assert beside(np.concatenate([before, after]), start.xyz, goal.xyz) < 1e-6


@pytest.mark.parametrize("turned", [False, True])
def test_limits_hold_along_each_axis_of_the_chosen_frame(turned: bool) -> None:
    axes = Pose.xyz_abc(0, 0, 0, 0.6, 0.3, 0.0)
    plant, ear, start = serving(reference=tuple(axes.quat.tolist()) if turned else None)
    random = np.random.default_rng(3)
    line = [start.xyz] * 2
    for _ in range(12):
        turn = Pose.xyz_abc(0, 0, 0, *random.uniform(-0.2, 0.2, 3))
        plant.shared.post(7, (Pose.of(start.xyz + random.uniform(-0.1, 0.1, 3), start.quat) @ turn).array)
        line.extend(places(plant, int(random.integers(30, 300)))[0])
    seen = np.array(line) @ (axes.rotation if turned else np.eye(3))
    speed = np.diff(seen, axis=0) * 1e3
    assert np.abs(speed).max() <= 0.2 * 1.001
    assert np.abs(speed).max() > 0.19
    assert np.abs(np.diff(speed, axis=0) * 1e3).max() <= 1.0 * 1.02
    assert ear.causes == ["started"]


def test_a_rotation_keeps_its_speed_and_acceleration_across_targets() -> None:
    plant, _, start = serving()
    spins, before = [], start
    for step in range(900):
        if step % 40 == 0:  # the goal turns about an axis that turns itself
            angle = min(step, 500) * 1e-3
            plant.shared.post(
                7, (Pose.of(start.xyz, start.quat) @ Pose.xyz_abc(0, 0, 0, angle, angle / 2, 0)).array
            )
        _, (pose,) = places(plant, 1)
        spins.append(2e3 * (Pose.of((0, 0, 0), before.quat).inverse() @ pose).quat[:3])
        before = pose
    spin = np.array(spins)
    assert np.linalg.norm(spin, axis=1).max() > 0.3
    assert np.linalg.norm(np.diff(spin, axis=0), axis=1).max() * 1e3 <= 3.0 * np.sqrt(3) * 1.05


def test_a_target_across_the_way_bends_it_without_a_halt() -> None:
    plant, _, start = serving()
    plant.shared.post(7, Pose.of(start.xyz + [0.0, 0.15, 0.0], start.quat).array)
    first, _ = places(plant, 500)
    plant.shared.post(7, Pose.of(start.xyz + [0.0, 0.15, 0.1], start.quat).array)
    second, poses = places(plant, 2500)
    speed = np.linalg.norm(np.diff(np.vstack([first, second]), axis=0), axis=1) * 1e3
    moving = speed[200:700]
    assert moving.min() > 0.05
    assert poses[-1].xyz == pytest.approx(start.xyz + [0.0, 0.15, 0.1], abs=1e-9)


def test_cancelling_brakes_on_the_line_within_what_a_motion_may() -> None:
    plant, ear, start = serving(straight_limits=StraightLimits(velocity=(0.5,) * 6, acceleration=(0.4,) * 6))
    goal = start.xyz + [0.0, 0.3, 0.1]
    plant.shared.post(7, Pose.of(goal, start.quat).array)
    places(plant, 900)
    speed = float(np.linalg.norm(np.diff(places(plant, 3)[0], axis=0)[-1]) * 1e3)
    plant.cancel(7)
    line = []
    while not plant.idle:
        line.append(places(plant, 1)[0][0])
        assert len(line) < 2000
    assert ear.causes == ["started", "cancelled"]
    assert len(line) * 1e-3 <= speed / 4.0 + 0.1 + 0.6  # ramp, jerk, settling
    assert beside(np.array(line), start.xyz, goal) < 1e-4


def test_at_its_target_it_times_out() -> None:
    plant, ear, start = serving(servo_timing=ServoTiming(goal_timeout=0.3))
    plant.shared.post(7, Pose.of(start.xyz + [0, 0, 0.02], start.quat).array)
    while not plant.idle:
        plant.tick()
    assert ear.causes == ["started", "done"]


def test_the_override_and_a_pause_slow_it_down() -> None:
    plant, _, start = serving()
    plant.pause()
    plant.step(600)
    goal = start.xyz + [0, 0.05, 0.02]
    plant.shared.post(7, Pose.of(goal, start.quat).array)
    assert np.abs(places(plant, 200)[0] - start.xyz).max() < 1e-9
    plant.resume()
    assert np.abs(places(plant, 2500)[0][-1] - goal).max() < 1e-6


def test_a_line_that_slowly_ends_at_the_reach_of_the_arm_is_an_error_too() -> None:
    plant, ear = Plant("iiwa14", q=(0.0, 0.5, 0.0, -0.02, 0.0, 0.9, 0.0)), Ear()
    start = Pose.from_matrix(forward(plant.robot, plant.snapshot.q_cmd))
    plant.submit(
        Order(
            7,
            "straight",
            straight_limits=StraightLimits(velocity=(1e-4,) * 6, acceleration=(1.0,) * 6),
            listener=ear,
        )
    )
    plant.step(2)
    outward = start.xyz - (0.0, 0.0, plant.robot.d_bs)
    plant.shared.post(7, Pose.of(start.xyz + 0.01 * outward, start.quat).array)
    while not plant.idle:
        plant.tick()
        assert plant.tick_count < 10_000
    assert ear.causes == ["started", "error"]


@pytest.mark.parametrize("goal", [(2.0, 0.0, 0.5), (0.0, 0.0, 0.35)])
def test_a_line_that_leaves_the_workspace_ends_the_motion_in_a_controlled_stop(
    goal: tuple[float, ...],
) -> None:
    plant, ear, start = serving()
    plant.shared.post(7, Pose.of(goal, start.quat).array)
    fastest = 0.0
    while not plant.idle:
        plant.tick()
        fastest = max(fastest, float((np.abs(plant.snapshot.dq) / plant.robot.dq_max).max()))
        assert plant.tick_count < 20_000
    cause, text = ear.heard[-1]
    assert cause == "error" and ("limit" in text or "reach" in text)
    assert fastest <= 1.3
