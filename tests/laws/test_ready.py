"""The ready laws against a plant: responses, passivity, contact with a stiff wall, limits."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest

from heptarm import laws, model
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.fri import LawTrial
from heptarm.laws.ready import across, shared_library
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.values.pose import Pose
from heptarm.values.robot import ROBOTS, Body, robot

from .plant import ARM, DT, HOME, Floats, Plant


@pytest.mark.parametrize("name", ROBOTS)
def test_the_model_in_c_is_that_of_python(name: str) -> None:
    compiled, arm = ctypes.CDLL(str(shared_library())), robot(name)
    rng = np.random.default_rng(3)
    for load in (
        None,
        Body(2.0, np.array((0.01, 0.02, 0.1)), np.array((0.01, 0.02, 0.015, 0.001, 0.0, 0.002))),
    ):
        for _ in range(5):
            q, dq = rng.uniform(arm.q_min, arm.q_max), rng.uniform(-2.0, 2.0, 7)
            found = [np.zeros(shape) for shape in ((7, 7), 7, 7, (6, 7), 7)]
            arrays = (rigid_bodies(arm, load, rotor=ROTOR), q, dq, *found)
            compiled.heptarm_model(*(ctypes.c_void_p(one.ctypes.data) for one in arrays))
            mass, bias, weight, jac, pose = found
            assert np.abs(mass - model.mass_matrix(arm, q, load=load)).max() < 1e-12
            assert np.abs(bias - model.coriolis(arm, q, dq, load=load)).max() < 1e-12
            assert np.abs(weight - model.gravity(arm, q, load=load)).max() < 1e-12
            assert np.abs(jac - model.jacobian(arm, q)).max() < 1e-12
            expected = Pose.from_matrix(model.forward(arm, q)).array
            assert (
                np.abs(pose[:3] - expected[:3]).max() < 1e-12 and abs(pose[3:] @ expected[3:]) > 1.0 - 1e-12
            )


# ------------------------------------------------------------------------------------------- Cartesian impedance


def test_cartesian_impedance_reaches_its_goal_without_overshoot_and_reports_saturation() -> None:
    start = Pose.from_matrix(model.forward(ARM, HOME))
    plant = Plant(laws.cartesian_impedance(speed=0.2))
    begin = plant.place
    plant.run(0.05)
    assert np.abs(plant.place - begin).max() < 1e-6, "it begins where the arm is"
    goal = start.array.copy()
    goal[0] += 0.05
    plant.trial.params.goal = goal
    places = np.array(plant.run(1.2))
    assert places[:, 0].max() - begin[0] < 0.056, "at most 12 % of overshoot, after a ramp"
    assert places[-1, 0] - begin[0] == pytest.approx(0.05, abs=1e-3)
    assert np.abs(places[-1, 1:] - begin[1:]).max() < 2e-3
    assert plant.trial.memory.saturated == 0.0
    plant.trial.params.force_max = 1.0
    goal[0] -= 0.05
    plant.trial.params.goal = goal
    plant.run(0.3)
    assert plant.trial.memory.saturated > 50 and np.linalg.norm(plant.trial.memory.force[:3]) < 60.0


def test_cartesian_impedance_is_a_spring_of_its_stiffness() -> None:
    plant = Plant(laws.cartesian_impedance(stiffness=(800.0,) * 3 + (50.0,) * 3))
    begin = plant.place
    plant.push = lambda t: np.array([0.0, 8.0 * min(1.0, t / 0.2), 0.0])
    plant.run(1.5)
    assert plant.place - begin == pytest.approx([0.0, 8.0 / 800.0, 0.0], abs=5e-4)


def test_cartesian_impedance_holds_the_tip_of_a_tool_and_is_compliant_about_it() -> None:
    tip = Pose.from_rotvec((0.01, 0.02, 0.2), (0.1, -0.2, 0.3))
    plant = Plant(laws.cartesian_impedance(frame=tip, stiffness=(800.0,) * 3 + (50.0,) * 3))
    begin = Pose.from_matrix(model.forward(ARM, HOME)) @ tip
    goal = begin.shifted(y=0.02) @ Pose.from_rotvec((0.0, 0.0, 0.0), (0.0, 0.05, 0.0))
    plant.run(0.02)
    plant.trial.params.goal = goal
    plant.run(1.2)
    held = Pose.from_matrix(model.forward(ARM, plant.q)) @ tip
    assert np.abs(held.xyz - goal.xyz).max() < 1e-3
    assert np.abs((held.inverse() @ goal).rotvec).max() < 2e-3
    flange = plant.place
    plant.push = lambda t: np.array([0.0, 8.0 * min(1.0, t / 0.2), 0.0])  # on the flange
    plant.run(1.2)
    moved = Pose.from_matrix(model.forward(ARM, plant.q)) @ tip
    assert moved.xyz - held.xyz == pytest.approx([0.0, 8.0 / 800.0, 0.0], abs=1e-3)
    assert plant.place[1] - flange[1] > 0.015, "it turns about the tip, too"
    with pytest.raises(CommandRejected, match="frame must be"):
        laws.cartesian_impedance(frame=(0.0, 0.0, 0.2))  # type: ignore[arg-type]


def test_the_null_space_moves_the_elbow_and_not_the_flange() -> None:
    away = HOME + [0.25, 0.0, -0.3, 0.0, 0.3, 0.0, -0.2]
    plant = Plant(laws.cartesian_impedance(posture=away, posture_stiffness=30.0))
    begin = plant.place
    plant.run(1.5)
    assert np.abs(plant.place - begin).max() < 4e-3, "the flange stays"
    assert np.abs(plant.q - HOME).max() > 0.05, "the joints move"


def test_cartesian_impedance_stays_stable_in_contact_with_a_stiff_wall() -> None:
    plant = Plant(laws.cartesian_impedance(stiffness=(1500.0,) * 3 + (80.0,) * 3, speed=0.1))
    plant.wall = plant.place[2] - 0.01
    plant.run(0.02)
    goal = Pose.from_matrix(model.forward(ARM, HOME)).array
    goal[2] -= 0.03
    plant.trial.params.goal = goal
    forces = []
    for _ in range(1500):
        plant.torque_step()
        forces.append(plant.force)
    rest = np.array(forces[-300:])
    # 1500 N/m at a depth of 20 mm less the deflection of the wall
    assert rest.mean() == pytest.approx(30.0, rel=0.1) and np.ptp(rest) < 1.0
    assert max(forces) < 150.0 and plant.energy() < 1e-4


def test_cartesian_impedance_takes_energy_out() -> None:
    """Pushed and let go: the energy falls, and nothing swings on."""
    plant = Plant(laws.cartesian_impedance())
    plant.push = lambda t: np.array([15.0, -10.0, 5.0]) if t < 0.15 else np.zeros(3)
    plant.run(0.15)
    assert plant.energy() > 1e-3
    plant.run(1.5)
    assert plant.energy() < 1e-6


# ------------------------------------------------------------------------------------------------ joint impedance


def test_joint_impedance_with_feed_forward_tracks_better_than_without() -> None:
    goal = HOME + np.radians([10.0, -8.0, 5.0, 12.0, -6.0, 8.0, 20.0])
    errors = []
    for is_forward in (True, False):
        plant = Plant(laws.joint_impedance(smoothing=0.08, stiffness=(50.0,) * 7))
        plant.run(0.02)
        plant.trial.params.goal = goal
        worst = 0.0
        for _ in range(700):
            plant.torque_step()
            if not is_forward:  # the same spring and damper, without the torque of the acceleration
                plant._tau -= np.array(plant.trial.memory.feed_forward)
            worst = max(worst, float(np.abs(plant.trial.memory.q - plant.q).max()))
        errors.append(worst)
        plant.run(0.8)
        if is_forward:
            assert np.abs(plant.q - goal).max() < 2e-3 and plant.trial.memory.saturated == 0.0
            assert np.abs(plant.dq).max() < 1e-2
    assert errors[0] < 0.5 * errors[1]


def test_joint_impedance_limits_its_torques_and_counts_that() -> None:
    trial = LawTrial(laws.joint_impedance(HOME + 0.5, smoothing=0.0, tau_max=(5.0,) * 7))
    for _ in range(50):
        out = trial(HOME)
    assert np.abs(out.tau).max() == 5.0 and trial.memory.saturated > 40


# --------------------------------------------------------------------------------------------------- free guiding


def test_free_guiding_is_light_inside_and_a_wall_outside() -> None:
    place = model.forward(ARM, HOME)[:3, 3]
    law = laws.free_guiding(box=(place - [0.2, 0.05, 0.2], place + 0.2), wall_stiffness=2000.0)
    plant = Plant(law)
    plant.push = lambda t: np.array([0.0, -20.0, 0.0])
    places = np.array(plant.run(1.5))[:, 1]
    assert places[300] < -0.02, "it moves by a hand's force"
    assert places.min() > place[1] - 0.05 - 0.025, "it runs into the wall"
    assert places[-1] == pytest.approx(place[1] - 0.05 - 0.01, abs=1e-3), (
        "which stops it: 20 N on 2000 N/m are 10 mm"
    )
    assert plant.trial.memory.force[1] == pytest.approx(20.0, rel=0.2)
    plant.push = lambda t: np.zeros(3)
    plant.run(1.0)
    assert np.abs(plant.dq).max() < 0.1, "it does not bounce on"


def test_free_guiding_holds_joints_inside_their_limits_and_carries_extra_load() -> None:
    trial = LawTrial(laws.free_guiding(extra=Body(1.5, np.array((0.0, 0.0, 0.1)))))
    weight = model.gravity(ARM, HOME, load=Body(1.5, np.array((0.0, 0.0, 0.1)))) - model.gravity(ARM, HOME)
    assert trial(HOME).tau == pytest.approx(weight, abs=1e-9)
    near = HOME.copy()
    near[5] = ARM.q_max[5] - 0.05
    bare = LawTrial(laws.free_guiding())
    assert bare(near).tau[5] == pytest.approx(-100.0 * 0.05) and np.abs(bare(near).tau[:5]).max() == 0.0
    with pytest.raises(CommandRejected, match="lower corner of the box must be below"):
        laws.free_guiding(box=((1.0, 0.0, 0.0), (0.0, 1.0, 1.0)))


# ----------------------------------------------------------------------------------------------------- admittance


def test_admittance_moves_like_a_damped_mass_and_forgets_small_forces() -> None:
    plant = Plant(laws.admittance(dead_band=2.0))
    begin = plant.place
    plant.push = lambda t: np.array([0.0, 1.5, 0.0])
    plant.run(0.5, by="position")
    assert np.abs(plant.place - begin).max() < 1e-3, "inside the dead band"
    plant.push = lambda t: np.array([0.0, 12.0, 0.0])
    plant.run(0.6, by="position")
    # 10 N behind the dead band on 200 N s/m
    assert plant.velocity[1] == pytest.approx(0.05, rel=0.1)


def test_admittance_presses_on_a_stiff_wall_with_its_force() -> None:
    law = laws.admittance(
        wrench=(0, 0, -20.0, 0, 0, 0), dead_band=0.0, moment_dead_band=0.0, damping=(800,) * 3 + (40,) * 3
    )
    plant = Plant(law, wall_stiffness=20_000.0)
    plant.wall = plant.place[2] - 0.005
    forces = []
    for _ in range(3000):
        plant.position_step()
        forces.append(plant.force)
    rest = np.array(forces[-300:])
    assert rest.mean() == pytest.approx(20.0, rel=0.05) and np.ptp(rest) < 1.0


# ------------------------------------------------------------------------------------------------------- hybrid


@pytest.mark.parametrize("turned", [False, True])
def test_hybrid_presses_with_its_force_while_it_follows_a_goal_along_the_wall(turned: bool) -> None:
    into_the_wall = Pose.xyz_abc(0.0, 0.0, 0.0, 0.4, math.pi, 0.0)  # its z axis
    push = 20.0 if turned else -20.0
    law = laws.hybrid(wrench=(0, 0, push, 0, 0, 0), frame=into_the_wall if turned else None, speed=0.05)
    plant = Plant(law, wall_stiffness=20_000.0)
    plant.wall = plant.place[2] - 0.005
    begin = plant.place
    plant.run(1.5, by="position")
    assert plant.force == pytest.approx(20.0, rel=0.05), "in contact"
    goal = np.array(plant.trial.memory.goal)
    plant.trial.params.goal = goal + [0.03, 0.06, 0.05, 0.0, 0.0, 0.0, 0.0]  # z does not count
    forces, behind = [], []
    for _ in range(2000):
        plant.position_step()
        forces.append(plant.force)
        behind.append(np.abs(plant.place[:2] - plant.trial.memory.goal[:2]).max())
    assert np.abs(np.array(forces) - 20.0).max() < 2.0, "also while it slides"
    assert plant.place[:2] - begin[:2] == pytest.approx([0.03, 0.06], abs=1e-3)
    assert max(behind) < 1.5e-3
    assert plant.trial.memory.wrench[2] == pytest.approx(-push, rel=0.05), "in axes of the frame"
    turn = Pose.from_matrix(model.forward(ARM, plant.q)).array[3:] @ goal[3:]
    assert abs(turn) > math.cos(0.5 * 2e-3), "its orientation is controlled by position"


def test_hybrid_searches_contact_slowly_and_limits_its_speeds() -> None:
    plant = Plant(laws.hybrid(wrench=(0, 0, -40.0, 0, 0, 0), damping=(100,) * 3 + (40,) * 3, speed=0.02))
    plant.trial.params.goal = [0.3, 0.3, 0.3, 0.0, 1.0, 0.0, 0.0]
    places = np.array(plant.run(1.0, by="position"))
    speeds = np.diff(places[100:], axis=0) / DT
    assert -speeds[:, 2] == pytest.approx(np.full(len(speeds), 0.02), rel=0.1), (
        "40 N on 100 N s/m, but limited"
    )
    assert np.linalg.norm(speeds[:, :2], axis=1).max() < 0.021


# --------------------------------------------------------------------------------------- targets, filters, search


def test_jerk_limited_targets_arrive_fast_within_their_limits_and_turn_at_any_time() -> None:
    limits = {"speed": 0.8, "acceleration": 2.0, "jerk": 20.0}
    far = np.array([0.5, -0.3, 0.2, 0.1, 0.001, 0.3, -0.5])
    trial = LawTrial(
        laws.jerk_limited(HOME + far, **{name: np.full(7, value) for name, value in limits.items()})
    )
    path, arrived = [HOME, HOME, HOME], 0.0
    for k in range(5000):
        if k == 2000:
            trial.params.goal = HOME
        if 2250 <= k < 2600 and k % 33 == 0:  # as from a camera, while it moves
            trial.params.goal = HOME + np.random.default_rng(k).uniform(-0.5, 0.5, 7)
        if k == 2600:
            trial.params.goal = HOME + far
        path.append(np.array(trial(HOME, q_ipo=HOME).q))
        if not arrived and np.abs(path[-1] - HOME - far).max() < 1e-9:
            arrived = k * DT
    steps = np.array(path)
    for order, name in enumerate(limits, start=1):
        assert np.abs(np.diff(steps, order, axis=0)).max() / DT**order <= limits[name] * 1.001, name
    moved = steps[3:2000] - HOME
    assert (np.abs(moved) <= np.abs(far) + 1e-12).all() and (moved * far >= -1e-12).all(), "no overshoot"
    # a trapezium of the acceleration: d / v + v / a + a / j
    assert arrived <= 1.15 * (0.5 / 0.8 + 0.8 / 2.0 + 2.0 / 20.0)
    assert np.abs(steps[-1] - HOME - far).max() < 1e-12 and trial.memory.is_there == 1.0


@pytest.mark.parametrize("when", [80, 150, 300, 600])
def test_limits_that_are_lowered_on_the_way_are_reached_within_the_jerk(when: int) -> None:
    trial = LawTrial(
        laws.jerk_limited(
            HOME + 1.0, speed=np.full(7, 0.8), acceleration=np.full(7, 2.0), jerk=np.full(7, 20.0)
        )
    )
    path = [HOME, HOME, HOME]
    for k in range(6000):
        if k == when:
            trial.params.speed, trial.params.acceleration = np.full(7, 0.3), np.full(7, 0.8)
        path.append(np.array(trial(HOME, q_ipo=HOME).q))
    steps = np.array(path)
    assert np.abs(np.diff(steps, 3, axis=0)).max() / DT**3 <= 20.0 * 1.001
    assert np.abs(np.diff(steps[when + 900 :], axis=0)).max() / DT <= 0.3 * 1.001
    assert steps.max(axis=0) - HOME == pytest.approx(np.full(7, 1.0), abs=1e-12), "there, and no overshoot"


@pytest.mark.parametrize("order", [1, 2])
def test_readings_pass_the_filter_and_the_arm_keeps_to_its_motion(order: int) -> None:
    trial = LawTrial(laws.low_pass_readings(frequency=5.0, order=order))
    step = np.arange(1.0, 8.0)
    trial(HOME, q_ipo=HOME, tau_ext=np.zeros(7))
    rises = []
    for k in range(400):
        noise = 0.5 * (-1) ** k
        out = trial(HOME, q_ipo=HOME + 1e-3 * k, tau_ext=step + noise)
        assert np.array(out.q) == pytest.approx(HOME + 1e-3 * k)
        rises.append(np.array(trial.memory.tau_ext))
    one = round(1.0 / (2.0 * math.pi * 5.0) / DT) - 1  # a time constant
    expected = 1.0 - math.exp(-1.0) if order == 1 else 1.0 - 2.0 * math.exp(-1.0)
    assert rises[one] / step == pytest.approx([expected] * 7, abs=0.02)
    assert np.abs(rises[-1] - step).max() < 0.02, "an alternating noise of 0.5 Nm is gone"


def test_minimum_jerk_arrives_in_time_within_its_limits_and_turns_smoothly() -> None:
    speed, acceleration = np.full(7, 0.8), np.full(7, 2.0)
    trial = LawTrial(laws.minimum_jerk(speed=speed, acceleration=acceleration))
    trial(HOME)
    goal = HOME + [0.5, -0.3, 0.2, 0.1, 0.0, 0.3, -0.5]
    trial.params.goal = goal
    path: list[Floats] = []
    for k in range(3000):
        if k == 400:
            trial.params.goal = HOME  # half way: back
        path.append(np.array(trial(HOME, q_ipo=HOME).q))
    steps = np.array(path)
    v, a = np.diff(steps, axis=0) / DT, np.diff(steps, 2, axis=0) / DT**2
    assert np.abs(v).max() <= 0.8 * 1.01 and np.abs(steps[-1] - HOME).max() < 1e-12
    assert np.abs(np.diff(a, axis=0)).max() < 0.1, "no step of the acceleration, also where the goal changes"
    straight = LawTrial(laws.minimum_jerk(goal, speed=speed, acceleration=acceleration))
    path = [np.array(straight(HOME, q_ipo=HOME).q) for _ in range(round(1.875 * 0.5 / 0.8 / DT) + 60)]
    assert np.abs(path[-1] - goal).max() < 1e-12
    assert np.abs(np.diff(np.array(path), axis=0) / DT).max() == pytest.approx(0.8, rel=0.15)
    middle = np.array(path)[:, 0] - HOME[0]
    moving = np.flatnonzero((middle > 1e-9) & (middle < 0.5 - 1e-9))
    assert middle[moving[len(moving) // 2]] == pytest.approx(0.25, abs=0.01), (
        "symmetric: half way in half the time"
    )


@pytest.mark.parametrize(("order", "expected"), [(1, 1.0 - math.exp(-1.0)), (2, 1.0 - 2.0 * math.exp(-1.0))])
def test_low_pass_has_the_step_response_of_its_order(order: int, expected: float) -> None:
    trial = LawTrial(laws.low_pass(HOME + 0.1, frequency=1.0, order=order))
    for _ in range(round(1.0 / (2.0 * math.pi) / DT)):  # one time constant
        out = trial(HOME, q_ipo=HOME)
    assert (out.q - HOME) / 0.1 == pytest.approx([expected] * 7, abs=6e-3)
    for _ in range(3000):
        assert (trial(HOME, q_ipo=HOME).q <= HOME + 0.1 + 1e-9).all()


@pytest.mark.parametrize("pattern", ["spiral", "lissajous"])
def test_search_pushes_and_sweeps_the_plane_across(pattern: str) -> None:
    trial = LawTrial(
        laws.search(pattern, push=(0.0, 0.0, -12.0), amplitude=6.0, frequency=2.0, ratio=1.5, rise=1.0)
    )
    forces = np.array([np.array(trial(HOME).wrench) for _ in range(3000)])
    assert np.abs(forces[0]).max() < 0.1, "it begins without a step"
    assert forces[600:, 2] == pytest.approx(-12.0) and not forces[:, 3:].any()
    radius = np.hypot(forces[:, 0], forces[:, 1])
    assert trial.memory.done == 1.0 and np.abs(forces[:, :2]).max() == pytest.approx(6.0, rel=0.01)
    if pattern == "spiral":
        assert (np.diff(radius[:1000]) > -1e-9).all() and np.ptp(radius[1100:]) < 1e-9
    for direction in ((0.0, 0.0, -3.0), (5.0, 0.0, 0.0), (1.0, 1.0, 1.0)):
        one, two = across(np.array(direction))
        assert (
            abs(one @ two) < 1e-12
            and abs(one @ direction) < 1e-9
            and np.linalg.norm(two) == pytest.approx(1.0)
        )


# ------------------------------------------------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    "make",
    [
        lambda: laws.cartesian_impedance(stiffness=(-1.0,) * 6),
        lambda: laws.cartesian_impedance(stiffness=(1.0,) * 5),
        lambda: laws.joint_impedance(goal=[math.nan] * 7),
        lambda: laws.joint_impedance(damping=-1.0),
        lambda: laws.admittance(mass=(0.0,) * 6),
        lambda: laws.minimum_jerk(speed=(0.0,) * 7),
        lambda: laws.low_pass(order=3),
        lambda: laws.search("zigzag"),
        lambda: laws.hybrid(force_axes=(0, 0, 2, 0, 0, 0)),
        lambda: laws.hybrid(wrench=(5.0, 0, 0, 0, 0, 0)),
        lambda: laws.jerk_limited(jerk=(0.0,) * 7),
        lambda: laws.low_pass_readings(order=0),
    ],
)
def test_bad_arguments_are_refused(make: object) -> None:
    with pytest.raises(HeptarmError) as error:
        make()  # type: ignore[operator]
    assert error.value.parameter
