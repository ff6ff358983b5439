"""Orders are queued; cancelling, pausing and the override work during a motion."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from tests.sim import motions
from tests.sim.driving import READY, Ear, ready, run

THERE = (0.8, 0.3, 0.1, -1.0, 0.2, 0.7, -0.2)


def at_rest(plant: Plant) -> bool:
    return bool(np.abs(plant.snapshot.dq).max() < 2e-3)


def test_three_orders_run_one_after_the_other() -> None:
    plant, ears = ready(), [Ear(), Ear(), Ear()]
    goals = [THERE, READY, (0.2, *READY[1:])]
    for index, (goal, ear) in enumerate(zip(goals, ears, strict=True)):
        plant.submit(MotionCommand(index + 1, motions.ptp(goal), listener=ear))
    order = []
    while not plant.idle:
        plant.tick()
        if plant.snapshot.order and plant.snapshot.order not in order:
            order.append(plant.snapshot.order)
    assert order == [1, 2, 3]
    assert [ear.causes for ear in ears] == [["started", "done"]] * 3
    assert np.abs(plant.snapshot.q - goals[-1]).max() <= 1e-4


def test_an_order_is_planned_from_the_end_of_the_one_before_it() -> None:
    plant = ready()
    plant.submit(MotionCommand(1, motions.ptp(THERE)))
    track = run(plant, MotionCommand(2, motions.lin_rel((0, 0, 0.05, 0, 0, 0, 1))))
    assert np.abs(np.diff(track.q_cmd, axis=0)).max() * 1e3 <= plant.robot.dq_max.max()


@pytest.mark.parametrize("ticks", [1, 60, 200, 420])
def test_cancelling_brakes_on_the_path_within_the_limits(ticks: int) -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, motions.ptp(THERE), listener=ear))
    plant.step(ticks)
    plant.cancel(1)
    track = run(plant)
    assert ear.causes[-1] == "cancelled" and ear.causes.count("cancelled") == 1
    travel = np.array(THERE) - READY
    s = (track.q_cmd - READY) @ travel / (travel @ travel)
    assert np.abs(track.q_cmd - READY - s[:, None] * travel).max() < 1e-9, "it left the path"
    assert (np.abs(track.acceleration) <= plant.robot.ddq_max * 1.01).all()
    assert at_rest(plant)


def test_cancelling_everything_drops_what_waits() -> None:
    plant, ears = ready(), [Ear(), Ear()]
    for index, ear in enumerate(ears):
        plant.submit(MotionCommand(index + 1, motions.ptp((THERE, READY)[index]), listener=ear))
    plant.step(100)
    plant.stop()
    run(plant)
    assert ears[0].causes == ["started", "cancelled"] and ears[1].causes == ["cancelled"]


def test_a_waiting_order_that_is_cancelled_leaves_its_followers_sound() -> None:
    plant, ears = ready(), [Ear(), Ear(), Ear()]
    for index, goal in enumerate((THERE, (-0.5, *READY[1:]), READY)):
        plant.submit(MotionCommand(index + 1, motions.ptp(goal), listener=ears[index]))
    plant.step(50)
    plant.cancel(2)
    track = run(plant)
    assert [ear.causes[-1] for ear in ears] == ["done", "cancelled", "done"]
    assert np.abs(np.diff(track.q_cmd, axis=0)).max() * 1e3 <= plant.robot.dq_max.max()
    assert np.abs(plant.snapshot.q - READY).max() <= 1e-4


def test_cancellations_of_one_tick_drop_what_they_name_and_nothing_later() -> None:
    plant, ears = ready(), [Ear() for _ in range(6)]
    for index, ear in enumerate(ears[:5]):
        plant.submit(MotionCommand(index + 1, motions.ptp((THERE, READY)[index % 2]), listener=ear))
    plant.tick()
    for number in (5, 4, 2):
        plant.cancel(number)
    plant.submit(MotionCommand(4, motions.ptp(THERE), listener=ears[5]))
    plant.tick()
    assert [ear.causes[-1:] for ear in ears] == [
        ["started"],
        ["cancelled"],
        [],
        ["cancelled"],
        ["cancelled"],
        [],
    ]
    run(plant)
    assert [ear.causes[-1] for ear in ears] == ["done", "cancelled", "done", "cancelled", "cancelled", "done"]


def test_an_order_given_while_the_arm_brakes_is_planned_when_it_rests() -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, motions.ptp(THERE)))
    plant.step(200)
    plant.cancel(1)
    plant.submit(MotionCommand(2, motions.ptp(READY), listener=ear))
    plant.submit(MotionCommand(3, motions.ptp((0, 3.0, 0, 0, 0, 0, 0)), listener=(bad := Ear())))
    run(plant)
    assert ear.causes == ["started", "done"]
    assert bad.causes == ["error"] and "violates limit A2" in bad.heard[0][1]


def test_pausing_keeps_the_order_and_resuming_finishes_it() -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, motions.ptp(THERE), listener=ear))
    plant.step(200)
    plant.pause()
    plant.step(500)
    assert at_rest(plant) and ear.causes == ["started"]
    held = plant.snapshot.q_cmd
    plant.step(300)
    assert np.array_equal(plant.snapshot.q_cmd, held)
    plant.resume()
    run(plant)
    assert ear.causes == ["started", "done"] and np.abs(plant.snapshot.q - THERE).max() <= 1e-4


def test_the_override_slows_down_what_runs() -> None:
    lengths = []
    for override in (1.0, 0.3):
        plant = ready()
        plant.override = override
        plant.step(400)  # the override slews
        lengths.append(len(run(plant, MotionCommand(1, motions.ptp(THERE))).q))
    assert lengths[1] == pytest.approx(lengths[0] / 0.3, rel=0.1)


def test_a_stop_comes_to_rest_at_any_instant_and_within_its_time() -> None:
    random = np.random.default_rng(0)
    for _ in range(20):
        plant = ready()
        plant.submit(MotionCommand(1, motions.lin_rel((0.05, 0.25, 0.05, 0, 0, 0, 1), (0, 0, 0, 1))))
        plant.step(int(random.integers(1, 900)))
        plant.stop()
        for _ in range(700):
            plant.tick()
        assert plant.idle and at_rest(plant)
