"""Splines pass through their points without a stop, in Cartesian and in joint space."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.motion import PlanError
from heptarm.planning.targets import SplineSegment
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.pose import Pose
from tests.sim import motions
from tests.sim.driving import READY, Ear, numbers, ready, run
from tests.sim.test_batch import check_limits, points, speeds, start_of

KNOTS = ((0.05, 0.05, 0.0), (0.0, 0.12, 0.03), (0.06, 0.2, 0.0), (0.0, 0.25, -0.03))
JOINTS = (
    (0.4, 0.3, 0.1, -1.0, 0.2, 0.7, -0.2),
    (0.8, 0.5, 0.0, -1.2, 0.2, 0.9, 0.4),
    (0.3, 0.2, 0.3, -1.4, 0.0, 0.6, 0.1),
)


def to(start: Pose, x: float, y: float, z: float, a: float = 0.0, b: float = 0.0) -> Pose:
    return Pose(start.xyz + [x, y, z], (start @ Pose.xyz_abc(a=a, b=b)).quat)


def segment(kind: str, pose: Pose, speed: float = 0.2, **more: Any) -> SplineSegment:
    made: SplineSegment = getattr(motions, kind)(numbers(pose), velocity=speed, **more)
    return made


def arc_to(via: Pose, end: Pose) -> SplineSegment:
    return motions.circ(numbers(via), numbers(end), velocity=0.2)


def curve(plant: Plant, knots: tuple[tuple[float, ...], ...] = KNOTS) -> MotionCommand:
    return MotionCommand(1, motions.spline(*(segment("spl", to(start_of(plant), *knot)) for knot in knots)))


def test_a_spline_passes_through_its_points_within_half_a_millimetre() -> None:
    plant, ear = ready(), Ear()
    start = start_of(plant)
    track = run(plant, replace(curve(plant), listener=ear))
    assert ear.causes == ["started", "done"]
    seen = points(plant, track.q)
    for knot in KNOTS:
        assert np.linalg.norm(seen - to(start, *knot).xyz, axis=1).min() <= 0.5e-3
    assert np.linalg.norm(seen[-1] - to(start, *KNOTS[-1]).xyz) < 2e-4
    speed = speeds(track, plant)
    assert speed[200:-200].min() > 0.3 * 0.2 and speed.max() <= 0.2 * 1.02
    check_limits(track, plant)


def test_the_orientation_passes_through_that_of_every_point_smoothly() -> None:
    plant = ready()
    start = start_of(plant)
    turns = ((0.3, 0.0), (0.3, 0.2), (-0.2, 0.0), (0.0, 0.0))
    knots = tuple((*knot, *turn) for knot, turn in zip(KNOTS, turns, strict=True))
    track = run(plant, curve(plant, knots))
    poses = [Pose.from_matrix(forward(plant.robot, q)) for q in track.q_cmd]
    for knot in knots:
        target = to(start, *knot)
        nearest = min(poses, key=target.distance_to)
        assert nearest.angle_to(target) < 5e-3
    assert poses[-1].angle_to(to(start, *knots[-1])) < 1e-6
    check_limits(track, plant)


def test_constant_keeps_and_ignore_leaves_the_orientation_to_the_neighbours() -> None:
    plant = ready()
    start = start_of(plant)
    poses = [to(start, *knot, a=0.4) for knot in KNOTS]
    parts = [segment("spl", pose, orientation=("constant", "base")) for pose in poses]
    track = run(plant, MotionCommand(1, motions.spline(*parts)))
    assert max(Pose.from_matrix(forward(plant.robot, q)).angle_to(start) for q in track.q_cmd[::20]) < 1e-6
    plant = ready()
    kinds = ("ignore", "ignore", "ignore", "variable")
    parts = [
        segment("spl", pose, orientation=(kind, "base")) for pose, kind in zip(poses, kinds, strict=True)
    ]
    track = run(plant, MotionCommand(1, motions.spline(*parts)))
    seen = [Pose.from_matrix(forward(plant.robot, q)) for q in track.q_cmd]
    middle = min(seen, key=poses[1].distance_to)
    assert 0.1 < middle.angle_to(start) < 0.3, "it turns all the way"
    assert seen[-1].angle_to(poses[-1]) < 1e-6


def test_lines_and_arcs_of_a_spline_keep_their_shape_and_its_speed() -> None:
    plant = ready()
    start = start_of(plant)
    r, h = 0.06, 0.06 * np.sqrt(0.5)
    line = segment("lin", to(start, 0, 0.1, 0))
    arc = arc_to(to(start, r - h, 0.1 + h, 0), to(start, r, 0.1 + r, 0))
    back = segment("spl", to(start, 0.1, 0.1, -0.03))
    track = run(plant, MotionCommand(1, motions.spline(line, arc, back)))
    seen = points(plant, track.q_cmd) - start.xyz
    on_line = seen[seen[:, 1] < 0.0999][: len(seen) // 2]
    assert np.abs(on_line[:, [0, 2]]).max() < 1e-6
    quarter = seen[(seen[:, 1] > 0.1) & (seen[:, 0] < r - 1e-4) & (np.abs(seen[:, 2]) < 1e-9)]
    assert np.abs(np.hypot(quarter[:, 0] - r, quarter[:, 1] - 0.1) - r).max() < 1e-6
    speed = speeds(track, plant)
    assert speed[250:-250].min() > 0.05, "it does not rest where the shapes meet"


def test_every_segment_has_its_speed_and_a_corner_is_a_halt() -> None:
    plant = ready()
    start = start_of(plant)
    lines = [segment("lin", to(start, 0, y, 0), v) for y, v in ((0.1, 0.3), (0.2, 0.1), (0.3, 0.3))]
    track = run(plant, MotionCommand(1, motions.spline(*lines)))
    travel, speed = points(plant, track.q_cmd)[1:, 1] - start.xyz[1], speeds(track, plant)
    assert speed[(travel > 0.1) & (travel < 0.2)].max() <= 0.1 * 1.05
    assert speed[(travel > 0.12) & (travel < 0.18)].min() >= 0.1 * 0.95
    assert speed.max() == pytest.approx(0.3, rel=0.02)
    plant = ready()
    corner = to(start, 0, 0.1, 0)
    track = run(
        plant,
        MotionCommand(1, motions.spline(segment("lin", corner), segment("lin", to(start, 0.1, 0.1, 0)))),
    )
    seen = points(plant, track.q_cmd)
    assert np.linalg.norm(seen - corner.xyz, axis=1).min() < 1e-6
    check_limits(track, plant)


def test_a_joint_spline_passes_through_its_points() -> None:
    plant, ear = ready(), Ear()
    parts = tuple(motions.ptp(q) for q in (*JOINTS, READY))
    track = run(plant, MotionCommand(1, motions.spline_joints(*parts), listener=ear))
    assert ear.causes == ["started", "done"]
    for q in JOINTS:
        assert np.abs(track.q_cmd - q).max(axis=1).min() < 2e-3
        near = int(np.abs(track.q_cmd - q).max(axis=1).argmin())
        assert np.abs(track.dq[near]).max() > 0.1, "it rests at a point"
    assert np.abs(plant.snapshot.q - READY).max() <= 1e-4
    check_limits(track, plant)
    slow = tuple(motions.ptp(part.q, joint_velocity=(0.3,) * 7) for part in parts)
    plant = ready()
    gentle = run(plant, MotionCommand(1, motions.spline_joints(*slow)))
    assert (np.abs(gentle.dq).max(axis=0) <= 0.3 * plant.robot.dq_max * 1.02).all()


def test_what_makes_no_spline_is_refused_by_name() -> None:
    plant = ready()
    start = start_of(plant)
    good = segment("spl", to(start, *KNOTS[0]))
    for part, words in (
        (segment("spl", to(start, *KNOTS[0]), orientation=("joint", "base")), "segment 2.*joint"),
        (segment("spl", to(start, *KNOTS[0]), orientation=("constant", "path")), "segment 2.*path"),
        (motions.ptp(READY), "kind Ptp"),
        (arc_to(to(start, 0.075, 0.075, 0), to(start, 0.1, 0.1, 0)), "lie on a line"),
        (segment("spl", to(start, 0, 0.9, 0)), "not reachable"),
    ):
        with pytest.raises(PlanError, match=words):
            plant.submit(MotionCommand(1, motions.spline(good, part)))
    with pytest.raises(PlanError, match=r"violates limit A2.*point 1"):
        plant.submit(MotionCommand(1, motions.spline_joints(motions.ptp((0, 3, 0, 0, 0, 0, 0)))))
    with pytest.raises(PlanError, match="joint spline cannot have a segment of kind Spl"):
        plant.submit(MotionCommand(1, motions.spline_joints(good)))
    assert plant.idle


def test_a_spline_of_nothing_ends_at_once() -> None:
    plant, ear = ready(), Ear()
    run(plant, MotionCommand(1, motions.spline(segment("spl", start_of(plant))), listener=ear))
    run(plant, MotionCommand(2, motions.spline_joints(motions.ptp(READY)), listener=ear))
    assert ear.causes == ["started", "done"] * 2


@pytest.mark.parametrize("kind", ["spline", "spline_joints"])
def test_a_stop_in_a_spline_comes_to_rest_on_it(kind: str) -> None:
    random = np.random.default_rng(4)
    parts = tuple(motions.ptp(q) for q in (*JOINTS, READY))
    order = curve(ready()) if kind == "spline" else MotionCommand(1, motions.spline_joints(*parts))
    plant = ready()
    path = run(plant, order).q_cmd
    for instant in (*random.integers(1, 1800, 4).tolist(), 1756):  # the last: while it brakes anyway
        plant, ear = ready(), Ear()
        plant.submit(replace(order, listener=ear))
        plant.step(instant)
        plant.stop()
        track = run(plant, most=900)
        assert ear.causes[-1] == "cancelled" and np.abs(plant.snapshot.dq).max() < 2e-3
        assert (np.abs(track.acceleration) <= plant.robot.ddq_max * 1.15).all()
        for q in track.q_cmd[::25]:
            assert np.abs(path - q).max(axis=1).min() < 2e-3, "it left the path"
