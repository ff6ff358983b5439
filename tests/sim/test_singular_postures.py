"""Where the pose leaves joints free, they stay; E1 is the angle of A3; half a turn goes where the arm can follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi

import mujoco
import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.geometry import Slerp
from heptarm.planning.motion import PlanError
from heptarm.planning.planner import plan
from heptarm.planning.seam import PlantMotion
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import ROBOTS
from tests.long import longer
from tests.sim import motions
from tests.sim.driving import READY, numbers, run

#: Postures that people teach, where axes coincide.
ROUND = {
    "A2 at 0": (20, 0, 40, -90, 0, 60, 0),
    "wrist": (0, 30, 0, -60, 50, 0, -20),
    "A2, A4, A6 at 0": (20, 0, 40, 0, -20, 0, 10),
    "A6 at 0": (0, 45, 0, -90, 0, 0, 0),
    "candle": (0, 0, 0, 0, 0, 0, 0),
}


def ready(q: Sequence[float] | Array = READY) -> Plant:
    return Plant("iiwa14", q=tuple(map(float, q)))


@pytest.mark.parametrize("degrees", ROUND.values(), ids=ROUND)
@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-6])
@pytest.mark.parametrize("kind", [motions.ptp_pose, motions.lin], ids=["ptp", "lin"])
def test_a_motion_to_its_own_pose_stays(
    degrees: tuple[float, ...], noise: float, kind: Callable[..., PlantMotion]
) -> None:
    q = deg(*degrees)
    plant = ready(q=q)
    off = noise * np.random.default_rng(1).uniform(-1, 1, 7)
    track = run(plant, MotionCommand(1, kind(numbers(Pose.from_matrix(forward(plant.robot, q + off))))))
    assert np.abs(np.array(track.q_cmd) - q).max() < deg(0.01)[0]


def test_home_is_reached_by_its_pose_without_a_swing() -> None:
    """It needs 40 degrees; A5 ended at -155.5."""
    start = deg(10, 20, 5, -40, 0, 40, 5)
    plant = ready(q=start)
    track = run(
        plant,
        MotionCommand(1, motions.ptp_pose(numbers(Pose.from_matrix(forward(plant.robot, np.zeros(7)))))),
    )
    assert np.abs(np.array(track.q_cmd) - start).max() < deg(40.1)[0]


def test_kukas_sample_moves_in_the_null_space() -> None:
    start = deg(0, 20, 0, -110, 0, -40, 90)
    plant = ready(q=start)
    here = numbers(Pose.from_matrix(forward(plant.robot, start)))
    for number, e1 in enumerate((-80.0, 0.0), start=1):
        track = run(
            plant, MotionCommand(number, motions.lin(here, redundancy=(float(np.radians(e1)), 6, -1)))
        )
        assert np.degrees(track.q_cmd[-1][2]) == pytest.approx(e1, abs=1e-3)
    assert np.abs(track.q_cmd[-1] - start).max() < 1e-4


def test_a_ptp_to_a_frame_with_e1_ends_with_a3_there() -> None:
    plant = ready()
    pose = Pose.from_matrix(forward(plant.robot, plant.snapshot.q))
    track = run(plant, MotionCommand(1, motions.ptp_pose(numbers(pose), redundancy=(0.5, -1, -1))))
    assert track.q_cmd[-1][2] == pytest.approx(0.5, abs=1e-6)


def test_a_lin_without_e1_keeps_a3() -> None:
    plant = ready(q=deg(10, 30, 20, -80, 15, 50, 5))
    a3 = float(plant.snapshot.q[2])
    track = run(plant, MotionCommand(1, motions.lin_rel((0.0, 0.1, 0.05, 0, 0, 0, 1), (0, 0, 0, 1))))
    assert np.abs(np.array(track.q_cmd)[:, 2] - a3).max() < 1e-4


half_turns = pytest.mark.parametrize(
    ("a7", "noise"),
    longer(
        [(-150, 0.0), (-60, 1e-9), (60, -1e-9), (150, 0.0)],
        [(a7, noise) for a7 in (-150, -60, 60, 150) for noise in (0.0, 1e-9, -1e-9)],
    ),
)


@half_turns
def test_half_a_turn_goes_where_the_arm_can_follow(a7: float, noise: float) -> None:
    """A LIN by exactly 180 degrees about A7 was refused or not, by noise."""
    start = deg(0, 30, 0, -90, 0, 60, a7)
    plant = ready(q=start)
    goal = Pose.from_matrix(forward(plant.robot, start)) @ Pose.xyz_abc(a=pi + noise)
    track = run(plant, MotionCommand(1, motions.lin(numbers(goal))))
    turned = np.degrees(track.q_cmd[-1][6]) - a7
    assert turned == pytest.approx(180 if a7 < 0 else -180, abs=0.01)


@half_turns
def test_half_a_turn_in_a_spline_goes_where_the_arm_can_follow(a7: float, noise: float) -> None:
    start = deg(0, 30, 0, -90, 0, 60, a7)
    plant = ready(q=start)
    here = Pose.from_matrix(forward(plant.robot, start))
    via = Pose.of(here.xyz + [0.0, 0.05, 0.0], here.quat)
    goal = Pose.of(here.xyz + [0.0, 0.1, 0.02], here.quat) @ Pose.xyz_abc(a=pi + noise)
    one = motions.spline(motions.spl(numbers(via)), motions.spl(numbers(goal)))
    track = run(plant, MotionCommand(1, one))
    turned = np.degrees(track.q_cmd[-1][6] - track.q_cmd[0][6])
    assert (turned > 90) == (a7 < 0), turned
    assert Pose.from_matrix(forward(plant.robot, track.q_cmd[-1])).angle_to(goal) < 1e-6


@pytest.mark.parametrize("noise", [0.0, 1e-9, -1e-9])
def test_a_pose_between_two_that_are_half_a_turn_apart_does_not_depend_on_noise(noise: float) -> None:
    start = Pose.xyz_abc(0.5, 0.0, 0.4, 0.3, 0.2, pi - 0.1)
    goal = start @ Pose.xyz_abc(a=pi + noise)
    middle = start.interpolate(goal, 0.5)
    assert middle.angle_to(start.interpolate(start @ Pose.xyz_abc(a=pi), 0.5)) < 1e-6
    line = Slerp(start.quat, goal.quat)
    assert abs(float(np.array(line.at(0.5)) @ middle.quat)) == pytest.approx(1.0, abs=1e-12)


def test_half_a_turn_that_no_direction_allows_is_refused() -> None:
    plant = ready(q=deg(0, 30, 0, -90, 0, 60, 0))
    goal = Pose.from_matrix(forward(plant.robot, plant.snapshot.q)) @ Pose.xyz_abc(a=pi)
    with pytest.raises(PlanError, match="A7"):
        plant.submit(MotionCommand(1, motions.lin(numbers(goal))))


@pytest.mark.parametrize("seed", [1, *range(2, longer(2, 20))])
def test_a_line_on_which_a3_cannot_stay_jumps_nowhere(seed: int) -> None:
    """Between lines on which A3 stays and refused ones, set-points took up to 360 times an axis' acceleration."""
    arm, random = ROBOTS["iiwa14"], np.random.default_rng(seed)
    planned, refused = 0, 0
    for _ in range(longer(30, 60)):
        start = random.uniform(0.9 * arm.q_min, 0.9 * arm.q_max)
        end = np.clip(start + random.normal(0, 0.6, 7), 0.95 * arm.q_min, 0.95 * arm.q_max)
        try:
            found = plan(arm, motions.lin(numbers(Pose.from_matrix(forward(arm, end)))), start)
        except PlanError as error:
            refused += "where A3 cannot stay at its angle" in str(error)
            continue
        assert found.path is not None and found.timing is not None
        planned, near, q = planned + 1, start, []
        for time in np.arange(3e-4, found.duration, 1e-3).tolist():
            near = found.path.at(found.timing.profile.at(time)[0], near)
            q.append(near)
        steps = np.diff(np.array(q), axis=0)
        assert (np.abs(steps) * 1e3 / arm.dq_max).max() <= 1.0
        assert (np.abs(np.diff(steps, axis=0)) * 1e6 / arm.ddq_max).max() <= 1.0
    assert planned > 10 and refused > 1


def test_with_an_e1_for_its_end_such_a_line_may_be_followed() -> None:
    arm = ROBOTS["iiwa14"]
    start, end = deg(143.2, 44.2, 13.8, -7.8, -10.3, 39.3, -83.6), deg(108.5, 114, 46.6, 12, -22.5, 32, -96)
    goal = numbers(Pose.from_matrix(forward(arm, end)))
    with pytest.raises(PlanError, match="where A3 cannot stay at its angle"):
        plan(arm, motions.lin(goal), start)
    found = plan(arm, motions.lin(goal, redundancy=(float(end[2]), -1, -1)), start)
    assert found.end[2] == pytest.approx(end[2], abs=1e-6)


@pytest.mark.parametrize(
    "degrees", [(0, 0, 90, -90, 0, 60, 0), (0, 0, 0, 0, 0, 0, 0), (-90, 0, 90, -90, 0, 90, 0)]
)
def test_a_line_out_of_a_singular_posture_is_within_the_limits_or_refused(degrees: tuple[float, ...]) -> None:
    """Out of the candle set-points had up to 31 times an axis' speed, and 700 times its acceleration."""
    arm, random = ROBOTS["iiwa14"], np.random.default_rng(3)
    start, refused = deg(*degrees), 0
    for _ in range(longer(10, 100)):
        end = np.clip(start + random.normal(0, 0.4, 7), 0.95 * arm.q_min, 0.95 * arm.q_max)
        try:
            found = plan(arm, motions.lin(numbers(Pose.from_matrix(forward(arm, end)))), start)
        except PlanError as error:
            refused += "singularity" in str(error)
            continue
        assert found.path is not None and found.timing is not None
        near, q = start, [start]
        for time in np.arange(3e-4, found.duration, 1e-3).tolist():
            near = found.path.at(found.timing.profile.at(time)[0], near)
            q.append(near)
        steps = np.diff(np.array(q), axis=0)
        assert (np.abs(steps) * 1e3 / arm.dq_max).max() <= 1.0
        assert (np.abs(np.diff(steps[1:], axis=0)) * 1e6 / arm.ddq_max).max() <= 1.0
    assert refused > 1


#: A line that is slowed down near a singular posture, with A4 near its limit there [deg].
SLOWED = (-122.7, 50.6, 121.2, 98.5, 36.9, -19.4, -119.7), (-161.5, 94.9, 106.9, 114.0, 47.3, -9.1, -137.2)
STOPS: dict[str, Callable[[Plant], None]] = {
    "stop": Plant.stop,
    "fast": Plant.stop_fast,
    "pause": Plant.pause,
    "emergency stop": lambda plant: plant.safety.request_stop(StopRequest.EMERGENCY_STOP),
    "protective stop": lambda plant: plant.safety.request_stop(StopRequest.PROTECTIVE_STOP),
}


@pytest.mark.parametrize("kind", STOPS)
@pytest.mark.parametrize("when", longer([0.65], [0.2, 0.4, 0.6, 0.65, 0.7, 0.8, 1.0]))
def test_a_stop_amid_a_slowed_part_keeps_all_limits(kind: str, when: float) -> None:
    """A fast stop brought A4 0.27 degrees beyond its limit: all axes braked as long as the fastest of them."""
    start, end = (deg(*degrees) for degrees in SLOWED)
    plant = ready(q=start)
    arm, q = plant.robot, [start] * 3
    plant.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # the posture is in the floor
    plant.submit(MotionCommand(1, motions.lin(numbers(Pose.from_matrix(forward(arm, end))))))
    for tick in range(round(when * 1e3) + 800):
        if tick == round(when * 1e3):
            assert np.abs(q[-1] - q[-2]).max() > 1e-4, "it moves"
            STOPS[kind](plant)
        plant.tick()
        q.append(plant.snapshot.q_cmd)
    path = np.array(q)
    assert (path >= arm.q_min - 1e-9).all() and (path <= arm.q_max + 1e-9).all()
    steps = np.diff(path, axis=0)
    assert (np.abs(steps) * 1e3 / arm.dq_max).max() <= 1.0 + 1e-6
    assert (np.abs(np.diff(steps, axis=0)) * 1e6 / arm.ddq_max).max() <= 1.0 + 1e-6
    assert np.abs(steps[-1]).max() < 1e-9, "it rests"
