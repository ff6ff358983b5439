"""Batches: the arm does not stop where a motion blends into the next one, and keeps every limit."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.motion import PlanError
from heptarm.planning.planner import plan
from heptarm.planning.seam import PlantMotion
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from tests.sim import motions
from tests.sim.driving import READY, Ear, Track, numbers, ready, run

SPEED = 0.25
SIDES = ((0, 0.15, 0), (0.1, 0.15, 0), (0.1, 0, 0), (0, 0, 0))
AWAY = (0.4, 0.3, 0.1, -1.0, 0.2, 0.7, -0.2)


@dataclass
class PartEar(Ear):
    """Also records the events of parts."""

    parts: list[int] = field(default_factory=list)

    def reached(self, part: int) -> None:
        self.parts.append(part)


def points(plant: Plant, joints: Array) -> Array:
    return np.array([forward(plant.robot, q)[:3, 3] for q in joints])


def start_of(plant: Plant) -> Pose:
    return Pose.from_matrix(forward(plant.robot, plant.snapshot.q_cmd))


def at(start: Pose, offset: tuple[float, float, float]) -> tuple[float, ...]:
    return numbers(Pose(start.xyz + offset, start.quat))


def square(start: Pose, blending: tuple[float, float, float]) -> tuple[PlantMotion, ...]:
    return tuple(motions.lin(at(start, corner), velocity=SPEED, blending=blending) for corner in SIDES)


def speeds(track: Track, plant: Plant) -> Array:
    return np.asarray(np.linalg.norm(np.diff(points(plant, track.q_cmd), axis=0), axis=1) * 1e3)


def check_limits(track: Track, plant: Plant) -> None:
    robot = plant.robot
    assert (np.abs(np.diff(track.q_cmd, axis=0)) * 1e3 <= robot.dq_max * 1.001).all()
    assert (np.abs(track.acceleration) <= robot.ddq_max * 1.02).all()
    assert (np.abs(np.diff(track.acceleration, axis=0)) * 1e3 <= robot.dddq_max * 1.1).all()


@pytest.mark.parametrize("zone", [0.015, 0.02, 0.04])
def test_the_speed_at_a_blended_corner_is_at_least_30_percent(zone: float) -> None:
    plant, ear = ready(), PartEar()
    start = start_of(plant)
    order = MotionCommand(1, motions.batch(*square(start, (0, zone, 0))), listener=ear, part_listener=ear)
    track = run(plant, order)
    assert ear.causes == ["started", "done"] and ear.parts == [1, 2, 3]
    speed, seen = speeds(track, plant), points(plant, track.q_cmd)
    moving = slice(
        int(np.argmax(speed > 0.5 * SPEED)), len(speed) - int(np.argmax(speed[::-1] > 0.5 * SPEED))
    )
    assert speed[moving].min() >= 0.3 * SPEED
    assert speed.max() <= SPEED * 1.01
    for corner in SIDES[:3]:
        away = np.linalg.norm(seen - (start.xyz + corner), axis=1).min()
        assert 0.05 * zone < away < 0.5 * zone, "it cuts the corner, inside the zone"
    assert np.abs(seen[:, 2] - start.xyz[2]).max() < 1e-6, "it leaves the plane"
    turned = [Pose.from_matrix(forward(plant.robot, q)).angle_to(start) for q in track.q_cmd[::20]]
    assert max(turned) < 1e-6
    check_limits(track, plant)
    exact = run(ready(), MotionCommand(1, motions.batch(*square(start, (0, 0, 0)))))
    assert len(track.q) < len(exact.q)


def test_outside_the_zones_the_lines_are_straight() -> None:
    plant = ready()
    start = start_of(plant)
    track = run(plant, MotionCommand(1, motions.batch(*square(start, (0, 0.02, 0)))))
    seen = points(plant, track.q_cmd) - start.xyz
    corners = np.array([(0, 0, 0), *SIDES])
    far = (np.linalg.norm(seen[:, None] - corners[None, 1:4], axis=2) > 0.02).all(axis=1)
    to_sides = [np.abs(seen[:, 0]), np.abs(seen[:, 1] - 0.15), np.abs(seen[:, 0] - 0.1), np.abs(seen[:, 1])]
    assert np.min(to_sides, axis=0)[far].max() < 1e-6


def test_a_blend_goes_from_one_speed_to_the_other() -> None:
    plant = ready()
    start = start_of(plant)
    parts = (
        motions.lin(at(start, (0, 0.15, 0)), velocity=SPEED, blending=(0, 0.05, 0)),
        motions.lin(at(start, (0, 0.3, 0)), velocity=0.1),
    )
    track = run(plant, MotionCommand(1, motions.batch(*parts)))
    speed = speeds(track, plant)
    assert speed.max() == pytest.approx(SPEED, rel=0.01)
    travel = points(plant, track.q_cmd)[1:, 1] - start.xyz[1]
    between = speed[(travel > 0.09) & (travel < 0.25)]
    assert between.min() == pytest.approx(0.1, rel=0.03) and (np.diff(between) < 1e-4).all()


def test_joints_blend_with_lines_and_arcs() -> None:
    plant, ear = ready(), PartEar()
    start = start_of(plant)
    arc = motions.circ(
        at(start, (0.05, 0.05, 0)), at(start, (0, 0.1, 0)), velocity=SPEED, blending=(0, 0.03, 0)
    )
    parts = (
        motions.ptp((0.3, *READY[1:]), blending=(0, 0.05, 0)),
        motions.lin(numbers(start), velocity=SPEED, blending=(0.3, 0, 0)),
        arc,
        motions.ptp(AWAY, blending=(0.2, 0, 0)),
        motions.ptp(READY),
    )
    track = run(plant, MotionCommand(1, motions.batch(*parts), listener=ear, part_listener=ear))
    assert ear.causes == ["started", "done"] and ear.parts == [1, 2, 3, 4]
    check_limits(track, plant)
    fastest = np.abs(track.dq).max(axis=1)
    assert fastest[300:-300].min() > 0.02, "it stopped in transit"
    assert np.abs(plant.snapshot.q - READY).max() <= 1e-4


def test_progress_is_that_of_the_motion_under_way() -> None:
    plant, ear = ready(), PartEar()
    plant.submit(MotionCommand(1, motions.batch(*square(start_of(plant), (0, 0.02, 0))), part_listener=ear))
    seen: list[tuple[int, float]] = []
    while not plant.idle:
        plant.tick()
        seen.append((len(ear.parts), plant.snapshot.progress))
    assert sorted(seen[:-1]) == seen[:-1], "it went back"
    for part in range(4):
        fractions = [fraction for number, fraction in seen[:-1] if number == part]
        assert fractions[0] < 0.02 and fractions[-1] > 0.98


def test_without_blending_every_motion_ends_where_it_should() -> None:
    plant, ear = ready(), PartEar()
    start = start_of(plant)
    order = MotionCommand(1, motions.batch(*square(start, (0, 0, 0))), listener=ear, part_listener=ear)
    track = run(plant, order)
    seen = points(plant, track.q_cmd)
    for corner in SIDES:
        assert np.linalg.norm(seen - (start.xyz + corner), axis=1).min() < 1e-6
    assert ear.parts == [1, 2, 3]
    check_limits(track, plant)


def test_a_motion_of_a_batch_that_cannot_be_planned_is_named() -> None:
    plant = ready()
    start = start_of(plant)
    parts = (*square(start, (0, 0, 0)), motions.ptp((0, 3, 0, 0, 0, 0, 0)))
    with pytest.raises(PlanError, match=r"violates limit A2.*motion 5 of the batch"):
        plant.submit(MotionCommand(1, motions.batch(*parts)))
    with pytest.raises(PlanError, match="batch cannot have a motion of kind Hold"):
        plant.submit(MotionCommand(1, motions.batch(motions.hold())))
    assert plant.idle


def test_motions_that_guide_nowhere_are_passed_over() -> None:
    plant, ear = ready(), PartEar()
    start = start_of(plant)
    here = motions.lin(numbers(start), blending=(0, 0.02, 0))
    there = motions.lin(at(start, (0, 0.05, 0)), blending=(0, 0.02, 0))
    run(
        plant,
        MotionCommand(1, motions.batch(here, there, there, here), listener=ear, part_listener=ear),
    )
    assert ear.causes == ["started", "done"] and np.abs(plant.snapshot.q - READY).max() < 2e-4
    run(plant, MotionCommand(2, motions.batch(here, here), listener=(still := PartEar())))
    assert still.causes == ["started", "done"]


def test_the_override_slows_a_batch_down() -> None:
    plant = ready()
    start = start_of(plant)
    order = MotionCommand(1, motions.batch(*square(start, (0, 0.02, 0))))
    full = plan(plant.robot, order.motion, plant.snapshot.q_cmd).duration
    plant.override = 0.5
    plant.step(400)
    assert len(run(plant, order).q) * 1e-3 == pytest.approx(2 * full, rel=0.1)


def test_a_stop_in_a_batch_comes_to_rest_on_the_path_within_the_limits() -> None:
    random = np.random.default_rng(3)
    start = start_of(ready())
    order = MotionCommand(1, motions.batch(*square(start, (0, 0.02, 0))))
    path = points(plant := ready(), run(plant, order).q_cmd)
    for instant in random.integers(1, 2400, 7).tolist():
        plant, ear = ready(), Ear()
        plant.submit(replace(order, listener=ear))
        plant.step(instant)
        plant.stop()
        track = run(plant, most=900)
        assert ear.causes[-1] == "cancelled" and np.abs(plant.snapshot.dq).max() < 2e-3
        assert (np.abs(track.acceleration) <= plant.robot.ddq_max * 1.1).all()
        for point in points(plant, track.q_cmd[::25]):
            assert np.linalg.norm(path - point, axis=1).min() < 3e-4, "it left the path"
