"""Arcs of the plant are circular, turn the motion frame as commanded, and stop on the arc."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from typing_extensions import Unpack

from heptarm.model.kinematics import forward
from heptarm.planning.motion import PlanError
from heptarm.planning.seam import Circ
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.plant.plant import Plant
from heptarm.values.checks import Array
from heptarm.values.motion.circle import arc
from heptarm.values.pose import Pose
from tests.sim import motions
from tests.sim.driving import Ear, numbers, ready, run

TCP = Pose.xyz_abc(0.05, 0.0, 0.15, 0.3, 0.2, 0.0)


def poses(plant: Plant, joints: Array, tcp: Pose = TCP) -> list[Pose]:
    return [Pose.from_matrix(forward(plant.robot, q)) @ tcp for q in joints]


def round_trip(
    plant: Plant,
    angle: float,
    tcp: Pose = TCP,
    radius: float = 0.08,
    plane: str = "xy",
    **limits: Unpack[motions.Limits],
) -> tuple[MotionCommand, Array]:
    """An order for an arc from the current position of the plant, and its centre."""
    start = poses(plant, plant.snapshot.q_cmd[None], tcp)[0]
    centre = start.xyz + {"xy": (0, radius, 0), "xz": (0, 0, -radius), "yz": (0, radius, 0)}[plane]
    motion = arc(start, angle, centre=centre, plane=plane)
    made = motions.circ(numbers(motion.via), numbers(motion.end), **limits)
    return MotionCommand(1, made, tcp=numbers(tcp)), centre


@pytest.mark.parametrize("plane", ["xy", "xz", "yz"])
@pytest.mark.parametrize("angle", [1.0, -4.0, 5.8])
def test_an_arc_is_round_on_the_measured_pose(plane: str, angle: float) -> None:
    plant, ear = ready(), Ear()
    order, centre = round_trip(plant, angle, plane=plane)
    track = run(plant, replace(order, listener=ear))
    assert ear.causes == ["started", "done"]
    seen = poses(plant, track.q[::10])
    spokes = np.array([pose.xyz - centre for pose in seen])
    assert np.abs(np.linalg.norm(spokes, axis=1) - 0.08).max() <= 0.5e-3
    normal = {"xy": 2, "xz": 1, "yz": 0}[plane]
    assert np.abs(spokes[:, normal]).max() <= 0.5e-3
    assert isinstance(order.motion, Circ)
    assert seen[-1].xyz == pytest.approx(order.motion.end.xyz, abs=2e-4)
    # it moves along the whole circle: the angles between the samples add up
    turned = np.cross(spokes[:-1], spokes[1:])[:, normal] / 0.08**2 * (-1 if plane == "xz" else 1)
    assert np.arcsin(turned).sum() == pytest.approx(angle, abs=0.01)


@pytest.mark.parametrize("reference", ["base", "path"])
@pytest.mark.parametrize("type_", ["variable", "constant", "joint"])
def test_the_orientation_is_led_as_the_order_reports(type_: str, reference: str) -> None:
    if (type_, reference) == ("joint", "path"):
        pytest.skip("the joints know no path")
    plant = ready()
    order, _ = round_trip(plant, 2.0)
    assert isinstance(order.motion, Circ)
    via, last = order.motion.via, order.motion.end
    end = Pose.of(last.xyz, last.quat) @ Pose.xyz_abc(a=0.6)
    start = poses(plant, plant.snapshot.q_cmd[None])[0]
    turned = motions.circ((*via.xyz, *via.quat), numbers(end), orientation=(type_, reference))
    track = run(plant, replace(order, motion=turned))
    seen = poses(plant, track.q_cmd)
    if type_ == "variable":
        assert seen[-1].angle_to(end) < 1e-6
    elif type_ == "joint":
        assert seen[-1].angle_to(end) < 1e-6
        middle = track.q_cmd[len(track.q_cmd) // 2]
        assert np.abs(middle - (track.q_cmd[0] + track.q_cmd[-1]) / 2).max() < 0.2, (
            "the joints went another way"
        )
    elif reference == "base":
        assert max(pose.angle_to(start) for pose in seen) < 1e-6
    else:  # as a car on a roundabout
        assert seen[-1].angle_to(start) == pytest.approx(2.0, abs=1e-6)
        assert seen[-1].angle_to(Pose.xyz_abc(a=2.0) @ Pose.of((0, 0, 0), start.quat)) < 1e-6


def test_a_joint_orientation_on_a_line_ends_at_its_target() -> None:
    plant = ready()
    start = poses(plant, plant.snapshot.q_cmd[None])[0]
    end = Pose(start.xyz + [0.05, 0.1, -0.1], (start @ Pose.xyz_abc(a=0.5, b=0.3)).quat)
    order = MotionCommand(1, motions.lin(numbers(end), orientation=("joint", "base")), tcp=numbers(TCP))
    track = run(plant, order)
    seen = poses(plant, track.q_cmd)
    travel = end.xyz - start.xyz
    for pose in seen[::20]:
        s = (pose.xyz - start.xyz) @ travel / (travel @ travel)
        assert np.linalg.norm(start.xyz + s * travel - pose.xyz) < 1e-6
    assert seen[-1].angle_to(end) < 1e-6
    run(plant, replace(order, id=2, motion=motions.lin(numbers(start), orientation=("constant", "base"))))
    assert poses(plant, plant.snapshot.q_cmd[None])[0].angle_to(end) < 1e-6


def test_speed_and_the_acceleration_towards_the_centre_are_kept() -> None:
    plant = ready()
    order, _ = round_trip(plant, 3.0, Pose.at(), velocity=2.0, acceleration=0.3, jerk=100.0)
    track = run(plant, order)
    points = np.array([pose.xyz for pose in poses(plant, track.q_cmd, Pose.at())])
    speed = np.linalg.norm(np.diff(points, axis=0), axis=1) * 1e3
    assert speed.max() ** 2 / 0.08 == pytest.approx(0.3, rel=0.02)
    robot = plant.robot
    assert (np.abs(track.acceleration) <= robot.ddq_max * 1.02).all()
    assert (np.abs(np.diff(track.acceleration, axis=0)) * 1e3 <= robot.dddq_max * 1.1).all()


def test_three_points_on_a_line_make_no_arc() -> None:
    plant = ready()
    start = poses(plant, plant.snapshot.q_cmd[None])[0]
    via, end = (Pose(start.xyz + [0, y, 0], start.quat) for y in (0.05, 0.1))
    with pytest.raises(PlanError, match="lie on a line"):
        plant.submit(MotionCommand(1, motions.circ(numbers(via), numbers(end)), tcp=numbers(TCP)))
    with pytest.raises(PlanError, match="may ignore its orientation"):
        plant.submit(MotionCommand(1, motions.lin(numbers(end), orientation=("ignore", "base"))))


def test_a_stop_comes_to_rest_on_the_arc_at_any_instant() -> None:
    random = np.random.default_rng(1)
    for _ in range(6):
        plant, ear = ready(), Ear()
        order, centre = round_trip(plant, 5.0)
        plant.submit(replace(order, listener=ear))
        plant.step(int(random.integers(1, 900)))
        plant.stop()
        track = run(plant, most=700)
        assert ear.causes[-1] == "cancelled" and np.abs(plant.snapshot.dq).max() < 2e-3
        radii = [np.linalg.norm(pose.xyz - centre) for pose in poses(plant, track.q_cmd)]
        assert np.abs(np.array(radii) - 0.08).max() < 1e-6
