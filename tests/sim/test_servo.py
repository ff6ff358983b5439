"""Servo motions on the plant: the newest target counts, limits hold at every tick, and every stop works."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from heptarm.planning.motion import TICK, ServoMotion
from heptarm.planning.seam import ServoTiming
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.interpolator import FAST_JERK
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.controller.servo import ServoLimits, SmartFollower, braking_axes
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.robot import robot
from tests.long import few, longer
from tests.sim import motions
from tests.sim.driving import READY, Ear, ready

KINDS = ("servo", "direct")
HERE = np.array(READY)


def serving(kind: str = "servo", timing: ServoTiming | None = None, **terms: Any) -> tuple[Plant, Ear]:
    plant, ear = ready(), Ear()
    mode = terms.pop("mode", None)
    motion = (motions.direct if kind == "direct" else motions.servo)(timing, **terms)
    plant.submit(MotionCommand(7, motion, mode=mode, listener=ear))
    plant.step(2)
    return plant, ear


def to_rest(plant: Plant, *, most: int = 3000) -> int:
    ticks = 0
    while not plant.idle:
        plant.tick()
        ticks += 1
        assert ticks < most
    return ticks


def commands(plant: Plant, ticks: int) -> Array:
    seen = []
    for _ in range(ticks):
        plant.tick()
        seen.append(plant.snapshot.q_cmd)
    return np.array(seen)


@pytest.mark.parametrize("kind", KINDS)
def test_a_far_target_is_reached_within_every_limit(kind: str) -> None:
    plant, _ = serving(kind, joint_velocity=(0.5,) * 7, joint_acceleration=(0.5,) * 7)
    target = HERE + [0.8, -0.4, 0.3, 0.5, -0.6, 0.2, 1.0]
    plant.shared.post(7, target)
    path = np.vstack([[HERE] * 3, commands(plant, 4000)])
    assert np.abs(path[-1] - target).max() < 1e-6
    speed = np.diff(path, axis=0) * 1e3
    assert (np.abs(speed) <= 0.5 * plant.robot.dq_max * 1.001).all()
    assert (np.abs(np.diff(speed, axis=0) * 1e3) <= 0.5 * plant.robot.ddq_max * 1.01 + 1e-6).all()


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    every=st.integers(1, 40),
    kind=st.sampled_from(KINDS),
    with_velocity=st.booleans(),
)
def test_whatever_the_targets_the_limits_hold(seed: int, every: int, kind: str, with_velocity: bool) -> None:
    random = np.random.default_rng(seed)
    plant, ear = serving(kind)
    robot, path = plant.robot, [HERE] * 3
    for tick in range(600):
        if tick % every == 0:
            goal = np.clip(HERE + random.normal(0, 0.5, 7), robot.q_min + 0.3, robot.q_max - 0.3)
            plant.shared.post(7, goal, random.normal(0, 1.0, 7) if with_velocity else None)
        plant.tick()
        path.append(plant.snapshot.q_cmd)
    speed = np.diff(np.array(path), axis=0) * 1e3
    assert (np.abs(speed) <= robot.dq_max * 1.01).all()
    assert (np.abs(np.diff(speed, axis=0) * 1e3) <= robot.ddq_max * 1.05 + 1e-3).all()
    assert ear.causes == ["started"]


@pytest.mark.parametrize("kind", KINDS)
def test_cancelling_brakes_at_full_deceleration_to_rest(kind: str) -> None:
    plant, ear = serving(kind)
    plant.shared.post(7, HERE + [1.5, 0, 0, 0, 0, 0, 2.0])
    plant.step(500)
    speed = np.abs(plant.snapshot.dq)
    plant.cancel(7)
    ticks = to_rest(plant)
    robot = plant.robot
    allowed = (speed / robot.ddq_max + robot.ddq_max / robot.dddq_max).max() + 0.1  # ramps, and settling
    assert ticks * 1e-3 <= allowed
    assert ear.causes == ["started", "cancelled"]
    plant.step(200)
    assert np.abs(plant.snapshot.dq).max() < 1e-3


def test_targets_for_another_motion_are_not_followed() -> None:
    plant, _ = serving()
    plant.shared.post(6, HERE + 0.3)
    assert (commands(plant, 100) == HERE).all()


def test_of_two_targets_between_ticks_the_newest_wins() -> None:
    plant, _ = serving()
    plant.shared.post(7, HERE + 0.3)
    plant.shared.post(7, HERE - 0.1)
    assert np.abs(commands(plant, 3000)[-1] - (HERE - 0.1)).max() < 1e-9


def test_a_passing_velocity_is_kept_for_a_moment_then_the_arm_rests() -> None:
    plant, _ = serving()
    plant.shared.post(7, HERE + [0, 0, 0, 0, 0, 0, 0.2], np.array([0, 0, 0, 0, 0, 0, 0.5]))
    path = commands(plant, 3000)[:, 6]
    assert path.max() > READY[6] + 0.2 + 0.04  # passed by
    assert path[-1] == pytest.approx(path[-500], abs=1e-9)  # and rests


def test_a_target_that_stays_ends_the_motion_after_its_timeout() -> None:
    plant, ear = serving(timing=ServoTiming(goal_timeout=0.3))
    plant.shared.post(7, HERE + 0.05)
    to_rest(plant)
    assert ear.causes == ["started", "done"]


def test_an_axis_that_passes_its_target_with_a_velocity_rests_before_its_limit() -> None:
    plant, ear = serving(timing=ServoTiming(speed_timeout=1.0))
    edge = HERE.copy()
    edge[6] = plant.robot.q_max[6] - 0.01
    plant.shared.post(7, edge, np.array([0, 0, 0, 0, 0, 0, 1.0]))
    path = commands(plant, 6000)
    assert edge[6] < path[-1][6] <= plant.robot.q_max[6]
    assert (path[-1] == path[-100]).all() and ear.causes == ["started"]
    within_limits(plant, path)


def within_limits(plant: Plant, path: Array) -> None:
    """Assert that set-points, tick by tick, are within the range, velocity and acceleration of every axis."""
    robot, speed = plant.robot, np.diff(path, axis=0) * 1e3
    assert (path >= robot.q_min - 1e-9).all() and (path <= robot.q_max + 1e-9).all()
    assert (np.abs(speed) <= robot.dq_max * (1.0 + 1e-6)).all()
    assert (np.abs(np.diff(speed, axis=0)) * 1e3 <= robot.ddq_max * (1.0 + 1e-6)).all()


#: Near the limits of A1, A3, A5 to A7.
CORNER = np.radians([160.0, 30.0, 150.0, -90.0, 165.0, 110.0, 160.0])


def towards_the_limits(kind: str) -> tuple[Plant, Array]:
    """A plant whose axes are on the way to their limits, and the limits."""
    plant = Plant("iiwa14", q=tuple(CORNER.tolist()))
    plant.submit(MotionCommand(7, motions.direct() if kind == "direct" else motions.servo()))
    plant.step(2)
    goal = np.where(np.abs(CORNER) > np.pi / 2 + 0.1, plant.robot.q_max, CORNER)
    plant.shared.post(7, goal)
    return plant, goal


@pytest.mark.parametrize("kind", KINDS)
def test_a_target_on_the_limits_is_reached_within_every_limit(kind: str) -> None:
    plant, goal = towards_the_limits(kind)
    path = np.vstack([[CORNER] * 3, commands(plant, 1500)])
    within_limits(plant, path)
    assert np.abs(path[-1] - goal).max() < 1e-9


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("how", ["cancel", "stop_fast", "emergency stop"])
@pytest.mark.parametrize("after", few([220, 100, 170, 260, 300], 2))
def test_a_stop_on_the_way_to_the_limits_leaves_none(kind: str, how: str, after: int) -> None:
    plant, _ = towards_the_limits(kind)
    path = np.vstack([[CORNER] * 3, commands(plant, after)])
    match how:
        case "cancel":
            plant.cancel(7)
        case "stop_fast":
            plant.stop_fast()
        case _:
            plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    within_limits(plant, np.vstack([path, commands(plant, 700)]))


@settings(max_examples=longer(5, 200), deadline=None)
@given(
    kind=st.sampled_from((*KINDS, "straight")),
    seed=st.integers(0, 10_000),
    longest=st.sampled_from((30, 300, 900)),
    wild=st.sampled_from((1.0, 1.3, 10.0, 1e8)),
)
@example(kind="direct", seed=3, longest=900, wild=1.3)  # 820 times the acceleration, and a drive error
@example(kind="servo", seed=0, longest=300, wild=1e8)  # Ruckig's result -101 ended the plant
def test_wild_targets_bring_no_axis_beyond_its_limits(
    kind: str, seed: int, longest: int, wild: float
) -> None:
    """Joint targets beyond the limits, poses out of reach, velocities that no axis has, at any intervals."""
    random, plant, ear = np.random.default_rng(seed), Plant("iiwa14", q=tuple(CORNER.tolist())), Ear()
    motion: ServoMotion = (
        motions.straight()
        if kind == "straight"
        else motions.direct()
        if kind == "direct"
        else motions.servo()
    )
    plant.submit(MotionCommand(7, motion, listener=ear))
    plant.step(2)
    path, ticks = [np.array([CORNER] * 3)], 0
    while ticks < 1500:
        target = random.uniform(-wild, wild, 7)
        dq = None
        if kind == "straight":
            target[3:] = random.normal(0, 1.0, 4)
            target[3:] /= np.linalg.norm(target[3:])
        else:
            target *= plant.robot.q_max
            dq = random.normal(0, 2.0, 7) if kind == "servo" and random.random() < 0.5 else None
        plant.shared.post(7, target, dq)
        path.append(commands(plant, int(random.integers(1, longest))))
        ticks += len(path[-1])
    within_limits(plant, np.vstack(path))
    assert ear.causes == ["started"]


def test_a_direct_motion_whose_target_comes_too_near_passes_it_and_not_the_limit() -> None:
    plant, _ = towards_the_limits("direct")
    path = np.vstack([[CORNER] * 3, commands(plant, 120)])
    plant.shared.post(7, path[-1])
    path = np.vstack([path, commands(plant, 600)])
    within_limits(plant, path)
    assert np.abs(path[-1] - path[122]).max() < 1e-9 < np.abs(path[-500:] - path[122]).max()


@pytest.mark.parametrize("kind", KINDS)
def test_the_override_and_a_pause_slow_it_down(kind: str) -> None:
    plant, _ = serving(kind)
    plant.pause()
    plant.step(600)
    plant.shared.post(7, HERE + 0.2)
    assert np.abs(commands(plant, 300)[-1] - HERE).max() < 1e-9
    plant.resume()
    assert np.abs(commands(plant, 2500)[-1] - HERE - 0.2).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_a_change_of_the_override_keeps_every_axis_within_its_acceleration(kind: str) -> None:
    """An axis that accelerates or brakes already has no room for the whole change."""
    plant, _ = serving(kind)
    random = np.random.default_rng(12)
    path = [np.array([HERE] * 3)]
    for number, override in enumerate([0.3, 1.0, 0.0, 0.6, 1.0, 0.05, 1.0, 0.3, 1.0] * 2):
        plant.override = override
        plant.shared.post(7, HERE + random.uniform(-0.9, 0.9, 7))
        path.append(commands(plant, 60 + 40 * (number % 4)))
    within_limits(plant, np.vstack(path))
    assert np.ptp(np.vstack(path), axis=0).min() > 0.1


# ------------------------------------------------------------------------------- joint impedance


def test_a_push_bends_a_joint_by_torque_over_stiffness() -> None:
    plant, _ = serving(mode=JointImpedance(400.0))
    plant.apply_wrench((0.0, 20.0, 0.0))
    plant.step(4000)
    state = plant.snapshot
    assert np.abs(state.tau_ext).max() > 5.0
    np.testing.assert_allclose(
        (state.q - state.q_cmd) * 400.0, state.tau_ext, atol=0.02 * np.abs(state.tau_ext).max()
    )


def test_without_stiffness_the_arm_floats_away_from_a_push() -> None:
    plant, _ = serving(mode=JointImpedance(0.0))
    plant.apply_wrench((0.0, 3.0, 0.0))
    plant.step(1000)
    assert np.abs(plant.snapshot.q - HERE).max() > 0.05


@pytest.mark.parametrize("push", [-1.0, 1.0])
def test_behind_a_compliant_arm_at_its_limit_the_set_points_are_inside(push: float) -> None:
    """The arm gives a hair beyond its limit, and position control began there."""
    start = HERE.copy()
    start[3] = ready().robot.q_min[3]
    plant = Plant("iiwa14", q=tuple(start.tolist()))
    plant.submit(MotionCommand(1, motions.hold(0.3), mode=JointImpedance(3000.0)))
    plant.submit(MotionCommand(2, motions.ptp(tuple(HERE.tolist()))))
    plant.apply_wrench((push, 0.0, 0.0))
    given = []
    while not plant.idle:
        plant.tick()
        given.append((plant.snapshot.q[3], plant.snapshot.q_cmd[3]))
    q, set_points = np.array(given).T
    assert (set_points >= plant.robot.q_min[3] - 1e-9).all()
    assert (q.min() < plant.robot.q_min[3] - 1e-6) == (push < 0.0)


@pytest.mark.parametrize("stiffness", few([1000.0, 100.0, 5000.0]))
def test_impedance_follows_a_motion_and_rests(stiffness: float) -> None:
    plant, ear = ready(), Ear()
    target = HERE + [0.5, 0, 0, 0.2, 0, 0, 0.5]
    plant.submit(MotionCommand(1, motions.ptp(tuple(target)), mode=JointImpedance(stiffness), listener=ear))
    to_rest(plant, most=8000)
    assert ear.causes == ["started", "done"]
    assert np.abs(plant.snapshot.q - target).max() < 2e-3
    plant.step(1000)
    assert np.abs(plant.snapshot.dq).max() < 1e-3


def test_stiffness_changes_while_a_servo_motion_runs_without_a_jump() -> None:
    plant, _ = serving(mode=JointImpedance(1000.0))
    plant.apply_wrench((0.0, 20.0, 0.0))
    plant.step(3000)
    before = plant.snapshot.q - HERE
    plant.change_mode(7, JointImpedance(250.0))
    speeds = []
    for _ in range(4000):
        plant.tick()
        speeds.append(np.abs(plant.snapshot.dq).max())
    after = plant.snapshot.q - HERE
    assert max(speeds) < 2.0
    assert np.abs(after).max() > 3.0 * np.abs(before).max()


def test_stiff_again_the_arm_stays_where_it_was_pushed_to() -> None:
    plant, _ = serving(mode=JointImpedance(100.0))
    plant.apply_wrench((0.0, 20.0, 0.0))
    plant.step(3000)
    there = plant.snapshot.q
    plant.cancel(7)
    to_rest(plant)
    plant.step(1000)
    assert np.abs(plant.snapshot.q - there).max() < 0.02
    assert np.abs(plant.snapshot.q - HERE).max() > 0.05


def test_a_motion_planned_behind_an_impedance_motion_starts_where_the_arm_is() -> None:
    plant, ear = ready(), Ear()
    plant.apply_wrench((0.0, 20.0, 0.0))
    plant.submit(MotionCommand(1, motions.hold(2.0), mode=JointImpedance(100.0)))
    plant.submit(MotionCommand(2, motions.ptp(READY), listener=ear))
    fastest = 0.0
    while not plant.idle:
        plant.tick()
        fastest = max(fastest, float((np.abs(plant.snapshot.dq) / plant.robot.dq_max).max()))
    assert ear.causes == ["started", "done"]
    assert fastest < 0.8  # no jump back
    assert np.abs(plant.snapshot.q - HERE).max() < 1e-3


@pytest.mark.parametrize("fast", [False, True], ids=["path", "fast"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_client_that_cancels_a_motion_that_a_stop_halts_turns_nothing_back(kind: str, fast: bool) -> None:
    for lag in longer((0, 6, 12, 18, 25), (*range(0, 16, 3), 17, 18, 19, 25, 60)):
        plant, ear = serving(kind, joint_velocity=(0.2,) * 7, joint_acceleration=(0.2,) * 7)
        plant.shared.post(7, HERE + 0.5)
        plant.step(600)
        path = [plant.snapshot.q_cmd]
        plant.safety.request_stop(StopRequest.OPERATOR_SAFETY)
        for tick in range(300):
            if tick == lag:
                plant.stop_fast() if fast else plant.cancel()
            plant.tick()
            path.append(plant.snapshot.q_cmd)
        speed = np.diff(np.array(path), axis=0) * 1e3
        assert (speed > -1e-6).all() and (speed <= 0.2 * plant.robot.dq_max * 1.001).all()
        to_rest(plant)
        assert ear.causes[-1] == "cancelled"


@pytest.mark.parametrize("kind", KINDS)
def test_a_safety_stop_lets_no_axis_gain_speed_and_the_target_is_reached_afterwards(kind: str) -> None:
    for seed in range(longer(4, 12)):
        random = np.random.default_rng(seed)
        plant, _ = serving(kind)
        target = HERE + random.uniform(-0.4, 0.4, 7)
        plant.shared.post(7, target)
        plant.step(int(random.integers(1, 400)))
        before = np.abs(plant.interpolator.command.speed)
        plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
        # an axis may finish the change of its acceleration, at the jerk of a stop
        most = before + plant.robot.ddq_max**2 / (2 * 20.0 * plant.robot.dddq_max) + 1e-3
        speeds = np.abs(np.diff(commands(plant, 300), axis=0)) * 1e3
        assert (speeds <= most).all(), (seed, (speeds.max(axis=0) - before).max())
        longest = float((before / plant.robot.ddq_max).max()) + 0.06
        assert (speeds[int(longest * 1e3) :] < 1e-6).all(), seed
        plant.safety.withdraw()
        plant.safety.resume()
        plant.step(3000)
        assert np.abs(plant.snapshot.q - target).max() < 1e-3


@pytest.mark.parametrize("kind", KINDS)
def test_resumed_before_it_rests_a_servo_motion_rests_and_then_goes_on(kind: str) -> None:
    plant, _ = serving(kind)
    target = HERE + 0.4
    plant.shared.post(7, target)
    plant.step(150)
    plant.safety.request_stop(StopRequest.OPERATOR_SAFETY)
    plant.step(5)
    plant.safety.withdraw()
    plant.safety.resume()
    path = commands(plant, 3000)
    change = np.abs(np.diff(path, n=2, axis=0)) * 1e6
    assert (change <= plant.robot.ddq_max * 1.5).all(), "no jump"
    assert np.abs(plant.snapshot.q - target).max() < 1e-3


@pytest.mark.parametrize(("target", "speed"), [(119.0, 1.2), (119.9, 2.0), (110.0, 2.0), (90.0, 2.0)])
@pytest.mark.parametrize("acceleration", [0.2, 1.0])
def test_a_target_that_is_passed_before_a_limit_leaves_room_to_brake(
    target: float, speed: float, acceleration: float
) -> None:
    """As when the program that streams velocities dies beside a limit."""
    plant, ear = Plant("iiwa14", q=tuple(np.radians([0, 30, 0, -90, 0, 80, 0]).tolist())), Ear()
    plant.submit(
        MotionCommand(
            7,
            motions.servo(joint_velocity=(1.0,) * 7, joint_acceleration=(acceleration,) * 7),
            listener=ear,
        )
    )
    plant.step(2)
    plant.shared.post(7, np.radians([0, 30, 0, -90, 0, target, 0]), speed * np.eye(7)[5])
    q = commands(plant, 2500)[:, 5]
    rate = np.diff(q) * 1e3
    assert np.radians(target) - 0.02 < q.max() <= plant.robot.q_max[5]
    assert np.abs(np.diff(rate)).max() * 1e3 <= acceleration * plant.robot.ddq_max[5] * (1 + 1e-6)
    assert abs(rate[-1]) < 1e-9 and ear.causes == ["started"]


@pytest.mark.parametrize(
    ("every", "ahead", "hold_up"), [(10, 0.015, 0), (5, 0.01, 1), (10, 0.015, 3), (20, 0.06, 3)]
)
def test_a_stream_with_velocities_is_followed_without_a_lag(every: int, ahead: float, hold_up: int) -> None:
    """Once the axes could not be at a target at its time, they took a run-up of 0.3 s, and were late for the rest."""
    swing = 0.25 * np.array([1.0, 0.5, -0.5, 0.7, 0.3, 1.0, -1.0])

    def at(time: float) -> tuple[Array, Array]:
        turn = np.pi * min(time, 1.2) / 1.2
        return HERE + swing * (1.0 - np.cos(turn)) / 2.0, swing * np.sin(turn) * np.pi / 2.4

    plant, _ = serving("servo", ServoTiming(min_trajectory_time=ahead))
    random, due, behind = np.random.default_rng(0), 0, []
    for tick in range(1400):
        if tick >= due:
            plant.shared.post(7, *at(tick * 1e-3 + ahead))
            due = tick + every + int(random.integers(-1, 2)) * hold_up
        plant.tick()
        behind.append(np.abs(plant.snapshot.q_cmd - at(tick * 1e-3)[0]).max())
    assert max(behind) < 3e-3 and np.median(behind) < 1e-3 and behind[-1] < 1e-5


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_target_where_two_kinds_of_trajectory_meet_is_reached(sign: float) -> None:
    # 0.1 rad at half of the acceleration: the planner once found nothing, and the arm stayed for ever
    half = (0.5,) * 7
    start = np.array((0.0, 0.4, 0.0, -1.3, 0.0, 1.0, 0.0))
    follower = SmartFollower(ServoLimits.of(robot("iiwa7"), velocity=half, acceleration=half), start)
    follower.aim(start + sign * 0.1)
    assert follower.remaining == pytest.approx(0.4, abs=1e-3)
    for _ in range(401):
        there = follower.advance(1e-3)
    assert there == pytest.approx(start + sign * 0.1, abs=1e-9)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_axis_that_was_pushed_towards_its_limit_brakes_as_hard_as_it_must(side: float) -> None:
    """After torques of a session that ended, A6 came 0.3 degrees beyond its limit."""
    arm = robot("iiwa14")
    limit, room = side * arm.q_max[5], 0.01
    here, speed = np.zeros(7), np.zeros(7)
    here[5] = limit - side * room
    for part in (0.5, 1.0, 2.0, 4.0):  # of the acceleration of planned motions
        speed[5] = side * math.sqrt(2.0 * part * arm.ddq_max[5] * room)
        braking = braking_axes(arm, here, speed, jerk=FAST_JERK)
        points = [here]
        while not braking.is_still:
            points.append(braking.advance(TICK))
        assert np.abs(points).max(axis=0)[5] <= abs(limit) + 1e-9
        change = np.diff(np.diff([here - speed * TICK, *points], axis=0), axis=0) / TICK**2
        assert np.abs(change).max() <= max(1.0, part + 0.1) * arm.ddq_max[5] * (1.0 + 1e-9)
