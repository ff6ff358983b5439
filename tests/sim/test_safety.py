"""Stops of the safety controller: the arm keeps its path and its limits, brakes, and continues afterwards."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.model.kinematics import forward, jacobian
from heptarm.planning.seam import SLOTS, OperationMode, Ptp, SafetyFlags, StateWords
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.interpolator import REDUCED_SPEED
from heptarm.sim.controller.safety import SafetyController, StopRequest
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance
from tests.long import few, longer
from tests.sim import motions
from tests.sim.driving import READY, Ear, ready, run
from tests.sim.ideal import KINDS, LINE, begin, stopping_time

STOPS = (StopRequest.EMERGENCY_STOP, StopRequest.OPERATOR_SAFETY, StopRequest.PROTECTIVE_STOP)


def flags(plant: Plant) -> int:
    return int(plant.shared.ints[plant.tick_count % SLOTS, StateWords.FLAGS])


def to_standstill(plant: Plant, *, most: int = 1500) -> int:
    ticks = 0
    while np.abs(plant.snapshot.dq).max() > 1e-3 or not ticks:
        plant.tick()
        ticks += 1
        assert ticks < most
    return ticks


# ------------------------------------------------------------------------------- the controller by itself


def test_a_stop_is_latched_until_somebody_resumes() -> None:
    safety = SafetyController()
    assert not (safety.stop_requested or safety.latched)
    safety.request_stop(StopRequest.EMERGENCY_STOP)
    safety.resume()
    assert safety.stop_requested and safety.latched  # no resume while the button is pressed
    safety.withdraw(StopRequest.EMERGENCY_STOP)
    assert not safety.stop_requested and safety.latched
    safety.resume()
    assert not safety.latched


def test_the_enabling_switch_counts_in_t1_and_t2_only() -> None:
    safety = SafetyController()
    assert not safety.lacks_enabling
    safety.choose(OperationMode.T2)
    assert safety.stop_requested and safety.lacks_enabling
    safety.enable()
    assert not safety.stop_requested and safety.latched  # pressing it alone does not resume the motion
    safety.resume()
    safety.release()
    assert safety.stop_requested and safety.latched
    safety.choose(OperationMode.AUT)
    assert not safety.stop_requested and safety.latched


def test_two_requests_both_have_to_go() -> None:
    safety = SafetyController()
    safety.request_stop(StopRequest.EMERGENCY_STOP)
    safety.request_stop(StopRequest.OPERATOR_SAFETY)
    safety.withdraw(StopRequest.OPERATOR_SAFETY)
    assert safety.stop_requested
    safety.withdraw()
    assert not safety.stop_requested


# ---------------------------------------------------------------------------------- stops on the path


@pytest.mark.parametrize("asked", STOPS)
def test_a_stop_brakes_closes_the_brakes_and_the_motion_goes_on_afterwards(asked: StopRequest) -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, KINDS["ptp"].motion, listener=ear))
    plant.step(500)
    speed = np.abs(plant.snapshot.dq).max()
    plant.safety.request_stop(asked)
    ticks = to_standstill(plant)
    assert ticks * 1e-3 < speed / plant.robot.ddq_max.min() + 0.1
    plant.step(100)
    seen = flags(plant)
    assert seen & SafetyFlags.PROTECTIVE_STOP and seen & SafetyFlags.PAUSED
    assert not seen & (SafetyFlags.READY | SafetyFlags.BRAKES_OPEN)
    assert bool(seen & SafetyFlags.EMERGENCY_STOP) is (asked is StopRequest.EMERGENCY_STOP)
    assert bool(seen & SafetyFlags.SAFEGUARD_OPEN) is (asked is StopRequest.OPERATOR_SAFETY)
    assert ear.causes == ["started"]  # the motion waits
    plant.safety.withdraw(asked)
    plant.step(300)
    assert flags(plant) & (SafetyFlags.READY | SafetyFlags.PAUSED) == SafetyFlags.READY | SafetyFlags.PAUSED
    assert np.abs(plant.snapshot.dq).max() < 1e-3
    plant.resume()
    run(plant)
    assert ear.causes == ["started", "done"]
    motion = KINDS["ptp"].motion
    assert isinstance(motion, Ptp) and np.abs(plant.snapshot.q - motion.q).max() < 1e-4
    assert flags(plant) & SafetyFlags.BRAKES_OPEN


@pytest.mark.parametrize("at", few([250, 60, 500, 800], 2))
@pytest.mark.parametrize("kind", ["ptp", "lin", "batch"])
def test_a_stop_keeps_the_path(kind: str, at: int) -> None:
    travel = np.array([plant_q for plant_q in _free_run(kind)])
    plant = begin(kind)
    for _ in range(at):
        plant.tick()
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    places, accelerations = [], []
    for _ in range(400):
        plant.tick()
        places.append(plant.snapshot.q_cmd)
        accelerations.append(np.abs(plant.acceleration).max())
    plant.safety.withdraw()
    plant.resume()
    while not plant.idle:
        plant.tick()
        places.append(plant.snapshot.q_cmd)
    assert max(accelerations) < 1.1 * plant.robot.ddq_max.min()
    for place in places[::25]:
        assert _distance(travel, place) < 1e-5
    assert np.abs(places[-1] - travel[-1]).max() < 1e-9


def _free_run(kind: str) -> list[Array]:
    plant = begin(kind)
    seen = [plant.snapshot.q_cmd]
    while not plant.idle:
        plant.tick()
        seen.append(plant.snapshot.q_cmd)
    return seen


def _distance(travel: Array, place: Array) -> float:
    """Distance from a position to the polygon through the positions of a path [rad]."""
    here, step = travel[:-1], np.diff(travel, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-30)
    fraction = np.clip(((place - here) * step).sum(axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(here + fraction[:, None] * step - place, axis=1).min())


def test_brakes_hold_a_compliant_arm_against_a_push() -> None:
    plant = ready()
    plant.submit(MotionCommand(1, motions.hold(), mode=JointImpedance(50.0)))
    plant.step(100)
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    plant.step(500)
    before = plant.snapshot.q
    plant.apply_wrench((0.0, 60.0, 0.0))
    plant.step(500)
    state = plant.snapshot
    assert np.abs(state.q - before).max() < 5e-3 and np.abs(state.tau_cmd).max() == 0.0
    assert state.wrench[1] == pytest.approx(60.0, abs=1.0)  # and the sensors still measure it
    plant.apply_wrench((0.0, 0.0, 0.0))
    plant.safety.withdraw()
    plant.resume()
    plant.step(500)
    plant.apply_wrench((0.0, 60.0, 0.0))
    plant.step(500)
    assert np.abs(plant.snapshot.q - before).max() > 0.02  # compliant again
    plant.stop()


def test_what_waits_begins_after_the_stop_only() -> None:
    plant, ear = ready(), Ear()
    plant.safety.request_stop(StopRequest.OPERATOR_SAFETY)
    plant.submit(MotionCommand(1, motions.ptp((0.1, *READY[1:])), listener=ear))
    plant.step(200)
    assert ear.causes == []
    plant.safety.withdraw()
    plant.resume()
    run(plant)
    assert ear.causes == ["started", "done"]


def test_a_motion_can_be_cancelled_during_a_stop() -> None:
    plant, ear, next_ear = ready(), Ear(), Ear()
    plant.submit(MotionCommand(1, KINDS["ptp"].motion, listener=ear))
    plant.submit(MotionCommand(2, motions.ptp(READY), listener=next_ear))
    plant.step(400)
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    plant.step(40)
    plant.stop()
    plant.step(1200)
    assert plant.idle and ear.causes == ["started", "cancelled"] and next_ear.causes == ["cancelled"]
    plant.safety.withdraw()
    plant.resume()
    run(plant, MotionCommand(3, motions.ptp(READY), listener=(after := Ear())))
    assert after.causes == ["started", "done"]


# ----------------------------------------------------------------------------- drives, modes, overrides


def test_a_drive_error_fails_what_runs_and_has_to_be_acknowledged() -> None:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(1, KINDS["ptp"].motion, listener=ear))
    plant.step(400)
    plant.trip("drive error in A3")
    plant.step(1200)
    assert ear.heard[-1] == ("error", "drive error in A3") and plant.idle
    assert flags(plant) & SafetyFlags.DRIVE_ERROR and not flags(plant) & SafetyFlags.READY
    plant.resume()
    plant.step(2)
    assert flags(plant) & SafetyFlags.PAUSED
    plant.acknowledge()
    plant.resume()
    plant.step(2)
    assert flags(plant) & (SafetyFlags.READY | SafetyFlags.PAUSED) == SafetyFlags.READY
    run(plant, MotionCommand(2, motions.ptp(READY), listener=(after := Ear())))
    assert after.causes == ["started", "done"]


@pytest.mark.parametrize("kind", ["ptp", "lin", "servo"])
def test_t1_keeps_the_motion_frame_slow(kind: str) -> None:
    fastest, last = {}, {}
    for mode in (OperationMode.T1, OperationMode.T2):
        plant = begin(kind)
        plant.safety.choose(mode)
        plant.safety.enable()
        plant.resume()
        speeds = []
        for _ in range(6000):
            plant.tick()
            speeds.append(np.linalg.norm(jacobian(plant.robot, plant.snapshot.q_cmd)[:3] @ plant.speed))
            if plant.idle:
                break
        fastest[mode], last[mode] = max(speeds), plant.snapshot.q_cmd
    assert fastest[OperationMode.T1] <= 0.25 < fastest[OperationMode.T2]
    assert fastest[OperationMode.T1] > 0.8 * REDUCED_SPEED
    assert np.abs(last[OperationMode.T1] - last[OperationMode.T2]).max() < 1e-6


def test_letting_the_enabling_switch_go_pauses() -> None:
    plant, ear = ready(), Ear()
    plant.safety.choose(OperationMode.T2)
    plant.safety.enable()
    plant.resume()
    plant.submit(MotionCommand(1, motions.lin_rel(LINE, (0.0, 0.0, 0.0, 1.0)), listener=ear))
    plant.step(400)
    plant.safety.release()
    to_standstill(plant)
    begun = forward(plant.robot, plant.snapshot.q)
    plant.safety.enable()
    plant.step(200)
    assert np.abs(forward(plant.robot, plant.snapshot.q) - begun).max() < 1e-3
    plant.resume()
    run(plant)
    assert ear.causes == ["started", "done"]


def test_the_manual_override_slows_down_on_top_of_the_applications() -> None:
    durations = []
    for manual, override in ((1.0, 1.0), (0.5, 1.0), (0.5, 0.5)):
        plant = begin("ptp")
        plant.safety.manual, plant.override = manual, override
        ticks = 0
        while not plant.idle:
            plant.tick()
            ticks += 1
        durations.append(ticks)
    full, half, quarter = durations
    assert 1.5 < half / full < 2.3 and 1.6 < quarter / half < 2.3


# ---------------------------------------------------------------------- stops at any instant (line 19)


@pytest.mark.parametrize("how", ["path", "fast", "emergency"])
@pytest.mark.parametrize("kind", list(KINDS))
def test_a_stop_at_any_instant_ends_in_time(kind: str, how: str) -> None:
    random = np.random.default_rng(len(kind) * 10 + len(how))
    for instant in random.integers(1, 700, longer(3, 8)).tolist():  # the benchmark takes 200
        plant = begin(kind, seed=instant)
        for _ in range(instant):
            plant.tick()
        allowed = stopping_time(plant, how) + 0.02
        {"path": plant.stop, "fast": plant.stop_fast, "emergency": plant.press}[how]()
        steepest = ticks = 0.0
        while plant.is_under_way:
            plant.tick()
            ticks += 1
            steepest = max(steepest, float(np.abs(plant.acceleration).max()))
            assert ticks * 1e-3 <= allowed, f"instant {instant}: speed {np.abs(plant.speed).max():.3f} rad/s"
        # a direct servo motion changes its acceleration at once: there a tick may see both
        assert steepest <= plant.robot.ddq_max.min() * (2.0 if kind == "direct" else 1.06)


def test_brakes_close_without_a_jolt_under_a_load() -> None:
    plant = ready()
    plant.apply_wrench((60.0, 60.0, 25.0))
    plant.step(1000)
    plant.safety.request_stop(StopRequest.EMERGENCY_STOP)
    fastest = 0.0
    for _ in range(600):
        plant.tick()
        fastest = max(fastest, float(np.abs(plant.snapshot.dq).max()))
    assert not plant.snapshot.tau_cmd.any()  # they are closed
    assert fastest < 1e-3
