"""Cartesian impedance on a bare arm: compliant with the commanded stiffness, and stable."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError
from heptarm.model.kinematics import jacobian
from heptarm.values.checks import Array
from heptarm.values.frames import BASE
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.long import few, longer
from tests.sim.compliant import ASKEW, DOWN, Arm

STIFFNESS = (1000.0, 2000.0, 500.0, 100.0, 200.0, 50.0)
PUSH = (20.0, 20.0, 20.0, 2.0, 2.0, 2.0)
HAND = Pose.xyz_abc(0.05, 0.02, 0.15, 0.3, 0.2, 0.1)
NAN = math.nan


def along(index: int, size: float) -> Any:
    """Six numbers, one of them not zero."""
    result = np.zeros(6)
    result[index] = size
    return result


def turned(rotation: Any, wrench: Any) -> Any:
    """A wrench in base axes."""
    return np.concatenate([rotation @ wrench[:3], rotation @ wrench[3:]])


# ------------------------------------------------------------------------------------------- at rest


@pytest.mark.parametrize("index", few((2, 4, 0, 1, 3, 5), 2))
@pytest.mark.parametrize(("model", "tcp"), [("iiwa14", HAND), *longer([], [("iiwa7", Pose.at())])])
def test_a_push_moves_the_hand_by_force_over_stiffness(index: int, model: str, tcp: Pose) -> None:
    arm = Arm(CartesianImpedance(STIFFNESS), tcp=tcp, model=model)
    wanted = arm.wanted
    arm.push = turned(wanted.rotation, along(index, PUSH[index]))
    arm.step(1.2)
    deviated = along(index, PUSH[index] / STIFFNESS[index])
    assert arm.law.deviation == pytest.approx(deviated, abs=0.02 * abs(deviated[index]))
    moved = wanted.inverse() @ arm.pose  # by the kinematics of the arm, not the model of the law
    measured = np.concatenate([moved.xyz, 2.0 * moved.quat[:3]])
    assert measured[index] == pytest.approx(deviated[index], rel=0.02)
    arm.push = np.zeros(6)
    arm.step(1.0)
    assert arm.law.deviation == pytest.approx(np.zeros(6), abs=2e-4), "it comes back"


@pytest.mark.parametrize("frame", [BASE, "table"])
def test_the_frame_reports_whose_axes_the_directions_are(frame: str) -> None:
    axes = np.eye(3) if frame == BASE else Pose.xyz_abc(a=0.7, b=0.4).rotation
    mode = CartesianImpedance((4000, 4000, 500, 200, 200, 200), frame=frame)
    arm = Arm(mode, axes=None if frame == BASE else axes)
    arm.push = turned(axes, along(2, 20.0))
    arm.step(1.2)
    moved = axes.T @ (arm.pose.xyz - arm.wanted.xyz)
    assert moved == pytest.approx([0.0, 0.0, 0.04], abs=8e-4)


def test_a_frame_whose_axes_nobody_gives_is_refused() -> None:
    with pytest.raises(CommandRejected, match="given with its axes, got 'table'"):
        Arm(CartesianImpedance(frame="table"))


def test_it_begins_without_a_jerk() -> None:
    arm = Arm(CartesianImpedance(additional_force=along(2, 50.0)))
    arm.tick()
    holding = arm.data.qfrc_bias[:7]
    assert arm.torque == pytest.approx(holding, abs=2.0), "gravity and hardly more"
    fastest = 0.0
    for _ in range(50):
        arm.tick()
        fastest = max(fastest, float(np.abs(arm.data.qacc[:7]).max()))
    assert fastest < 40.0
    arm.step(1.2)
    assert arm.law.deviation == pytest.approx(along(2, 50.0 / 2000.0), abs=5e-4)


def test_a_direction_without_stiffness_can_be_led_and_stays_where_it_is_left() -> None:
    arm = Arm(CartesianImpedance((0.0, 2000.0, 2000.0, 200.0, 200.0, 200.0)))
    arm.push = turned(arm.wanted.rotation, along(0, 5.0))
    arm.step(1.0)
    led = arm.law.deviation[0]
    assert led > 0.02
    arm.push = np.zeros(6)
    arm.step(4.0)
    left = arm.law.deviation[0]
    arm.step(1.0)
    assert arm.law.deviation[0] == pytest.approx(left, abs=5e-4), "it does not drift on"
    assert arm.law.deviation[1:] == pytest.approx(np.zeros(5), abs=2e-3)


FREE = {
    "all": compliance("xyzabc"),
    "along": compliance("xyz", frame="base"),
    "raw": CartesianImpedance(0.0, damping=0.1, nullspace_stiffness=0.0),
}


def guided(
    mode: CartesianImpedance, push: tuple[float, ...], *, overlaid: bool = False
) -> tuple[Arm, Array, Array]:
    """Push for 2 s; the arm, speeds of the hand [m/s] and of the joints as fractions of their maxima."""
    arm = Arm(mode, tcp=HAND)
    arm.sensed.is_overlaid = overlaid
    arm.push = np.array([*push, 0.0, 0.0, 0.0])
    hand, fractions = [], []
    for _ in range(2000):
        arm.tick()
        hand.append(np.linalg.norm(arm.law.velocity[:3]))
        fractions.append(np.abs(arm.data.qvel[:7]) / arm.robot.dq_max)
    return arm, np.array(hand), np.array(fractions)


@pytest.mark.parametrize(
    "push", few([(0.0, 15.0, 0.0), (0.0, 0.0, 15.0), (15.0, 0.0, 0.0), (-15.0, 0.0, 0.0)])
)
@pytest.mark.parametrize("mode", FREE.values(), ids=FREE)
def test_guiding_is_damped_and_bounded(mode: CartesianImpedance, push: tuple[float, ...]) -> None:
    arm, hand, fractions = guided(mode, push)
    assert 0.05 < hand.max() <= 0.25 and fractions.max() <= 0.5
    arm.push = np.zeros(6)
    arm.step(3.0)
    assert arm.quick < 2e-2, "it comes to rest where it is left"
    assert arm.law.violation == ""


def test_a_hard_push_is_braked_at_the_bound() -> None:
    _, hand, fractions = guided(FREE["all"], (0.0, 0.0, 60.0))
    assert 0.2 < hand.max() <= 0.27 and fractions.max() <= 0.5


def test_the_bound_of_guiding_is_adjustable() -> None:
    push = (20.0, 40.0, 0.0)
    slow, hand, _ = guided(compliance("xyzabc", speed=0.1, turning_speed=0.3), push)
    assert hand.max() < 0.125 and slow.law.violation == ""  # it would stop a quarter above the bound
    _, quick, _ = guided(compliance("xyzabc", speed=0.6, turning_speed=4.0), push)
    assert 0.3 < quick.max() <= 0.6
    with pytest.raises(LimitError, match="speed must be in"):
        compliance("x", speed=0.0)


def test_under_an_overlay_of_a_client_the_guard_bounds_the_speed() -> None:
    _, hand, _ = guided(FREE["all"], (15.0, 15.0, 0.0), overlaid=True)
    assert hand.max() > 0.3


# ------------------------------------------------------------------------------------------- in motion


@pytest.mark.parametrize("index", few(range(6), 2))
@pytest.mark.parametrize("damping", [0.1, 0.7])
def test_it_swings_as_its_damping_ratio_reports(damping: float, index: int) -> None:
    arm = Arm(CartesianImpedance(STIFFNESS, damping=damping), tcp=HAND)
    arm.tick()
    # along one direction Λ couples to the others; along a mode of K and Λ the arm is a single oscillator
    turn, j = arm.wanted.rotation.T, jacobian(arm.robot, ASKEW, arm.wanted.xyz)
    j = np.vstack([turn @ j[:3], turn @ j[3:]])
    root = np.sqrt(STIFFNESS)
    ease = np.linalg.solve(arm.sensed.mass, j.T)
    squares, modes = np.linalg.eigh(root[:, None] * (j @ ease) * root)
    mode = modes[:, index] / root
    mode *= 0.02 / np.abs(mode / (1, 1, 1, 5, 5, 5)).max()  # 2 cm or 0.1 rad at most
    arm.data.qpos[:7] = ASKEW + ease @ np.linalg.solve(j @ ease, mode)
    arm.data.qvel[:] = 0.0
    period = 2 * math.pi / math.sqrt(squares[index] * (1.0 - damping**2))
    swing = [modes[:, index] @ (root * deviation) for deviation in arm.step(0.6 * period)]
    assert swing[0] > 0.0
    overshoot = math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
    assert -min(swing) / swing[0] == pytest.approx(overshoot, abs=0.04)
    assert int(np.argmin(swing)) * 1e-3 == pytest.approx(period / 2, rel=0.1)


def test_each_direction_may_be_damped_otherwise() -> None:
    overshoot = []
    for damping in (0.1, 0.9):
        arm = Arm(
            CartesianImpedance((1000,) * 3 + (200,) * 3, damping=(0.9, 0.9, damping, 0.9, 0.9, 0.9)), q=DOWN
        )
        arm.push = turned(arm.wanted.rotation, along(2, 20.0))
        arm.step(1.5)
        arm.push = np.zeros(6)
        overshoot.append(-min(d[2] for d in arm.step(1.0)) / 0.02)
    assert overshoot[0] > 0.5
    assert overshoot[1] < 0.05


def test_it_follows_a_moving_set_point() -> None:
    far = np.array(ASKEW) + (0.4, -0.2, 0.3, 0.5, -0.4, 0.3, 0.6)

    def travel(time: float) -> Any:
        x = min(1.0, max(0.0, time / 1.5))
        return np.array(ASKEW) + (10 * x**3 - 15 * x**4 + 6 * x**5) * (far - ASKEW)

    arm = Arm(CartesianImpedance(), tcp=HAND)
    arm.step(0.01)
    seen = np.abs(arm.step(2.0, travel))
    assert seen[:, :3].max() < 1e-3
    assert seen[:, 3:].max() < 5e-3
    assert arm.data.qpos[:7] == pytest.approx(far, abs=2e-3), "the elbow as well"


def test_the_elbow_complies_like_a_spring_of_its_own_and_the_hand_stays() -> None:
    arm = Arm(CartesianImpedance(nullspace_stiffness=50.0), tcp=HAND)
    j = jacobian(arm.robot, ASKEW, arm.wanted.xyz)
    travel = np.linalg.svd(j)[2][6]  # moves the elbow and not the hand; norm 1
    arm.step(0.002)
    arm.data.qfrc_applied[:7] = 0.0
    push = arm.sensed.mass @ travel
    push *= 5.0 / float(travel @ push)  # 5 Nm along the motion of the elbow
    original = arm.law.torque

    def pushed(sensed: Any) -> Any:
        return original(sensed) + push

    arm.law.torque = pushed  # type: ignore[method-assign]
    arm.step(1.5)
    assert travel @ (arm.data.qpos[:7] - ASKEW) == pytest.approx(5.0 / 50.0, rel=0.05)
    assert np.abs(arm.law.deviation[:3]).max() < 1e-3
    arm.law.torque = original  # type: ignore[method-assign]
    seen = np.abs(arm.step(1.5))
    assert arm.data.qpos[:7] == pytest.approx(ASKEW, abs=2e-3)
    assert seen[:, :3].max() < 2e-3, "the hand hardly moves while the elbow returns"


def test_stiffness_changes_under_load_without_a_blow() -> None:
    compliant_mode = CartesianImpedance((300.0,) * 3 + (100.0,) * 3)
    arm = Arm(compliant_mode)
    arm.push = turned(arm.wanted.rotation, along(2, -15.0))
    arm.step(1.5)
    assert arm.law.deviation[2] == pytest.approx(-0.05, rel=0.02)
    before = arm.torque
    arm.law.change(replace(compliant_mode, stiffness=(3000.0,) * 3 + (100.0,) * 3))  # type: ignore[arg-type]
    for _ in range(100):
        arm.tick()
        assert np.abs(arm.torque - before).max() < 12.0
        before = arm.torque
    arm.step(1.0)
    assert arm.law.deviation[2] == pytest.approx(-0.005, rel=0.02)


# ------------------------------------------------------------------------------------------- limits


def test_the_force_of_control_can_be_limited() -> None:
    arm = Arm(CartesianImpedance(max_force=[NAN, NAN, 20.0, NAN, NAN, NAN]))
    arm.push = turned(arm.wanted.rotation, along(2, 10.0))
    arm.step(1.0)
    assert arm.law.deviation[2] == pytest.approx(10.0 / 2000.0, rel=0.02), "below the limit it is a spring"
    arm.push = turned(arm.wanted.rotation, along(2, 25.0))
    arm.step(0.5)
    assert arm.law.deviation[2] > 0.02, "above it the arm complies"
    assert arm.law.force[2] == -20.0
    assert arm.law.violation == ""


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        (
            {"max_deviation": [NAN] * 2 + [0.01] + [NAN] * 3},
            "Maximum path deviation exceeded: 0.01.* m along z",
        ),
        (
            {"max_velocity": [NAN] * 2 + [0.05] + [NAN] * 3},
            "Maximum Cartesian velocity exceeded: 0.05.* m/s along z",
        ),
        (
            {"max_force": [NAN] * 2 + [15.0] + [NAN] * 3, "max_force_stops": True},
            "control force exceeded: 1[5-9].* N along z",
        ),
    ],
)
def test_limits_that_stop_say_so(limits: dict[str, Any], text: str) -> None:
    arm = Arm(CartesianImpedance(**limits))
    arm.push = turned(arm.wanted.rotation, along(2, 6.0))
    arm.step(1.0)
    assert arm.law.violation == ""
    arm.push = turned(arm.wanted.rotation, along(2, 60.0))
    arm.step(0.5)
    assert re.search(text, arm.law.violation), arm.law.violation


# ------------------------------------------------------------------------------------------- contact


def table(height: float, hardness: float) -> str:
    """A table under the hand, a spring of stiffness 9 m for the mass m of the arm [1/s²]."""
    return (
        f'<geom name="table" type="box" pos="0.55 0 {height - 0.02}" size="0.3 0.3 0.02" contype="2" conaffinity="1" '
        f'solref="-{hardness} -{math.sqrt(hardness)}" solimp="0.9 0.9 0.001"/>'
    )


def lowering(arm: Arm, depth: float, speed: float) -> Any:
    """A set-point that moves straight down by a depth and stays; in joints, by small steps."""
    steps = 400
    q = np.array(arm.start)
    path = [q.copy()]
    for _ in range(steps):
        q += np.linalg.pinv(jacobian(arm.robot, q)) @ (0, 0, -depth / steps, 0, 0, 0)
        path.append(q.copy())
    paths = np.array(path).T
    times = np.linspace(0.0, depth / speed, steps + 1)
    begin = arm.time + 0.01
    return lambda t: np.array([np.interp(t - begin, times, column) for column in paths])


@pytest.mark.parametrize("stiffness", [500.0, 5000.0])
@pytest.mark.parametrize("hardness", few([2e5, 3e3, 3e4]))
def test_a_stiff_contact_stays_stable(stiffness: float, hardness: float) -> None:
    mode = CartesianImpedance((stiffness,) * 3 + (200.0,) * 3)
    height = float(Arm(mode, q=DOWN).pose.xyz[2]) - 0.02
    arm = Arm(mode, q=DOWN, extra=table(height, hardness))
    depth = 0.02 + 50.0 / stiffness
    arm.step(depth / 0.1 + 1.0, lowering(arm, depth, 0.1))
    forces, heights = [], []
    for _ in range(300):
        arm.tick()
        forces.append(float(arm.law.force[2]))  # the hand points down
        heights.append(float(arm.pose.xyz[2]))
    pressed = stiffness * (float(np.mean(heights)) - float(arm.wanted.xyz[2]))
    assert pressed == pytest.approx(50.0, rel=0.1)
    assert np.mean(forces) == pytest.approx(pressed, rel=0.02)
    assert pressed / (height - float(np.mean(heights))) > 5e4, "the table is stiff"
    assert np.ptp(forces) < 0.1, "no chatter"
    assert np.ptp(heights) < 1e-5
    assert arm.quick < 5e-3


def test_in_contact_the_force_can_be_limited() -> None:
    mode = CartesianImpedance((3000.0,) * 3 + (200.0,) * 3, max_force=[NAN, NAN, 15.0, NAN, NAN, NAN])
    height = float(Arm(mode, q=DOWN).pose.xyz[2]) - 0.02
    arm = Arm(mode, q=DOWN, extra=table(height, 3e4))
    arm.step(1.5, lowering(arm, 0.07, 0.1))
    constraint = arm.data.qfrc_constraint[:7]
    wrench = np.linalg.lstsq(arm.flange.jacobian.T, constraint, rcond=None)[0]
    assert wrench[2] == pytest.approx(15.0, rel=0.02), "the table feels no more"


# ------------------------------------------------------------------------------------------- hard cases


@pytest.mark.parametrize(
    "q",
    few(
        [
            (0.0,) * 7,  # stretched: elbow, wrist and shoulder are singular at once
            (0.0, 0.5, 0.0, -1e-3, 0.0, 0.9, 0.0),
            (0.3, 0.8, 0.2, -1.5, 0.1, 0.0, 0.4),  # wrist
            (0.3, 0.0, 1.5708, -1.5, 0.1, 1.0, 0.4),  # shoulder
        ]
    ),
)
def test_singularities_do_no_harm(q: tuple[float, ...]) -> None:
    arm = Arm(CartesianImpedance(), q=q)
    arm.step(0.2)
    assert arm.data.qpos[:7] == pytest.approx(q, abs=1e-6), "at rest it stays"
    arm.push = np.array([5.0, -5.0, -10.0, 0.5, 0.5, 0.5])
    quickest = 0.0
    for _ in range(800):
        arm.tick()
        quickest = max(quickest, arm.quick)
    arm.push = np.zeros(6)
    arm.step(2.0)
    assert quickest < 2.0
    assert arm.quick < 0.02
    assert np.abs(arm.data.qpos[:7] - q).max() < 0.3


def test_blows_from_everywhere_die_away() -> None:
    rng = np.random.default_rng(7)
    arm = Arm(CartesianImpedance(STIFFNESS, nullspace_stiffness=20.0), tcp=HAND)
    for _ in range(10):
        arm.push = rng.uniform(-1, 1, 6) * (80, 80, 80, 8, 8, 8)
        arm.step(0.1)
    arm.push = np.zeros(6)
    arm.step(3.0)
    assert arm.quick < 1e-3
    assert arm.law.deviation == pytest.approx(np.zeros(6), abs=1e-4)
    assert arm.data.qpos[:7] == pytest.approx(ASKEW, abs=1e-3)


def test_a_turn_beyond_a_quarter_is_still_measured_rightly() -> None:
    arm = Arm(CartesianImpedance())
    for angle in (0.5, 1.5, 2.6, math.pi - 1e-9):
        arm.data.qpos[:7] = ASKEW
        arm.data.qpos[6] = ASKEW[6] + angle - (2 * math.pi if ASKEW[6] + angle > 3.05 else 0.0)
        arm.data.qvel[:] = 0.0
        arm.tick()
        assert arm.law.deviation[3:] == pytest.approx([0.0, 0.0, angle], abs=1e-6)


def test_an_overlaid_force_may_follow_another_while_the_law_is_in_force() -> None:
    arm = Arm(SineImpedance.force(z=10.0))
    arm.step(1.2)
    assert arm.law.deviation == pytest.approx(along(2, 10.0 / 2000.0), abs=1e-4)
    arm.law.change(SineImpedance.force(x=10.0))
    arm.step(1.2)
    assert arm.law.deviation == pytest.approx(along(0, 10.0 / 2000.0), abs=1e-4)
    arm.law.change(CartesianImpedance())
    arm.step(1.2)
    assert arm.law.deviation == pytest.approx(np.zeros(6), abs=1e-4)


def test_another_stiffness_leaves_an_overlaid_force_its_rhythm() -> None:
    mode = SineImpedance.sine("x", frequency=2.0, amplitude=10.0)
    arm, other = Arm(mode), Arm(mode)
    arm.step(0.6)
    other.step(0.6)
    arm.law.change(replace(mode, base=CartesianImpedance((500.0,) * 3 + (200.0,) * 3)))
    arm.step(0.2)
    other.step(0.2)
    assert arm.law.overlay == pytest.approx(other.law.overlay)
    assert np.abs(arm.law.deviation[0]) > np.abs(other.law.deviation[0])


@pytest.mark.parametrize("seed", few(range(6)))  # both models
def test_the_stiffest_spring_calms_down_wherever_the_arm_stands(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = ("iiwa14", "iiwa7")[seed % 2]
    q = rng.uniform(0.8 * robot(model).q_min, 0.8 * robot(model).q_max)
    mode = CartesianImpedance((5000.0,) * 3 + (300.0,) * 3, damping=1.0, nullspace_stiffness=1000.0)
    tcp = Pose.xyz_abc(*rng.uniform(-0.2, 0.2, 3), *rng.uniform(-1.0, 1.0, 3))
    off = '<option><flag contact="disable"/></option>'  # the posture may lie in the floor
    arm = Arm(mode, q=q, tcp=tcp, model=model, tail=off)
    for _ in range(4):
        arm.push = rng.uniform(-1, 1, 6) * (60, 60, 60, 6, 6, 6)
        arm.step(0.1)
    arm.push = np.zeros(6)
    arm.step(3.5)  # slow where it is nearly singular
    assert arm.quick < 5e-3
    assert np.abs(arm.law.deviation).max() < 1e-3
