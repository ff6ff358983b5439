"""Straight servo motions on the plant: straight lines, limits along each axis, braking on the line."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.motion import TICK
from heptarm.planning.seam import ServoTiming
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.line_speed import AxisLimits
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from tests.long import few, longer
from tests.sim import motions
from tests.sim.driving import READY, Ear, numbers, ready

LIMITS: dict[str, Any] = {
    "velocity": (0.2, 0.2, 0.2, 0.5, 0.5, 0.5),
    "acceleration": (1.0, 1.0, 1.0, 3.0, 3.0, 3.0),
}
TCP = Pose.xyz_abc(0.02, 0.0, 0.15, 0.3, 0.0, 0.2)


def serving(tcp: Pose | None = None, **terms: Any) -> tuple[Plant, Ear, Pose]:
    plant, ear = ready(), Ear()
    tip = tcp or Pose.of((0.0, 0.0, 0.0))
    mode = terms.pop("mode", None)
    motion = motions.straight(**{**LIMITS, **terms})
    plant.submit(MotionCommand(7, motion, tcp=numbers(tip), mode=mode, listener=ear))
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
    plant, ear, start = serving(axes=tuple(axes.quat.tolist()) if turned else None)
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
    plant, ear, start = serving(velocity=(0.5,) * 6, acceleration=(0.4,) * 6)
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
    plant, ear, start = serving(timing=ServoTiming(goal_timeout=0.3))
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


@pytest.mark.parametrize("ticks", [0, 1, 3, 300])
def test_a_stop_at_the_place_where_it_is_leaves_it_there(ticks: int) -> None:
    """A target that is the present pose, as of a program that holds the arm; once it ended the cabinet."""
    plant, ear = Plant("iiwa14", q=tuple(np.radians([0, 30, 0, -90, 0, 60, 0]).tolist())), Ear()
    plant.submit(MotionCommand(7, motions.straight(**LIMITS), listener=ear))
    plant.step(2)
    here = plant.snapshot.q_cmd
    plant.shared.post(7, Pose.from_matrix(forward(plant.robot, here)).array)
    plant.step(ticks)
    plant.stop()
    plant.step(1000)
    assert ear.causes == ["started", "cancelled"]
    assert np.abs(plant.snapshot.q_cmd - here).max() < 1e-9


# ------------------------------------------------------------------------------------- the limits of the axes

QUICK: dict[str, Any] = {"velocity": (0.5,) * 3 + (1.0,) * 3, "acceleration": (2.0,) * 3 + (4.0,) * 3}
HOME = (0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0)


def at(*degrees: float, **limits: Any) -> tuple[Plant, Ear, Pose]:
    """A plant with a quick straight servo motion, and the pose at its start."""
    plant, ear = Plant("iiwa14", q=tuple(np.radians(degrees).tolist())), Ear()
    start = Pose.from_matrix(forward(plant.robot, plant.snapshot.q_cmd))
    plant.submit(MotionCommand(7, motions.straight(**(limits or QUICK)), listener=ear))
    plant.step(2)
    return plant, ear, start


def followed(plant: Plant, target: Callable[[], Pose], ticks: int) -> Array:
    """Set-points of so many ticks, with a target every 10 ms; judged as the arm's drives would."""
    seen = [plant.snapshot.q_cmd]
    for tick in range(ticks):
        if tick % 10 == 0:
            plant.shared.post(7, target().array)
        plant.tick()
        seen.append(plant.snapshot.q_cmd)
    q, robot = np.array(seen), plant.robot
    speed = np.diff(q, axis=0) * 1e3
    assert (q >= robot.q_min).all() and (q <= robot.q_max).all()
    assert (np.abs(speed) / robot.dq_max).max() <= 1.0
    assert (np.abs(np.diff(speed, axis=0)) * 1e3 / robot.ddq_max).max() <= 1.0
    return q


#: Ticks at which the override changes, and what it is from then on.
OVERRIDES = {0: 0.3, 120: 1.0, 260: 0.0, 420: 0.6, 430: 1.0, 600: 0.05, 750: 1.0, 1000: 0.3, 1100: 1.0}


@pytest.mark.parametrize("seed", few([2, 12, *range(100, 160)]))
def test_a_change_of_the_override_keeps_every_axis_within_its_acceleration(seed: int) -> None:
    """Raising the override within a stream once took 12.3 rad/s² of an axis that may 10."""
    random = np.random.default_rng(seed)
    plant, ear, start = at(*HOME, velocity=(0.8,) * 3 + (2.0,) * 3, acceleration=(4.0,) * 3 + (8.0,) * 3)
    goal, ticks = start, 0

    def target() -> Pose:
        nonlocal goal, ticks
        if ticks % 200 == 0:
            turn = Pose.xyz_abc(0, 0, 0, *random.uniform(-1.2, 1.2, 3))
            goal = moved(start, *random.uniform(-0.4, 0.4, 3)) @ turn
        ticks += 10
        return goal

    for begin, end in pairwise([*OVERRIDES, 1400]):
        plant.override = OVERRIDES[begin]
        q = followed(plant, target, end - begin)
    assert ear.causes == ["started"] and np.abs(q[-1] - q[0]).max() > 0.0


@pytest.mark.parametrize(
    ("a7", "noise"),
    longer(
        [(-150, 0.0), (60, 0.0), (60, -1e-9)],
        [(a7, noise) for a7 in (-150, -60, 60, 150) for noise in (0.0, 1e-9, -1e-9)],
    ),
)
def test_half_a_turn_goes_where_the_arm_can_follow(a7: float, noise: float) -> None:
    plant, ear, start = at(0, 30, 0, -90, 0, 60, a7)
    goal = start @ Pose.xyz_abc(a=np.pi + noise)
    q = followed(plant, lambda: goal, 4500)
    assert np.degrees(q[-1][6]) - a7 == pytest.approx(180 if a7 < 0 else -180, abs=0.01)
    assert ear.causes == ["started"]


def turned(start: Pose, a: float = 0.0, b: float = 0.0) -> Pose:
    return start @ Pose.xyz_abc(0, 0, 0, *np.radians([a, b, 0.0]))


def moved(start: Pose, *by: float) -> Pose:
    return Pose.of(start.xyz + by, start.quat)


@pytest.mark.parametrize(
    ("degrees", "goal", "axis"),
    [
        ((0, 30, 0, -90, 0, 100, 0), lambda start: turned(start, b=60), 6),
        *longer(
            [],
            [
                ((0, 30, 0, -90, 0, 60, 150), lambda start: turned(start, a=60), 7),
                (HOME, lambda start: moved(start, -0.4, 0, -0.1), 4),
            ],
        ),
        ((0, 45, 0, -90, 5, 10, 0), lambda start: turned(start, b=-30), 5),  # A5 turns over, and may not
    ],
)
def test_it_brakes_on_its_line_before_a_limit_and_can_go_back(
    degrees: tuple[float, ...], goal: Callable[[Pose], Pose], axis: int
) -> None:
    plant, ear, start = at(*degrees)
    q = followed(plant, lambda: goal(start), 2200)
    left = np.minimum(plant.robot.q_max - q[-1], q[-1] - plant.robot.q_min)
    assert np.degrees(left[axis - 1]) < 0.1 and int(left.argmin()) == axis - 1
    assert np.abs(q[-1] - q[-50]).max() < 1e-6, "it rests"
    there = Pose.from_matrix(forward(plant.robot, q[-1]))
    assert beside(np.array([there.xyz]), start.xyz, goal(start).xyz) < 1e-6 if axis == 4 else True
    back = followed(plant, lambda: start, 2200)
    assert Pose.from_matrix(forward(plant.robot, back[-1])).distance_to(start) < 1e-6
    assert ear.causes == ["started"]


def test_an_emergency_stop_on_a_bent_line_keeps_every_axis_within_its_acceleration() -> None:
    plant = Plant("iiwa14", q=tuple(np.radians(HOME).tolist()))
    plant.submit(MotionCommand(7, motions.straight(velocity=(0.4,) * 3 + (0.8,) * 3), listener=Ear()))
    plant.step(2)
    begin, end = np.radians(HOME), np.radians([-15.0, -15.0, 0.0, -89.0, -15.0, 120.0, 0.0])
    ticks = iter(range(1500))

    def target() -> Pose:
        part = np.sin(0.02 * next(ticks))
        return Pose.from_matrix(forward(plant.robot, begin + part * (end - begin)))

    followed(plant, target, 223)
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    rest = followed(plant, target, 200)
    assert (rest[-1] == rest[-50]).all()


@pytest.mark.parametrize("every", few(["target once", "target"]))
def test_at_the_end_of_its_reach_it_rests_on_its_line(every: str) -> None:
    plant, ear, start = at(*HOME)
    goal = moved(start, 0.6, 0.0, 0.1)
    posted = iter([goal]) if every == "target once" else None
    last = [goal]

    def target() -> Pose:
        last[0] = next(posted, last[0]) if posted is not None else goal
        return last[0]

    q = followed(plant, target, 2500)
    line = np.array([forward(plant.robot, one)[:3, 3] for one in q[::20]])
    assert beside(line, start.xyz, goal.xyz) < 1e-6
    assert abs(q[-1][3]) < 0.02, "it is stretched"
    assert np.abs(q[-1] - q[-50]).max() < 1e-5 and ear.causes == ["started"]


@pytest.mark.parametrize("degrees", [HOME, (0, 45, 0, -90, 5, 2, 0), (20, 5, 10, -40, 0, 30, 0)])
@pytest.mark.parametrize("seed", range(longer(1, 40)))
def test_whatever_targets_come_no_axis_leaves_its_limits(degrees: tuple[float, ...], seed: int) -> None:
    random = np.random.default_rng(seed)
    plant, ear, start = at(*degrees)
    goal, left = start, 0

    def target() -> Pose:
        nonlocal goal, left
        if left == 0:
            left = int(random.integers(1, 60))
            goal = moved(start, *random.uniform(-0.5, 0.5, 3)) @ Pose.xyz_abc(
                0, 0, 0, *random.uniform(-1.5, 1.5, 3)
            )
        left -= 1
        return goal

    q = followed(plant, target, 1500)
    assert np.ptp(q, axis=0).max() > 0.3 and ear.causes == ["started"]


def test_axes_that_moved_and_rest_in_the_next_step_end_nothing() -> None:
    """At the end of a profile, next to a singularity: the plant's tick ended with ValueError."""
    robot = Plant("iiwa14", q=tuple(np.radians(HOME).tolist())).robot
    assert AxisLimits(robot).fraction(np.array([-2.4e-5, 0, 0, 0, 5e-6, 1.4e-5, -1.8e-5]), np.zeros(7)) == 1.0


@pytest.mark.parametrize("bend", [-300.0, -150.0, 0.0, 150.0, 400.0])
@pytest.mark.parametrize("needed", [0.5, 1.01, 1.25, 3.0])
def test_a_step_of_time_is_corrected_until_each_axis_can_follow(needed: float, bend: float) -> None:
    """Where the line bends, three corrections left A5 1.002 times its acceleration."""
    robot = Plant("iiwa14", q=tuple(np.radians(HOME).tolist())).robot
    here, before = np.radians(HOME), 0.3 * robot.dq_max * TICK
    most = robot.ddq_max * TICK**2
    speed = (before + needed * most) / TICK / (1.0 + bend * TICK)

    def at(step: float) -> np.ndarray:
        return np.asarray(here + speed * step * (1.0 + bend * step))

    step, there = AxisLimits(robot).followable(at, here, before, TICK)
    assert (np.abs(there - here - before) <= most).all() and (there == at(step)).all()
    if needed < 1.0 and bend == 0.0:
        assert step == TICK


@pytest.mark.parametrize("surplus", [0.9, 0.99, 1.005, 1.015, 1.019])
def test_where_a_profile_rests_next_to_a_singularity_each_axis_can_stop_within_a_tick(surplus: float) -> None:
    """An axis that turns 30 rad per second of the line stopped with 2.4 times its acceleration."""
    robot = Plant("iiwa14", q=tuple(np.radians(HOME).tolist())).robot
    here, steep, length = np.radians(HOME), 30.0, 1e-4
    braking = 0.9 * robot.ddq_max[0] / steep  # with which a profile is found

    def joints(time: float, _: Array) -> Array:
        return np.add(here, [steep * time, *[0.0] * 6])

    rate = float(np.sqrt(surplus * 2.0 * braking * length))
    profile = AxisLimits(robot).profile(joints, here, start=0.0, end=1.0, rate=rate, horizon=length)
    if profile is not None:
        assert steep * profile.at(profile.duration)[1] <= robot.ddq_max[0] * TICK
    else:
        assert surplus > 1.0


@pytest.mark.parametrize("tick", [60, 250, 420, 560])
def test_a_stop_brakes_within_the_limits_of_the_axes_too(tick: int) -> None:
    plant, ear, start = at(0, 30, 0, -90, 0, 100, 0)
    followed(plant, lambda: turned(start, b=60), tick)
    plant.cancel(7)
    q = [plant.snapshot.q_cmd]
    while not plant.idle:
        plant.tick()
        q.append(plant.snapshot.q_cmd)
        assert len(q) < 2000
    speed = np.diff(q, axis=0) * 1e3
    assert (np.abs(np.diff(speed, axis=0)) * 1e3).max() <= 10.0 and ear.causes == ["started", "cancelled"]
    assert np.max(q) < plant.robot.q_max[5]


def test_stretched_upwards_with_a3_turned_wild_targets_end_nothing() -> None:
    """No arm position has this A3 a hair beside; the plant's tick ended with Unreachable."""
    random = np.random.default_rng(106)
    plant, ear, start = at(10, 0, -30, 0, 15, 0, 0)
    goals = [
        moved(start, *random.uniform(-0.6, 0.6, 3)) @ Pose.xyz_abc(0, 0, 0, *random.uniform(-1.5, 1.5, 3))
        for _ in range(8)
    ]
    for goal in [*goals, start @ Pose.xyz_abc(a=np.pi), start]:
        followed(plant, lambda goal=goal: goal, 30)  # type: ignore[misc]
    assert ear.causes == ["started"]


def test_a_posture_in_the_floor_is_no_fault_of_a_straight_servo() -> None:
    """0,119,0,-60,0,30,0 has the flange 0.35 m below the base: only the floor tripped A4 there."""
    q = deg(0, 119, 0, -60, 0, 30, 0)
    plant, ear = Plant("iiwa14", q=tuple(q.tolist())), Ear()
    assert plant.data.ncon > 0 and plant.data.xpos[-1][2] < -0.3
    plant.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    plant.submit(MotionCommand(7, motions.straight(), listener=ear))
    plant.step(2)
    here, path = Pose.from_matrix(forward(plant.robot, q)), [q] * 3
    plant.shared.post(7, np.array(numbers(Pose.of(here.xyz + [-0.1, 0.0, 0.05], here.quat))))
    for _ in range(1500):
        plant.tick()
        path.append(plant.snapshot.q_cmd)
    steps = np.diff(np.array(path), axis=0)
    assert ear.causes == ["started"]
    assert np.abs(Pose.from_matrix(forward(plant.robot, path[-1])).xyz - here.xyz).max() > 0.05
    assert (np.abs(steps) * 1e3 <= plant.robot.dq_max * (1.0 + 1e-6)).all()
    assert (np.abs(np.diff(steps, axis=0)) * 1e6 <= plant.robot.ddq_max * (1.0 + 1e-6)).all()
