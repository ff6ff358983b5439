"""Plans a motion of any kind, or refuses it with a text of the kind that Sunrise gives."""

from __future__ import annotations

from heptarm.errors import CommandRejected
from heptarm.planning import seam
from heptarm.planning.motion import (
    ON_FLANGE,
    PlanError,
    ServoMotion,
    check_numbers,
    check_places,
)
from heptarm.planning.plan import Plan
from heptarm.planning.program import plan_batch, plan_motion
from heptarm.planning.spline import plan_joint_spline, plan_spline
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.robot import RobotModel


def plan(
    robot: RobotModel, motion: seam.PlantMotion, start: Array, *, tcp: tuple[float, ...] = ON_FLANGE
) -> Plan:
    """Plan a motion from rest.

    Args:
        robot: the robot.
        motion: the motion.
        start: joint positions, shape (7,) [rad].
        tcp: flange to motion frame, x y z [m], quaternion x y z w.

    Raises:
        PlanError: a joint limit, an unreachable pose, a path through a singularity, or values that make no sense.
    """
    try:
        check_numbers(motion)
        check_places(tcp)
        frame = Pose.of(tcp[:3], tcp[3:])
        if isinstance(motion, seam.Hold | seam.HandGuide | ServoMotion):
            return Plan(motion, start, start)
        if isinstance(motion, seam.Batch):
            return plan_batch(robot, motion, start, frame)
        if isinstance(motion, seam.Spline):
            return plan_spline(robot, motion, start, frame)
        if isinstance(motion, seam.JointSpline):
            return plan_joint_spline(robot, motion, start, frame)
        if isinstance(motion, seam.Spl):
            raise PlanError(
                "planning", "Can not plan motion: a SPL is a segment of a spline, no motion by itself"
            )
        return plan_motion(robot, motion, start, frame)
    except CommandRejected as error:
        raise PlanError("planning", f"Can not plan motion: {error}") from None
