"""The way from an order to its plan, whatever kind it is."""

from __future__ import annotations

from heptarm.errors import CommandRejected
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel
from heptarm.virtual import planner
from heptarm.virtual.batch import plan_batch
from heptarm.virtual.order import Order, PlanError
from heptarm.virtual.planner import Plan
from heptarm.virtual.spline import plan_joint_spline, plan_spline

_KINDS = {"batch": plan_batch, "spline": plan_spline, "spline_joints": plan_joint_spline}


def plan(robot: RobotModel, order: Order, start: Array) -> Plan:
    """Plan an order from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a joint limit, an unreachable pose, a path that cannot be led, or values that make no sense.
    """
    kind = _KINDS.get(order.kind)
    if kind is None:
        return planner.plan(robot, order, start)
    try:
        return kind(robot, order, start)
    except CommandRejected as error:
        raise PlanError("planning", f"Can not plan motion: {error}") from None
