"""Motions of every kind obey their limits: each limit alone makes a motion slower."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, cast

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning import seam
from heptarm.planning.planner import plan
from heptarm.planning.seam import PlantMotion
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.sim import motions
from tests.sim.driving import READY, numbers

ROBOT = robot("iiwa14")
START = np.array(READY)
HERE = Pose.from_matrix(forward(ROBOT, START))


def there(x: float, y: float, z: float, turn: float = 0.4) -> tuple[float, ...]:
    return numbers(Pose.of(HERE.xyz + [x, y, z], HERE.quat) @ Pose.xyz_abc(0, 0, 0, turn, 0, 0))


OFFSET = numbers(Pose.xyz_abc(0.0, 0.1, -0.05, 0.4, 0, 0))
JOINTS = tuple(START + [0.4, 0.2, -0.3, 0.3, 0.5, -0.2, 0.6])
FURTHER = tuple(START + [0.6, 0.1, -0.2, 0.2, 0.1, 0.3, -0.3])
#: A motion of each kind, with limits.
MOTIONS: dict[str, Callable[..., PlantMotion]] = {
    "ptp": partial(motions.ptp, JOINTS),
    "ptp to a pose": partial(motions.ptp_pose, there(0.0, 0.2, -0.1)),
    "lin": partial(motions.lin, there(0.0, 0.15, -0.1)),
    "lin_rel": partial(motions.lin_rel, OFFSET),
    "circ": partial(motions.circ, there(-0.04, 0.08, 0.0, 0.2), there(0.0, 0.16, 0.0)),
    "spline": lambda **limits: motions.spline(
        motions.spl(there(-0.02, 0.08, 0.02, 0.2), **limits), motions.spl(there(0, 0.16, 0), **limits)
    ),
    "spline_joints": lambda **limits: motions.spline_joints(
        motions.ptp(JOINTS, **limits), motions.ptp(FURTHER, **limits)
    ),
    "spline with its own limits": lambda **limits: seam.Spline(
        segments=motions.spline(
            motions.spl(there(-0.02, 0.08, 0.02, 0.2)), motions.spl(there(0, 0.16, 0))
        ).segments,
        dynamics=motions.path_dynamics(cast(Any, limits)),
        joints=motions.joint_dynamics(cast(Any, limits)),
    ),
    "spline_joints with its own limits": lambda **limits: seam.JointSpline(
        points=(motions.ptp(JOINTS), motions.ptp(FURTHER)), dynamics=motions.joint_dynamics(cast(Any, limits))
    ),
    "batch with its own limits": lambda **limits: seam.Batch(
        motions=(motions.ptp(JOINTS), motions.ptp(FURTHER)),
        dynamics=motions.joint_dynamics(cast(Any, limits)),
    ),
}
CARTESIAN = ("lin", "lin_rel", "circ", "spline", "spline with its own limits")
LIMITS = {
    "velocity": 0.02,
    "acceleration": 0.05,
    "jerk": 0.2,
    "orientation_velocity": 0.05,
    "orientation_acceleration": 0.2,
    "orientation_jerk": 0.5,
}
AXES = ("joint_velocity", "joint_acceleration", "joint_jerk")


def duration(motion: PlantMotion) -> float:
    return plan(ROBOT, motion, START).duration


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("kind", CARTESIAN)
def test_limits_along_a_path_are_obeyed(kind: str, limit: str) -> None:
    assert duration(MOTIONS[kind](**{limit: LIMITS[limit]})) > 1.1 * duration(MOTIONS[kind]())


@pytest.mark.parametrize("limit", AXES)
@pytest.mark.parametrize("kind", MOTIONS)
def test_limits_of_the_axes_are_obeyed(kind: str, limit: str) -> None:
    assert duration(MOTIONS[kind](**{limit: (0.02,) * 7})) > 1.1 * duration(MOTIONS[kind]())


@pytest.mark.parametrize("kind", ["ptp", "lin", "spline_joints"])
@pytest.mark.parametrize("axis", range(7))
def test_each_axis_has_its_own(kind: str, axis: int) -> None:
    made = MOTIONS[kind]
    if kind == "lin":  # a path on which every axis moves
        made = partial(motions.lin, there(0.1, 0.15, -0.1, 0.5), redundancy=(0.5, 2, -1))
    slow = tuple(0.01 if index == axis else 1.0 for index in range(7))
    assert duration(made(joint_velocity=slow)) > 1.1 * duration(made())
