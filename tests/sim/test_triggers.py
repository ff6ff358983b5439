"""Triggers on the plant: in parts of batches and splines, at the ends, with override and pause; events of parts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.seam import Condition, PathReached, PathReference, SignalIs
from heptarm.sim.controller.command import ConditionWatch, MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from tests.sim import motions
from tests.sim.driving import READY, ready, run

START, END = PathReference
SPEED = 0.1


@dataclass
class Log:
    """Events of an order, each with the position of the set-point, shape (3,) [m]."""

    plant: Plant
    reported: list[tuple[str, Array]] = field(default_factory=list)

    def add(self, what: str) -> None:
        self.reported.append((what, forward(self.plant.robot, self.plant.interpolator.command.after)[:3, 3]))

    def watch(self, name: str, condition: Condition, *, part: int = -1) -> ConditionWatch:
        return ConditionWatch(condition, lambda: self.add(name), part=part)

    def started(self) -> None:
        self.add("started")

    def reached(self, part: int) -> None:
        self.add(f"part {part}")

    def finished(self, cause: str, text: str) -> None:
        self.add(cause)

    @property
    def names(self) -> list[str]:
        return [name for name, _ in self.reported]

    def travel(self, name: str) -> Array:
        """Position of an event relative to the start of the motion, shape (3,) [m]."""
        return dict(self.reported)[name] - self.reported[0][1]


def point(reference: PathReference, distance: float, delay: float = 0.0) -> PathReached:
    """A point of the path."""
    return PathReached(reference=reference, distance=distance, delay=delay)


def corner(
    plant: Plant, log: Log, *watches: ConditionWatch, kind: str = "batch", blend: float = 0.0
) -> MotionCommand:
    """100 mm along y, then 100 mm along z."""
    here = Pose.from_matrix(forward(plant.robot, plant.snapshot.q))
    parts = tuple(
        motions.lin(
            Pose(here.xyz + travel, here.quat).array.tolist(), blending=(0.0, blend, 0.0), velocity=SPEED
        )
        for travel in ((0.0, 0.1, 0.0), (0.0, 0.1, 0.1))
    )
    motion = motions.batch(*parts) if kind == "batch" else motions.spline(*parts)
    return MotionCommand(1, motion, listener=log, part_listener=log, watches=watches)


@pytest.mark.parametrize("kind", ["batch", "spline"])
def test_points_count_from_the_ends_of_their_own_part(kind: str) -> None:
    plant = ready()
    log = Log(plant)
    watches = (
        log.watch("second half", point(START, 0.05), part=1),
        log.watch("first end", point(END, 0.0), part=0),
        log.watch("first near end", point(END, -0.03), part=0),
        log.watch("last end", point(END, 0.0), part=1),
        log.watch("start", point(START, 0.0), part=0),
        log.watch("beyond", point(START, 0.11), part=0),
        log.watch("second start", point(START, 0.0), part=1),
        log.watch("whole", point(START, 0.12)),
    )
    run(plant, corner(plant, log, *watches, kind=kind))
    assert log.names[:3] == ["started", "start", "first near end"] and "beyond" not in log.names
    assert log.names.index("part 1") < log.names.index("whole") < log.names.index("second half")
    assert log.names[-2:] == ["last end", "done"]
    for name, y, z in (
        ("first near end", 0.07, 0.0),
        ("first end", 0.1, 0.0),
        ("part 1", 0.1, 0.0),
        ("second start", 0.1, 0.0),
        ("whole", 0.1, 0.02),
        ("second half", 0.1, 0.05),
        ("last end", 0.1, 0.1),
    ):
        assert log.travel(name) == pytest.approx((0.0, y, z), abs=1e-3), name


def test_a_blended_motion_begins_in_the_middle_of_the_blend() -> None:
    plant = ready()
    log = Log(plant)
    order = corner(plant, log, log.watch("second", point(START, 0.0), part=1), blend=0.03)
    run(plant, order)
    _, y, z = log.travel("second")
    assert 0.07 < y < 0.1 and y + z == pytest.approx(0.1, abs=2e-3) and z > 1e-3


def test_other_conditions_count_while_their_part_runs() -> None:
    plant = ready()
    log = Log(plant)
    held = SignalIs(place=0)  # signal 0 is false, always
    watches = (log.watch("second", held, part=1), log.watch("first", held, part=0))
    run(plant, corner(plant, log, *watches))
    assert log.names == ["started", "first", "part 1", "second", "done"]
    assert log.travel("second") == pytest.approx((0.0, 0.1, 0.0), abs=1e-3)


def test_a_delay_may_reach_into_the_next_part() -> None:
    plant = ready()
    log = Log(plant)
    run(plant, corner(plant, log, log.watch("late", point(END, 0.0, delay=0.5), part=0)))
    y, z = log.travel("late")[1:]
    assert y == pytest.approx(0.1, abs=1e-3) and 0.005 < z < 0.06


def test_override_and_pause_move_no_point() -> None:
    plant = ready()
    log = Log(plant)
    plant.override = 0.4
    plant.submit(corner(plant, log, log.watch("point", point(START, 0.05), part=1)))
    plant.step(1000)
    plant.pause()
    plant.step(2000)
    assert "point" not in log.names
    paused = log.names
    plant.resume()
    plant.override = 0.8
    run(plant)
    assert paused == ["started"] and log.names == ["started", "part 1", "point", "done"]
    assert log.travel("point") == pytest.approx((0.0, 0.1, 0.05), abs=1e-3)


def test_what_is_cancelled_before_does_not_fire() -> None:
    plant = ready()
    log = Log(plant)
    plant.submit(corner(plant, log, log.watch("point", point(START, 0.09), part=1)))
    plant.step(800)
    plant.cancel()
    run(plant)
    assert log.names == ["started", "cancelled"]


def test_an_arm_that_is_there_already_has_the_ends_only() -> None:
    plant = ready()
    log = Log(plant)
    watches = (
        log.watch("start", point(START, 0.0)),
        log.watch("end", point(END, -0.01)),
        log.watch("on the way", point(START, 0.01)),
    )
    run(plant, MotionCommand(1, motions.ptp(READY), listener=log, watches=watches))
    assert log.names == ["started", "start", "end", "done"]


def test_segments_of_a_joint_spline_are_reported() -> None:
    plant = ready()
    log = Log(plant)
    knots = [(0.1 * k, *READY[1:]) for k in (1, 2, 2, 3)]  # the third one has no length
    parts = tuple(motions.ptp(knot) for knot in knots)
    order = MotionCommand(1, motions.spline_joints(*parts), listener=log, part_listener=log)
    seen = []
    plant.submit(order)
    while not plant.idle:
        plant.tick()
        seen.append(plant.snapshot.progress)
    assert log.names == ["started", "part 1", "part 2", "part 3", "done"]
    rising = np.array(seen[:-1])
    assert (np.diff(rising[rising > 0]) >= 0).all() and rising.max() == 1.0  # of the whole spline
