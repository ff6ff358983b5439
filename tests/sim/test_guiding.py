"""Hand guiding on the plant: the arm is compliant while the switch is held, within its limits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from heptarm.model.kinematics import jacobian
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.safety import StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.motion.hand_guiding import HandGuide, hand_guide
from tests.long import few
from tests.sim import motions
from tests.sim.driving import Ear, ready, run

NAN = np.nan
SIDEWAYS = (0.0, 60.0, 0.0)
#: Bounds that are hardly felt.
QUICK: dict[str, Any] = {"joint_velocity": 2.0, "cartesian_velocity": 2.0}


def begun(guide: HandGuide | None = None, *, model: str = "iiwa14") -> tuple[Plant, Ear]:
    """An arm that is guided by hand."""
    plant, ear = ready(model), Ear()
    plant.submit(MotionCommand(1, motions.guide(guide or hand_guide()), listener=ear))
    plant.safety.guide()
    plant.step(50)
    return plant, ear


def push_along(plant: Plant, force: tuple[float, ...], seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Push for a time; positions and speeds of every tick, shape (n, 7)."""
    plant.apply_wrench(force)
    q, dq = [], []
    for _ in range(round(seconds * 1000)):
        plant.tick()
        state = plant.snapshot
        q.append(state.q)
        dq.append(state.dq)
    plant.apply_wrench((0, 0, 0))
    return np.array(q), np.array(dq)


def finish(plant: Plant) -> None:
    plant.safety.let_go()
    for _ in range(3000):
        plant.tick()
        if plant.idle:
            return
    raise AssertionError("it does not end")


def one(axis: int, value: float) -> list[float]:
    return [value if i == axis else NAN for i in range(7)]


def test_it_waits_until_the_switch_is_held_and_does_not_sink() -> None:
    plant, ear = ready(), Ear()
    start = plant.snapshot.q
    plant.submit(MotionCommand(1, motions.guide(hand_guide()), listener=ear))
    plant.step(100)
    plant.apply_wrench(SIDEWAYS)
    plant.step(300)
    assert np.abs(plant.snapshot.q - start).max() < 0.01 and not plant.idle
    plant.apply_wrench((0, 0, 0))
    plant.step(300)
    plant.safety.guide()
    plant.step(1000)
    assert np.abs(plant.snapshot.q - start).max() < 1e-3
    assert ear.causes == ["started"]


def test_a_hand_moves_it_and_it_stays_where_it_was_led() -> None:
    plant, ear = begun()
    start = plant.snapshot.q
    q, _ = push_along(plant, (0.0, 12.0, 0.0), 1.0)
    assert np.abs(q[-1] - start).max() > 0.1
    assert np.abs(plant.snapshot.q_cmd - plant.snapshot.q).max() < 2e-3
    finish(plant)
    rest = plant.snapshot.q
    plant.apply_wrench((0.0, 12.0, 0.0))
    plant.step(500)
    assert np.abs(plant.snapshot.q - rest).max() < 0.01
    assert ear.causes == ["started", "done"]


def test_light_hands_are_enough_on_both_arms() -> None:
    for model in ("iiwa7", "iiwa14"):
        plant, _ = begun(model=model)
        start = plant.snapshot.q
        push_along(plant, (0.0, 0.0, 5.0), 0.3)
        assert np.abs(plant.snapshot.q - start).max() > 0.01


@pytest.mark.parametrize("force", few([(0.0, 0.0, -100.0), (0.0, 0.0, 100.0), (80.0, 80.0, 0.0)]))
def test_no_axis_leaves_its_own_limits(force: tuple[float, ...]) -> None:
    plant, ear = begun()
    q, _ = push_along(plant, force, 2.0)
    assert (q > plant.robot.q_min).all() and (q < plant.robot.q_max).all()
    plant.apply_wrench(force)  # a person continues to push
    finish(plant)
    assert ear.causes[-1] == "done"


def test_a_limit_holds_one_axis_and_leaves_the_others_free() -> None:
    plant, _ = begun(hand_guide(q_max=one(0, 0.2), **QUICK))
    q, dq = push_along(plant, SIDEWAYS, 1.5)
    assert 0.15 < q[-1, 0] < 0.2 and q[:, 0].max() < 0.2
    assert abs(dq[-1, 0]) < 0.02
    assert np.abs(q[-1, 1:] - q[700, 1:]).max() > 0.1
    back, _ = push_along(plant, (0.0, -20.0, 0.0), 1.0)
    assert back[-1, 0] < q[-1, 0] - 0.02


def test_a_limit_can_hold_all_axes_until_the_switch_is_let_go() -> None:
    plant, ear = begun(hand_guide(q_max=one(0, 0.2), at_limit="all", **QUICK))
    q, _ = push_along(plant, SIDEWAYS, 2.0)
    assert q[:, 0].max() < 0.2
    assert np.abs(q[-1] - q[-500]).max() < 2e-3
    assert not plant.idle
    finish(plant)
    assert ear.causes == ["started", "done"]


def test_beyond_its_limit_an_axis_is_free_to_return_or_pulled_back() -> None:
    plant, _ = begun(hand_guide(q_max=one(1, 0.3)))  # A2 is at 0.5
    out, _ = push_along(plant, (40.0, 0.0, -40.0), 0.5)
    assert out[:, 1].max() < 0.52
    plant, _ = begun(hand_guide(q_max=one(1, 0.3), outside="pull"))
    plant.step(1500)
    assert 0.2 < plant.snapshot.q[1] < 0.3


def test_speed_limits() -> None:
    plant, _ = begun(hand_guide(joint_velocity=0.3))
    _, dq = push_along(plant, SIDEWAYS, 1.0)
    assert 0.2 < np.abs(dq).max() < 0.45
    plant, _ = begun(hand_guide(cartesian_velocity=0.1))
    q, dq = push_along(plant, (0.0, 0.0, 40.0), 1.0)
    speeds = [
        np.linalg.norm(jacobian(plant.robot, a)[:3] @ b) for a, b in zip(q[::20], dq[::20], strict=True)
    ]
    assert 0.05 < max(speeds) < 0.15


def speeds(plant: Plant, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Speeds of the flange [m/s]."""
    steps = zip(q[::20], dq[::20], strict=True)
    return np.array([np.linalg.norm(jacobian(plant.robot, a)[:3] @ b) for a, b in steps])


@pytest.mark.parametrize(
    "force", few([(30.0, 30.0, 0.0), (15.0, 0.0, 0.0), (0.0, 15.0, 0.0), (0.0, 0.0, 15.0)])
)
def test_without_limits_of_its_own_it_is_bounded(force: tuple[float, ...]) -> None:
    plant, ear = begun()
    q, dq = push_along(plant, force, 2.0)
    assert 0.1 < speeds(plant, q, dq).max() <= 0.25
    assert (np.abs(dq) <= 0.52 * plant.robot.dq_max).all()
    finish(plant)
    assert ear.causes == ["started", "done"]


@pytest.mark.parametrize(
    "force", few([(60.0, 60.0, 0.0), (15.0, 0.0, 0.0), (0.0, 15.0, 0.0), (0.0, 0.0, 60.0)])
)
def test_floating_joints_are_damped_and_bounded(force: tuple[float, ...]) -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, motions.hold(10.0), mode=JointImpedance(0.0, damping=0.0), listener=ear))
    plant.step(50)
    q, dq = push_along(plant, force, 2.0)
    fastest = np.abs(dq)
    assert fastest.max() > 0.1 and (fastest <= 0.52 * plant.robot.dq_max).all()
    assert speeds(plant, q, dq).max() <= 0.26
    plant.step(1000)
    assert np.abs(plant.snapshot.dq).max() < 1e-2, "it comes to rest where it is left"
    assert ear.causes == ["started"]


def test_reduced_speed_in_t1() -> None:
    plant, ear = ready(), Ear()
    plant.safety.choose(plant.safety.mode.T1)
    plant.safety.guide()
    plant.resume()
    plant.submit(MotionCommand(1, motions.guide(hand_guide()), listener=ear))
    plant.step(50)
    q, dq = push_along(plant, (0.0, 0.0, 40.0), 1.0)
    speeds = [
        np.linalg.norm(jacobian(plant.robot, a)[:3] @ b) for a, b in zip(q[::20], dq[::20], strict=True)
    ]
    assert 0.15 < max(speeds) < 0.3
    plant.safety.let_go()  # in T1 that is a stop, too
    plant.step(500)
    assert ear.causes == ["started", "done"] and plant.safety.latched


@pytest.mark.parametrize("fast", [False, True])
def test_cancelling_brakes_it(fast: bool) -> None:
    plant, ear = begun()
    push_along(plant, SIDEWAYS, 0.3)
    (plant.stop_fast if fast else plant.stop)()
    plant.step(600)
    assert ear.causes == ["started", "cancelled"]
    assert np.abs(plant.snapshot.dq).max() < 1e-3


def test_a_pause_holds_it_and_then_it_goes_on() -> None:
    plant, ear = begun()
    push_along(plant, SIDEWAYS, 0.3)
    plant.pause()
    plant.step(500)
    there = plant.snapshot.q
    q, _ = push_along(plant, SIDEWAYS, 0.3)
    assert np.abs(q - there).max() < 0.01
    plant.resume()
    plant.step(300)
    push_along(plant, SIDEWAYS, 0.3)
    assert np.abs(plant.snapshot.q - there).max() > 0.05
    finish(plant)
    assert ear.causes == ["started", "done"]


def test_errors_end_it_at_rest() -> None:
    plant, ear = begun()
    push_along(plant, SIDEWAYS, 0.3)
    plant.abort(0, "Command Position violates limit A1")
    plant.step(600)
    assert ear.heard[-1] == ("error", "Command Position violates limit A1")
    assert np.abs(plant.snapshot.dq).max() < 1e-3


def test_what_comes_behind_it_begins_where_it_was_led_to() -> None:
    plant, ear = begun()
    after = Ear()
    plant.submit(MotionCommand(2, motions.ptp((0.0, 0.5, 0.0, -1.3, 0.0, 0.9, 0.0)), listener=after))
    push_along(plant, SIDEWAYS, 0.5)
    plant.safety.let_go()
    track = run(plant)
    assert np.abs(np.diff(track.q_cmd, axis=0)).max() < 3e-3
    assert ear.causes[-1] == "done" and after.causes == ["started", "done"]
    assert np.abs(plant.snapshot.q - [0.0, 0.5, 0.0, -1.3, 0.0, 0.9, 0.0]).max() < 1e-3


def test_cancelling_while_a_stop_brakes_it_brakes_it_no_other_way() -> None:
    paths = []
    for cancels in (False, True):
        plant, _ = begun()
        plant.apply_wrench(SIDEWAYS)
        plant.step(400)
        plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
        plant.step(5)
        if cancels:
            plant.stop()
        travel = []
        for _ in range(300):
            plant.tick()
            travel.append(plant.snapshot.q)
        paths.append(np.array(travel))
    assert np.abs(paths[0] - paths[1]).max() < 1e-9
