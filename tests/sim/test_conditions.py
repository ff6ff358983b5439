"""Conditions on the plant: one that fires brakes the motion on its path; triggers go off, observers watch on."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.virtual.condition import watching
from heptarm.virtual.order import Order, Watch
from heptarm.virtual.plant import Plant
from heptarm.virtual.world import Box
from tests.virtual.driving import READY, Ear, ready, run

#: Points and axes of the flange, and the base's axes at the flange.
OWN = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
BASE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
X, Y, Z = 0.0, 1.0, 2.0
DOWN = {
    "kind": "lin_rel",
    "offset": (0, 0, -0.2, 0, 0, 0, 1),
    "reference": (0, 0, 0, 1),
    "cart_velocity": 0.1,
}


def broken(order: dict[str, object], condition: Sequence[float]) -> tuple[Order, list[str]]:
    heard: list[str] = []
    watch = Watch(tuple(condition), lambda: heard.append("fired"), breaks=True)
    return Order(1, **order, watches=(watch,), listener=Told(heard)), heard  # type: ignore[arg-type]


class Told:
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
FIRES: list[tuple[str, tuple[float, ...], bool]] = [
    ("joint torque", (1, 1, -0.5, 0.5), True),
    ("a wide band", (1, 1, -50, 50), False),
    ("all of the force", (2, *OWN, X, 10.0), True),
    ("not that much", (2, *OWN, X, 11.0), False),
    ("along z", (3, *BASE, Z, 9.0), True),
    ("along x", (3, *BASE, X, 9.0), False),
    ("across z", (4, *BASE, Z, 2.5), True),
    ("across y", (4, *BASE, Y, 9.0), True),
    ("across z, too much", (4, *BASE, Z, 9.0), False),
    ("a component", (5, *BASE, Z, -5.0, 5.0), True),
    ("its sign", (5, *BASE, Z, -100.0, 11.0), False),
    ("in the flange's axes z points down", (5, *OWN, Z, -5.0, 100.0), True),
    ("torque about x", (6, *BASE, X, -1.0, 0.5), True),
    ("not", (2, *OWN, X, 11.0, 34, 1), True),
    ("and", (2, *OWN, X, 10.0, 3, *BASE, X, 9.0, 32, 2), False),
    ("or", (2, *OWN, X, 10.0, 3, *BASE, X, 9.0, 33, 2), True),
]


@pytest.mark.parametrize(("condition", "fires"), [c[1:] for c in FIRES], ids=[c[0] for c in FIRES])
def test_each_kind_of_condition(condition: tuple[float, ...], fires: bool) -> None:
    plant = ready()
    pushed(plant, FORCE, (1.0, 0.0, 0.0))
    order, heard = broken({"kind": "hold", "duration": 0.05}, condition)
    run(plant, order)
    assert heard == (["started", "fired", "condition"] if fires else ["started", "done"])


def test_a_torque_is_seen_from_where_it_is_measured() -> None:
    plant = ready()
    pushed(plant, (0.0, 10.0, 0.0))
    away = (
        1.0,
        0.0,
        0.0,
        0.3,
        0.0,
        0.0,
        0.0,
        0.0,
        1.0,
    )  # 0.3 m along z of the flange, which has turned by 0.2 rad
    z = forward(plant.robot, plant.snapshot.q)[:3, 2]
    lever = -0.3 * float(z[2])  # the flange seen from there, along z
    seen = -lever * 10.0  # about x
    for band, fires in (((seen - 0.2, seen + 0.2), False), ((-100.0, seen - 0.2), True)):
        order, heard = broken({"kind": "hold", "duration": 0.02}, (6, *away, X, *band))
        run(plant, order)
        assert ("fired" in heard) is fires


def test_a_line_down_onto_a_push_brakes_on_its_path() -> None:
    plant = ready()
    start = forward(plant.robot, plant.snapshot.q)[:3, 3]
    order, heard = broken(DOWN, (5, *BASE, Z, -1000.0, 10.0))
    plant.submit(order)
    plant.step(700)
    plant.apply_wrench((0.0, 0.0, 15.0))
    track = run(plant)
    assert heard == ["started", "fired", "condition"]
    way = forward(plant.robot, track.q_cmd[-1])[:3, 3] - start
    assert -0.15 < way[2] < -0.04 and np.abs(way[:2]).max() < 1e-3
    assert np.abs(track.acceleration).max() < 1.2 * plant.robot.ddq_max.max()
    plant.submit(Order(2, "ptp", joints=READY))  # and the next motion begins where it came to rest
    run(plant)
    assert np.abs(plant.snapshot.q_cmd - READY).max() < 1e-9


def test_what_is_queued_behind_it_goes_on_from_there() -> None:
    plant, ear = ready(), Ear()
    order, heard = broken(DOWN, (9, 0, 0.05, 0.0))
    plant.submit(order)
    plant.submit(Order(2, "ptp", joints=READY, listener=ear))
    run(plant)
    assert heard == ["started", "fired", "condition"] and ear.causes == ["started", "done"]


@pytest.mark.parametrize(
    ("reference", "distance", "delay", "way"),
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
    reference: float, distance: float, delay: float, way: float
) -> None:
    plant, seen = ready(), []
    start = forward(plant.robot, plant.snapshot.q)[:3, 3]

    def fired() -> None:
        seen.append(float(np.linalg.norm(forward(plant.robot, plant.snapshot.q_cmd)[:3, 3] - start)))

    plant.submit(Order(1, **DOWN, watches=(Watch((9, reference, distance, delay), fired),)))  # type: ignore[arg-type]
    track = run(plant)
    assert len(seen) == 1
    assert seen[0] == pytest.approx(way, abs=0.012 if reference and delay else 2e-3)
    end = float(np.linalg.norm(forward(plant.robot, track.q_cmd[-1])[:3, 3] - start))
    assert end == pytest.approx(0.2, abs=1e-6)


def test_a_point_beyond_the_path_is_never_reached() -> None:
    plant = ready()
    order, heard = broken(DOWN, (9, 0, 0.3, 0.0))
    run(plant, order)
    assert heard == ["started", "done"]


def test_on_a_joint_motion_the_moved_frame_counts() -> None:
    plant = ready()
    joints = (0.5, *READY[1:])
    order, heard = broken({"kind": "ptp", "joints": joints, "joint_velocity": (0.2,) * 7}, (9, 0, 0.1, 0.0))
    start = forward(plant.robot, plant.snapshot.q)[:3, 3]
    run(plant, order)
    way = float(np.linalg.norm(forward(plant.robot, plant.snapshot.q_cmd)[:3, 3] - start))
    assert heard == ["started", "fired", "condition"] and 0.1 < way < 0.14


def test_a_servo_motion_breaks_too() -> None:
    plant = ready()
    order, heard = broken({"kind": "servo"}, (2, *OWN, X, 5.0))
    plant.submit(order)
    plant.step(5)
    plant.ring.post(1, np.array(READY) + 0.2)
    plant.step(200)
    plant.apply_wrench((0.0, 0.0, 8.0))
    run(plant)
    assert heard == ["started", "fired", "condition"]
    assert np.abs(plant.snapshot.dq).max() < 1e-3


def test_an_observer_hears_edges_whatever_moves() -> None:
    plant, heard = ready(), []
    number = plant.lookout.observe((2, *OWN, X, 5.0), heard.append, at_once=True)
    plant.step(100)
    pushed(plant, (8.0, 0.0, 0.0))
    late: list[bool] = []
    told: list[bool] = []
    plant.lookout.observe((2, *OWN, X, 5.0), late.append, at_once=False)
    plant.lookout.observe((2, *OWN, X, 5.0), told.append, at_once=True)
    plant.step(10)
    plant.apply_wrench((0.0, 0.0, 0.0))
    plant.step(300)
    assert heard == [True, False] and late == [False] and told == [True, False]
    plant.lookout.forget(number)
    pushed(plant, (8.0, 0.0, 0.0))
    assert heard == [True, False]


def test_signals_are_conditions() -> None:
    plant = ready()
    order, heard = broken({"kind": "hold", "duration": 1.0}, (7, 3, 1, 8, 4, -1.0, 1.0, 32, 2))
    plant.submit(order)
    plant.step(10)
    plant.ring.signals[3] = 1.0
    plant.step(10)
    assert heard == ["started"]
    plant.ring.signals[4] = 2.0
    run(plant)
    assert heard == ["started", "fired", "condition"]


@pytest.mark.parametrize("numbers", [(), (77, 1), (1, 0, -1, 1, 1, 0, -1, 1), (9,)])
def test_numbers_that_are_no_condition_are_refused(numbers: tuple[float, ...]) -> None:
    tell: Callable[[bool], None] = print
    with pytest.raises((ValueError, IndexError)):
        watching(numbers, tell)


def test_a_line_down_stops_on_a_table() -> None:
    table = Box((0.6, 0.0, 0.15), (0.4, 0.6, 0.3))
    plant = Plant(q=READY, boxes=[table])
    height = float(forward(plant.robot, plant.snapshot.q)[2, 3])
    down = {**DOWN, "offset": (0, 0, -height, 0, 0, 0, 1), "cart_velocity": 0.02}
    order, heard = broken(down, (5, *BASE, Z, -1000.0, 10.0))
    run(plant, order)
    assert heard == ["started", "fired", "condition"]
    plant.step(200)
    state = plant.snapshot
    assert 0.3 < forward(plant.robot, state.q)[2, 3] < 0.33
    assert 10.0 < state.wrench[2] < 60.0


@pytest.mark.parametrize("text", ["", "1,2,3", "0,0,0,1,1,0", "0,0,0,1,1,x", "0,0,nan,1,1,1"])
def test_what_is_no_box_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="no box"):
        Box.of(text)
