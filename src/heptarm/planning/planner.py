"""Plans a command of any kind, or refuses it with a text of the kind that Sunrise gives."""

from __future__ import annotations

from heptarm.errors import CommandRejected
from heptarm.planning.command import Order, PlanError
from heptarm.planning.plan import Plan
from heptarm.planning.program import plan_motions
from heptarm.planning.spline import plan_joint_spline, plan_spline
from heptarm.planning.targets import LINES, check_numbers
from heptarm.values.arrays import Array
from heptarm.values.robot import RobotModel

_PLANNERS = {
    "batch": plan_motions,
    "ptp": plan_motions,
    **dict.fromkeys(LINES, plan_motions),
    "spline": plan_spline,
    "spline_joints": plan_joint_spline,
}


def plan(robot: RobotModel, order: Order, start: Array) -> Plan:
    """Plan a command from rest at `start`, shape (7,) [rad].

    Raises:
        PlanError: a joint limit, an unreachable pose, a path through a singularity, or values that make no sense.
    """
    try:
        check_numbers(order)
        if order.kind in ("hold", "guide") or order.is_servo:
            return Plan(order, start, start)
        if order.kind not in _PLANNERS:
            raise PlanError("planning", f"Can not plan motion: there is no motion of kind {order.kind!r}")
        return _PLANNERS[order.kind](robot, order, start)
    except CommandRejected as error:
        raise PlanError("planning", f"Can not plan motion: {error}") from None
