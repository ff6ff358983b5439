"""Faults during a motion end the motion, never the loop; external loads show in the state."""

from __future__ import annotations

import threading
import time
from math import inf, nan

import numpy as np
import pytest

from heptarm.errors import Unreachable
from heptarm.model.kinematics import jacobian
from heptarm.planning.jerk_profile import ProfileLimits, brake, change
from heptarm.planning.motion import PlanError
from heptarm.planning.path import CartesianPath
from heptarm.planning.plan import Plan
from heptarm.planning.planner import plan
from heptarm.sim.controller import queue as queue_module
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from tests.sim import motions
from tests.sim.driving import READY, Ear, ready, run

THERE = (0.8, 0.3, 0.1, -1.0, 0.2, 0.7, -0.2)
LINE = (0.05, 0.25, 0.05, 0.0, 0.0, 0.0, 1.0)
BASE = (0.0, 0.0, 0.0, 1.0)
REST = (0.0, 0.0, 0.0)


def test_an_order_right_after_a_stop_is_not_stopped() -> None:
    plant, first, second = ready(), Ear(), Ear()
    plant.submit(MotionCommand(1, motions.ptp(THERE), listener=first))
    plant.step(200)
    plant.stop()
    plant.submit(MotionCommand(2, motions.ptp(READY), listener=second))
    run(plant)
    assert first.causes == ["started", "cancelled"] and second.causes == ["started", "done"]


def test_a_profile_on_the_edge_between_two_kinds_is_found() -> None:
    for travel in (0.2, *np.linspace(1e-4, 3.0, 500)):
        profile = change(REST, 1.0, ProfileLimits(1.48 / travel, 10.0 / travel, 100.0 / travel))
        assert profile.at(profile.duration)[0] == pytest.approx(1.0, abs=1e-9)
        brake(profile.at(profile.duration / 3), ProfileLimits(1.48 / travel, 10.0 / travel, 100.0 / travel))


@pytest.mark.parametrize("travel", [4.7e-9, 1.2e-8, 1.9e-8, 1e-6, 1e-3])
def test_a_motion_of_next_to_no_length_can_be_braked_at_any_time(travel: float) -> None:
    limits = ProfileLimits(1.7 / travel, 10.0 / travel, 100.0 / travel)
    law = change(REST, 1.0, limits)
    for at in np.linspace(0.0, law.duration, 40):
        stop = brake(law.at(float(at)), limits)
        assert abs(stop.at(stop.duration)[1]) < 1e-3 * limits.velocity


@pytest.mark.parametrize("travel", [1e-9, 1e-6, 1e-3, 0.2])
def test_a_ptp_of_any_length_ends(travel: float) -> None:
    plant, ear = ready(), Ear()
    run(plant, MotionCommand(1, motions.ptp((travel, *READY[1:])), listener=ear))
    assert ear.causes == ["started", "done"]


@pytest.mark.parametrize(
    "order",
    [
        MotionCommand(1, motions.ptp(THERE, joint_velocity=(0.0,) * 7)),
        MotionCommand(1, motions.ptp(THERE, joint_jerk=(inf,) * 7)),
        MotionCommand(1, motions.ptp(THERE, joint_acceleration=(1.5,) * 7)),
        MotionCommand(1, motions.ptp((nan,) * 7)),
        MotionCommand(1, motions.ptp_pose((0.4, 0.0, 0.4, 0.0, 0.0, 0.0, 2.0))),
        MotionCommand(1, motions.ptp_pose((nan, 0.0, 0.4, 0.0, 1.0, 0.0, 0.0))),
        MotionCommand(1, motions.ptp_pose((0.4, 0.0, 0.4, 0.0, 1.0, 0.0, 0.0), redundancy=(0.0, 9, -1))),
        MotionCommand(1, motions.lin_rel(LINE, BASE, velocity=0.0)),
        MotionCommand(1, motions.lin_rel(LINE, BASE, orientation_jerk=inf)),
        MotionCommand(1, motions.lin_rel((0.0, nan, 0.0, 0.0, 0.0, 0.0, 1.0), BASE)),
    ],
)
def test_values_that_make_no_sense_are_refused_as_plans(order: MotionCommand) -> None:
    plant = ready()
    with pytest.raises(PlanError):
        plant.submit(order)
    plant.step(20)
    assert plant.idle


def test_pausing_and_resuming_keep_the_axes_limits() -> None:
    plant = ready()
    plant.submit(MotionCommand(1, motions.ptp((1.4, *READY[1:]))))
    seen = []
    for tick in range(2000):
        if tick in (300, 450, 900):
            (plant.resume if tick == 450 else plant.pause)()
        if tick == 1200:
            plant.resume()
        plant.tick()
        seen.append(plant.snapshot.q_cmd)
    acceleration = np.diff(seen, 2, axis=0) * 1e6
    assert (np.abs(acceleration) <= plant.robot.ddq_max * 1.01).all()
    assert (np.abs(np.diff(acceleration, axis=0)) * 1e3 <= plant.robot.dddq_max * 2.0).all()


def test_cancelling_while_the_override_changes_does_not_jump() -> None:
    plant = ready()
    plant.submit(MotionCommand(1, motions.ptp((1.4, *READY[1:]))))
    seen = []
    for tick in range(1200):
        if tick == 300:
            plant.pause()
        if tick == 400:
            plant.cancel(1)
        plant.tick()
        seen.append(plant.snapshot.q_cmd)
    jerk = np.diff(seen, 3, axis=0) * 1e9
    assert plant.idle and (np.abs(jerk) <= plant.robot.dddq_max * 2.5).all()


@pytest.mark.parametrize("override", [-1.0, 7.0, nan])
def test_an_override_out_of_range_does_no_harm(override: float) -> None:
    plant = ready()
    plant.submit(MotionCommand(1, motions.ptp(THERE)))
    plant.step(100)
    plant.override = override
    before = plant.snapshot.q_cmd
    plant.step(300)
    assert (np.abs(plant.snapshot.dq) <= plant.robot.dq_max * 1.01).all()
    assert plant.snapshot.q_cmd[0] >= before[0]


@pytest.mark.parametrize("how", ["jump", "lost"])
def test_a_path_that_fails_under_way_brakes_the_axes_and_reports_why(
    how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, motions.lin_rel(LINE, BASE), listener=ear))
    sound = CartesianPath.at

    def broken(self: CartesianPath, s: float, near: Array) -> Array:
        if s > 0.5 and how == "lost":
            raise Unreachable("too far")
        return sound(self, s, near) + (0.5 if s > 0.5 else 0.0)

    monkeypatch.setattr(CartesianPath, "at", broken)
    track = run(plant)
    assert ear.causes == ["started", "error"]
    assert ("too far" if how == "lost" else "violates limit") in ear.heard[-1][1]
    assert (np.abs(np.diff(track.q_cmd, axis=0)) * 1e3 <= plant.robot.dq_max).all()
    assert np.abs(plant.snapshot.dq).max() < 2e-3
    run(plant, MotionCommand(2, motions.ptp(READY), listener=(after := Ear())))
    assert after.causes == ["started", "done"]


def test_the_tick_does_not_wait_for_a_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, motions.ptp((0.05, *READY[1:])), listener=ear))
    planning, go_on = threading.Event(), threading.Event()

    def slow(*arguments: object, **tcp: object) -> Plan:
        planning.set()
        assert go_on.wait(60)
        return plan(*arguments, **tcp)  # type: ignore[arg-type]

    monkeypatch.setattr(queue_module, "plan", slow)
    other = threading.Thread(target=plant.submit, args=(MotionCommand(2, motions.ptp(READY)),))
    other.start()
    assert planning.wait(60)
    began = time.monotonic()
    plant.step(1500)  # the first order ends while the second is being planned
    assert ear.causes == ["started", "done"] and time.monotonic() - began < 50
    go_on.set()
    other.join()
    run(plant)
    assert np.abs(plant.snapshot.q - READY).max() <= 1e-4


def test_what_pulls_at_a_body_shows_as_well() -> None:
    plant = ready()
    force = np.array((5.0, -12.0, 8.0))
    link = plant.model.body("link_7").id
    plant.data.xfrc_applied[link, :3] = force
    plant.step(600)
    state = plant.snapshot
    assert state.wrench[:3] == pytest.approx(force, abs=0.3)
    at_flange = jacobian(plant.robot, state.q).T @ state.wrench
    assert state.tau_ext == pytest.approx(at_flange, abs=0.05)


def test_the_model_of_both_robots_is_free_of_contacts_at_its_stops() -> None:
    for model in ("iiwa7", "iiwa14"):
        for axis in (0, 2, 3, 4, 5, 6):
            for sign in (-1.0, 1.0):
                q = np.zeros(7)
                q[axis] = sign * Plant(model).robot.q_max[axis]
                plant = Plant(model, q=tuple(q))
                assert plant.data.ncon == 0, (model, axis, sign)
