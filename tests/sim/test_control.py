"""Cartesian impedance on the plant: compliance as ordered, limits stop the motion, modes change smoothly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose
from tests.long import few
from tests.sim import motions
from tests.sim.driving import READY, Ear, numbers, ready

HERE = np.array(READY)
NAN = math.nan
KINDS: dict[str, Any] = {"hold": motions.hold(), "servo": motions.servo(), "direct": motions.direct()}
COMPLIANT = CartesianImpedance((500.0, 500.0, 500.0, 100.0, 100.0, 100.0), frame="base")


def holding(mode: Any, *, duration: float = NAN, **terms: Any) -> tuple[Plant, Ear]:
    plant, ear = ready(), Ear()
    plant.submit(MotionCommand(7, motions.hold(duration), mode=mode, listener=ear, **terms))
    plant.step(2)
    return plant, ear


def to_rest(plant: Plant, *, most: int = 5000) -> int:
    ticks = 0
    while not plant.idle:
        plant.tick()
        ticks += 1
        assert ticks < most
    return ticks


def tip(plant: Plant, *, commanded: bool = False) -> Pose:
    state = plant.snapshot
    return Pose.from_matrix(forward(plant.robot, state.q_cmd if commanded else state.q))


def deviated(plant: Plant) -> Any:
    return tip(plant).xyz - tip(plant, commanded=True).xyz


@pytest.mark.parametrize("kind", few(["hold", "servo", "direct"], 2))
def test_a_push_moves_the_hand_by_force_over_stiffness(kind: str) -> None:
    plant = ready()
    plant.submit(MotionCommand(7, KINDS[kind], mode=COMPLIANT))
    plant.apply_wrench((10.0, -15.0, 20.0))
    plant.step(1500)
    assert deviated(plant) == pytest.approx(np.array([10.0, -15.0, 20.0]) / 500.0, rel=0.02)


def test_the_motion_frame_complies_not_the_flange() -> None:
    tool = Pose.at(z=0.3)
    turning = CartesianImpedance((5000, 5000, 5000, 30, 300, 300))
    plant, _ = holding(turning, tcp=numbers(tool))
    before = tip(plant) @ tool
    plant.apply_wrench((0, 0, 0), tuple(before.rotation @ (3.0, 0.0, 0.0)))  # about x of the motion frame
    plant.step(1500)
    moved = before.inverse() @ (tip(plant) @ tool)
    assert 2 * moved.quat[0] == pytest.approx(3.0 / 30.0, rel=0.02)
    assert np.abs(moved.xyz).max() < 1.5e-3, "the tool's tip stays, so the flange swings"
    assert np.abs((before.inverse() @ (tip(plant) @ tool @ Pose.at(z=-0.3))).xyz[1]) > 0.02


def test_the_axes_of_a_named_frame_come_with_the_order() -> None:
    turn = Pose.xyz_abc(a=0.6)
    table = CartesianImpedance((4000, 300, 4000, 300, 300, 300), frame="table")
    plant, _ = holding(table, axes=tuple(turn.quat.tolist()))
    plant.apply_wrench(tuple(turn.rotation @ (0.0, 9.0, 0.0)))
    plant.step(1500)
    assert turn.rotation.T @ deviated(plant) == pytest.approx([0.0, 0.03, 0.0], abs=8e-4)


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ({"max_deviation": [0.02] * 3 + [NAN] * 3}, "Maximum path deviation exceeded"),
        ({"max_velocity": [0.1] * 3 + [NAN] * 3}, "Maximum Cartesian velocity exceeded"),
        ({"max_force": [25.0] * 3 + [NAN] * 3, "max_force_stops": True}, "Maximum control force exceeded"),
    ],
)
@pytest.mark.parametrize("kind", few(["servo", "hold"]))
def test_an_exceeded_limit_stops_the_arm_and_the_order_reports_which(
    kind: str, limits: dict[str, Any], text: str
) -> None:
    plant, ear = ready(), Ear()
    plant.submit(
        MotionCommand(7, KINDS[kind], mode=CartesianImpedance(COMPLIANT.stiffness, **limits), listener=ear)
    )
    plant.apply_wrench((0.0, 5.0, 0.0))
    plant.step(800)
    assert ear.causes == ["started"], "a smaller push does not"
    plant.apply_wrench((0.0, 60.0, 0.0))
    speeds = [float(np.abs(plant.snapshot.dq).max()) for _ in range(300) if plant.step(1) is None]
    assert np.abs(np.diff(speeds)).max() < 0.05, "it is not torn to a halt"
    ticks = to_rest(plant, most=400)
    assert ear.causes == ["started", "error"] and text in ear.heard[-1][1]
    caught = tip(plant).xyz
    plant.step(500)
    assert np.abs(tip(plant).xyz - caught).max() < 1e-3, "it is stiff now, though it is still pushed"
    assert np.abs(plant.snapshot.dq).max() < 1e-3
    assert ticks < 600
    plant.submit(MotionCommand(8, motions.ptp(READY), listener=ear))
    to_rest(plant)
    assert ear.causes[-1] == "done"


def test_a_motion_waits_for_a_pattern_that_shall_not_be_cut_off() -> None:
    wave = SineImpedance.sine("y", frequency=4.0, amplitude=10.0, base=COMPLIANT)
    for stays, most in ((False, 700), (True, 1400)):
        mode = wave.timed(total_time=0.8, stay_active=stays)
        plant, ear = holding(mode, duration=0.1)
        ticks = to_rest(plant)
        assert (ticks >= 798) == stays and ticks < most
        assert ear.causes == ["started", "done"]


def test_a_cancel_does_not_wait_for_a_pattern() -> None:
    wave = SineImpedance.sine("y", frequency=4.0, amplitude=10.0, base=COMPLIANT)
    plant, ear = holding(wave.timed(total_time=60.0, stay_active=True))
    plant.step(300)
    plant.cancel(7)
    assert to_rest(plant) < 600
    assert ear.causes == ["started", "cancelled"]


def test_an_overlaid_force_swings_the_hand_as_far_as_the_dynamics_let_it() -> None:
    wave = SineImpedance.sine("y", frequency=0.25, amplitude=10.0, base=COMPLIANT)
    plant, _ = holding(wave)
    travel = []
    for _ in range(600):
        plant.step(10)
        travel.append(deviated(plant)[1])
    seen = np.array(travel[200:])  # one whole turn, slow enough for the hand to follow the force
    assert seen.max() == pytest.approx(10.0 / 500.0, rel=0.05)
    assert seen.min() == pytest.approx(-10.0 / 500.0, rel=0.05)


def test_parameters_change_while_a_servo_motion_runs_and_the_kind_does_not() -> None:
    plant = ready()
    plant.submit(MotionCommand(7, motions.servo(), mode=COMPLIANT))
    plant.apply_wrench((0.0, 10.0, 0.0))
    plant.step(1200)
    assert deviated(plant)[1] == pytest.approx(0.02, rel=0.02)
    plant.change_mode(7, CartesianImpedance((250.0,) * 3 + (100.0,) * 3, frame="base"))
    plant.step(1500)
    assert deviated(plant)[1] == pytest.approx(0.04, rel=0.02)
    plant.change_mode(7, JointImpedance(4000.0))
    plant.change_mode(6, COMPLIANT)
    plant.step(500)
    assert deviated(plant)[1] == pytest.approx(0.04, rel=0.02)


@pytest.mark.parametrize(
    "then",
    [
        CartesianImpedance((800.0,) * 3 + (100.0,) * 3, frame="base"),
        CartesianImpedance((800.0,) * 3 + (100.0,) * 3),
        JointImpedance(1500.0),
        None,
    ],
    ids=["another stiffness", "another frame", "joints", "stiff"],
)
def test_modes_follow_each_other_without_a_blow(then: Any) -> None:
    plant, ear = ready(), Ear()
    plant.apply_wrench((0.0, 10.0, 0.0))
    plant.submit(MotionCommand(1, motions.hold(1.0), mode=COMPLIANT))
    slowly = (0.2,) * 7
    plant.submit(
        MotionCommand(2, motions.ptp(tuple(HERE + 0.1), joint_velocity=slowly), mode=then, listener=ear)
    )
    fastest = 0.0
    while not plant.idle:
        plant.tick()
        fastest = max(fastest, float((np.abs(plant.snapshot.dq) / plant.robot.dq_max).max()))
    assert ear.causes == ["started", "done"]
    assert fastest < 0.4
    plant.step(500)
    assert np.abs(plant.snapshot.dq).max() < 1e-3
