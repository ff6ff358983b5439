"""Conditions on the plant: break conditions brake the motion on its path, triggers fire, observers continue."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.seam import (
    AllOf,
    AnyOf,
    Condition,
    Inverted,
    JointTorqueOutside,
    MeasuringFrame,
    PathReached,
    PathReference,
    PlantMotion,
    SignalIs,
    SignalOutside,
    WrenchAbove,
    WrenchComponents,
    WrenchOutside,
)
from heptarm.sim.controller.command import ConditionWatch, MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.sim.plant.world import Box
from tests.sim import motions
from tests.sim.driving import READY, Ear, ready, run

#: Points and axes of the flange, and the base's axes at the flange.
OWN = MeasuringFrame(point_moves=True, point=(0.0, 0.0, 0.0), axes_move=True, axes=(0.0, 0.0, 0.0, 1.0))
BASE = MeasuringFrame(point_moves=True, point=(0.0, 0.0, 0.0), axes_move=False, axes=(0.0, 0.0, 0.0, 1.0))
X, Y, Z, *_ = WrenchComponents
ALL = X | Y | Z
DOWN = motions.lin_rel((0, 0, -0.2, 0, 0, 0, 1), (0, 0, 0, 1), velocity=0.1)


def broken(motion: PlantMotion, condition: Condition) -> tuple[MotionCommand, list[str]]:
    heard: list[str] = []
    watch = ConditionWatch(condition, lambda: heard.append("fired"), breaks=True)
    return MotionCommand(1, motion, watches=(watch,), listener=Reported(heard)), heard


class Reported:
    def __init__(self, heard: list[str]) -> None:
        self.heard = heard

    def started(self) -> None:
        self.heard.append("started")

    def finished(self, cause: str, text: str) -> None:
        self.heard.append(cause)


def pushed(plant: Plant, force: tuple[float, float, float], torque: tuple[float, ...] = (0, 0, 0)) -> None:
    plant.apply_wrench(force, torque)
    plant.step(400)


FORCE = (0.0, 3.0, 10.0)
FIRES: list[tuple[str, Condition, bool]] = [
    ("joint torque", JointTorqueOutside(joint=1, low=-0.5, high=0.5), True),
    ("a wide band", JointTorqueOutside(joint=1, low=-50.0, high=50.0), False),
    ("all of the force", WrenchAbove(frame=OWN, components=ALL, threshold=10.0), True),
    ("not that much", WrenchAbove(frame=OWN, components=ALL, threshold=11.0), False),
    ("along z", WrenchAbove(frame=BASE, components=Z, threshold=9.0), True),
    ("along x", WrenchAbove(frame=BASE, components=X, threshold=9.0), False),
    ("across z", WrenchAbove(frame=BASE, components=X | Y, threshold=2.5), True),
    ("across y", WrenchAbove(frame=BASE, components=X | Z, threshold=9.0), True),
    ("across z, too much", WrenchAbove(frame=BASE, components=X | Y, threshold=9.0), False),
    ("a component", WrenchOutside(frame=BASE, component=2, low=-5.0, high=5.0), True),
    ("its sign", WrenchOutside(frame=BASE, component=2, low=-100.0, high=11.0), False),
    ("in the flange's axes z points down", WrenchOutside(frame=OWN, component=2, low=-5.0, high=100.0), True),
    ("torque about x", WrenchOutside(frame=BASE, component=3, low=-1.0, high=0.5), True),
    ("not", Inverted(part=WrenchAbove(frame=OWN, components=ALL, threshold=11.0)), True),
    (
        "and",
        AllOf(
            parts=(
                WrenchAbove(frame=OWN, components=ALL, threshold=10.0),
                WrenchAbove(frame=BASE, components=X, threshold=9.0),
            )
        ),
        False,
    ),
    (
        "or",
        AnyOf(
            parts=(
                WrenchAbove(frame=OWN, components=ALL, threshold=10.0),
                WrenchAbove(frame=BASE, components=X, threshold=9.0),
            )
        ),
        True,
    ),
]


@pytest.mark.parametrize(("condition", "fires"), [c[1:] for c in FIRES], ids=[c[0] for c in FIRES])
def test_each_kind_of_condition(condition: Condition, fires: bool) -> None:
    plant = ready()
    pushed(plant, FORCE, (1.0, 0.0, 0.0))
    order, heard = broken(motions.hold(0.05), condition)
    run(plant, order)
    assert heard == (["started", "fired", "condition"] if fires else ["started", "done"])


def test_a_torque_is_seen_from_where_it_is_measured() -> None:
    plant = ready()
    pushed(plant, (0.0, 10.0, 0.0))
    # 0.3 m along z of the flange, which has turned by 0.2 rad
    away = MeasuringFrame(point_moves=True, point=(0.0, 0.0, 0.3), axes_move=False, axes=(0.0, 0.0, 0.0, 1.0))
    z = forward(plant.robot, plant.snapshot.q)[:3, 2]
    lever = -0.3 * float(z[2])  # the flange seen from there, along z
    seen = -lever * 10.0  # about x
    for band, fires in (((seen - 0.2, seen + 0.2), False), ((-100.0, seen - 0.2), True)):
        order, heard = broken(
            motions.hold(0.02),
            WrenchOutside(frame=away, component=3, low=band[0], high=band[1]),
        )
        run(plant, order)
        assert ("fired" in heard) is fires


def test_a_line_down_onto_a_push_brakes_on_its_path() -> None:
    plant = ready()
    start = forward(plant.robot, plant.snapshot.q)[:3, 3]
    order, heard = broken(DOWN, WrenchOutside(frame=BASE, component=2, low=-1000.0, high=10.0))
    plant.submit(order)
    plant.step(700)
    plant.apply_wrench((0.0, 0.0, 15.0))
    track = run(plant)
    assert heard == ["started", "fired", "condition"]
    travel = forward(plant.robot, track.q_cmd[-1])[:3, 3] - start
    assert -0.15 < travel[2] < -0.04 and np.abs(travel[:2]).max() < 1e-3
    assert np.abs(track.acceleration).max() < 1.2 * plant.robot.ddq_max.max()
    plant.submit(MotionCommand(2, motions.ptp(READY)))  # and the next motion starts where it came to rest
    run(plant)
    assert np.abs(plant.snapshot.q_cmd - READY).max() < 1e-9


def test_what_is_queued_behind_it_goes_on_from_there() -> None:
    plant, ear = ready(), Ear()
    order, heard = broken(DOWN, PathReached(distance=0.05, delay=0.0))
    plant.submit(order)
    plant.submit(MotionCommand(2, motions.ptp(READY), listener=ear))
    run(plant)
    assert heard == ["started", "fired", "condition"] and ear.causes == ["started", "done"]


@pytest.mark.parametrize(
    ("reference", "distance", "delay", "travel"),
    [
        (0, 0.05, 0.0, 0.05),
        (0, 0.0, 0.0, 0.0),
        (1, -0.05, 0.0, 0.15),
        (0, 0.05, 0.5, 0.10),  # at 0.1 m/s
        (1, -0.05, -0.5, 0.10),
        (1, 0.0, -1.0, 0.1),
    ],
)
def test_a_trigger_goes_off_at_a_point_of_the_path(
    reference: int, distance: float, delay: float, travel: float
) -> None:
    plant, seen = ready(), []
    start = forward(plant.robot, plant.snapshot.q)[:3, 3]

    def fired() -> None:
        seen.append(float(np.linalg.norm(forward(plant.robot, plant.snapshot.q_cmd)[:3, 3] - start)))

    point = PathReached(reference=PathReference(reference), distance=distance, delay=delay)
    plant.submit(MotionCommand(1, DOWN, watches=(ConditionWatch(point, fired),)))
    track = run(plant)
    assert len(seen) == 1
    assert seen[0] == pytest.approx(travel, abs=0.012 if reference and delay else 2e-3)
    end = float(np.linalg.norm(forward(plant.robot, track.q_cmd[-1])[:3, 3] - start))
    assert end == pytest.approx(0.2, abs=1e-6)


def test_a_point_beyond_the_path_is_never_reached() -> None:
    plant = ready()
    order, heard = broken(DOWN, PathReached(distance=0.3, delay=0.0))
    run(plant, order)
    assert heard == ["started", "done"]


def test_on_a_joint_motion_the_motion_frame_counts() -> None:
    plant = ready()
    joints = (0.5, *READY[1:])
    order, heard = broken(
        motions.ptp(joints, joint_velocity=(0.2,) * 7), PathReached(distance=0.1, delay=0.0)
    )
    start = forward(plant.robot, plant.snapshot.q)[:3, 3]
    run(plant, order)
    travel = float(np.linalg.norm(forward(plant.robot, plant.snapshot.q_cmd)[:3, 3] - start))
    assert heard == ["started", "fired", "condition"] and 0.1 < travel < 0.14


def test_a_servo_motion_breaks_too() -> None:
    plant = ready()
    order, heard = broken(motions.servo(), WrenchAbove(frame=OWN, components=ALL, threshold=5.0))
    plant.submit(order)
    plant.step(5)
    plant.shared.post(1, np.array(READY) + 0.2)
    plant.step(200)
    plant.apply_wrench((0.0, 0.0, 8.0))
    run(plant)
    assert heard == ["started", "fired", "condition"]
    assert np.abs(plant.snapshot.dq).max() < 1e-3


def test_an_observer_hears_edges_whatever_moves() -> None:
    plant = ready()
    heard: list[bool] = []
    number = plant.condition_monitor.observe(
        WrenchAbove(frame=OWN, components=ALL, threshold=5.0), heard.append, at_once=True
    )
    plant.step(100)
    pushed(plant, (8.0, 0.0, 0.0))
    late: list[bool] = []
    reported: list[bool] = []
    plant.condition_monitor.observe(
        WrenchAbove(frame=OWN, components=ALL, threshold=5.0), late.append, at_once=False
    )
    plant.condition_monitor.observe(
        WrenchAbove(frame=OWN, components=ALL, threshold=5.0), reported.append, at_once=True
    )
    plant.step(10)
    plant.apply_wrench((0.0, 0.0, 0.0))
    plant.step(300)
    assert heard == [True, False] and late == [False] and reported == [True, False]
    plant.condition_monitor.forget(number)
    pushed(plant, (8.0, 0.0, 0.0))
    assert heard == [True, False]


def test_signals_are_conditions() -> None:
    plant = ready()
    order, heard = broken(
        motions.hold(1.0),
        AllOf(parts=(SignalIs(place=3, value=True), SignalOutside(place=4, low=-1.0, high=1.0))),
    )
    plant.submit(order)
    plant.step(10)
    plant.shared.signals[3] = 1.0
    plant.step(10)
    assert heard == ["started"]
    plant.shared.signals[4] = 2.0
    run(plant)
    assert heard == ["started", "fired", "condition"]


def test_a_line_down_stops_on_a_table() -> None:
    table = Box((0.6, 0.0, 0.15), (0.4, 0.6, 0.3))
    plant = Plant(q=READY, boxes=[table])
    height = float(forward(plant.robot, plant.snapshot.q)[2, 3])
    down = motions.lin_rel((0, 0, -height, 0, 0, 0, 1), (0, 0, 0, 1), velocity=0.02)
    order, heard = broken(down, WrenchOutside(frame=BASE, component=2, low=-1000.0, high=10.0))
    run(plant, order)
    assert heard == ["started", "fired", "condition"]
    plant.step(200)
    state = plant.snapshot
    assert 0.3 < forward(plant.robot, state.q)[2, 3] < 0.33
    assert 5.0 < state.wrench[2] < 20.0


@pytest.mark.parametrize("text", ["", "1,2,3", "0,0,0,1,1,0", "0,0,0,1,1,x", "0,0,nan,1,1,1"])
def test_what_is_no_box_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="box must be"):
        Box.of(text)
