"""Motions of every kind obey their limits: each limit alone makes a motion slower."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.planning.command import Order
from heptarm.planning.planner import plan
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.sim.driving import READY, numbers

ROBOT = robot("iiwa14")
START = np.array(READY)
HERE = Pose.from_matrix(forward(ROBOT, START))


def there(x: float, y: float, z: float, turn: float = 0.4) -> tuple[float, ...]:
    return numbers(Pose.of(HERE.xyz + [x, y, z], HERE.quat) @ Pose.xyz_abc(0, 0, 0, turn, 0, 0))


def part(kind: str, **terms: object) -> Order:
    return Order(1, kind, **terms)  # type: ignore[arg-type]


OFFSET = numbers(Pose.xyz_abc(0.0, 0.1, -0.05, 0.4, 0, 0))
LIN = part("lin", pose=there(0.0, 0.15, -0.1))
JOINTS = tuple(START + [0.4, 0.2, -0.3, 0.3, 0.5, -0.2, 0.6])
FURTHER = tuple(START + [0.6, 0.1, -0.2, 0.2, 0.1, 0.3, -0.3])
ORDERS = {
    "ptp": part("ptp", joints=JOINTS),
    "ptp to a pose": part("ptp", pose=there(0.0, 0.2, -0.1)),
    "lin": LIN,
    "lin_rel": part("lin_rel", offset=OFFSET),
    "circ": part("circ", via=there(-0.04, 0.08, 0.0, 0.2), pose=there(0.0, 0.16, 0.0)),
    "spline": part(
        "spline", parts=(part("spl", pose=there(-0.02, 0.08, 0.02, 0.2)), part("spl", pose=there(0, 0.16, 0)))
    ),
    "spline_joints": part("spline_joints", parts=(part("ptp", joints=JOINTS), part("ptp", joints=FURTHER))),
}
CARTESIAN = ("lin", "lin_rel", "circ", "spline")
LIMITS = {
    "cart_velocity": 0.02,
    "cart_acceleration": 0.05,
    "cart_jerk": 0.2,
    "ori_velocity": 0.05,
    "ori_acceleration": 0.2,
    "ori_jerk": 0.5,
}
AXES = ("joint_velocity", "joint_acceleration", "joint_jerk")


def limited(order: Order, **limits: object) -> Order:
    """The order with limits; of a spline they are those of its segments, as the cabinet hands them down."""
    parts = tuple(replace(one, **limits) for one in order.parts)  # type: ignore[arg-type]
    return replace(order, parts=parts, **limits)  # type: ignore[arg-type]


def duration(order: Order) -> float:
    return plan(ROBOT, order, START).duration


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("kind", CARTESIAN)
def test_limits_along_a_path_are_obeyed(kind: str, limit: str) -> None:
    assert duration(limited(ORDERS[kind], **{limit: LIMITS[limit]})) > 1.1 * duration(ORDERS[kind])


@pytest.mark.parametrize("limit", AXES)
@pytest.mark.parametrize("kind", ORDERS)
def test_limits_of_the_axes_are_obeyed(kind: str, limit: str) -> None:
    assert duration(limited(ORDERS[kind], **{limit: (0.02,) * 7})) > 1.1 * duration(ORDERS[kind])


@pytest.mark.parametrize("kind", ["ptp", "lin", "spline_joints"])
@pytest.mark.parametrize("axis", range(7))
def test_each_axis_has_its_own(kind: str, axis: int) -> None:
    order = ORDERS["ptp"] if kind == "lin" else ORDERS[kind]
    if kind == "lin":  # a path on which every axis moves
        order = part("lin", pose=there(0.1, 0.15, -0.1, 0.5), redundancy=(0.5, 2, -1))
    slow = tuple(0.01 if index == axis else 1.0 for index in range(7))
    assert duration(limited(order, joint_velocity=slow)) > 1.1 * duration(order)
