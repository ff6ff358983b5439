"""Steps: what E1 means, and what the cabinet's inverse kinematics does where a pose leaves joints free."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.testing.commissioning.person import Person
from heptarm.testing.commissioning.step import Comparison, Movement, near, step
from heptarm.testing.measure import fresh
from heptarm.testing.stage import HOME
from heptarm.values.motion.line import lin
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, Redundancy, deg

#: An elbow that is out to the side: there E1 and the arm angle differ.
_ASIDE = deg(0, 0, 25, 0, 0, 10, 0)
#: By which E1 is changed, with the flange held still [deg].
_FARTHER = 20.0
_A3 = 2
#: Largest difference of angles that are the same [deg].
_SAME = 0.2


@step(
    movement=Movement(
        "The elbow and the joints",
        "each axis by at most 60 deg, the flange by 50 mm",
        "a tenth of every axis' speed",
    ),
    needs=("ptp", "lin"),
)
def e1(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Is E1 the angle of A3, and does a line without a redundancy keep it?"""
    arm.move(ptp(HOME + _ASIDE))
    arm.wait_for_rest()
    start = fresh(arm)
    found = [_angle("E1 that the cabinet reports", start.redundancy.e1, start.q[_A3])]
    farther = start.redundancy.e1 + float(np.radians(_FARTHER))
    arm.move(lin(start.pose, redundancy=Redundancy(farther, start.redundancy.status, start.redundancy.turn)))
    arm.wait_for_rest()
    found.append(_angle("A3 after a line to the same frame with another E1", fresh(arm).q[_A3], farther))
    arm.move(lin(Pose(start.pose.xyz + [0.0, 0.0, 0.05], start.pose.quat)))
    arm.wait_for_rest()
    return (*found, _angle("A3 after a line without a redundancy", fresh(arm).q[_A3], farther))


def _free_joints(name: str, where: str, *degrees: float) -> None:
    """Make the step of a posture whose pose leaves joints free."""
    posture = deg(*degrees)

    def own_pose(arm: Arm, person: Person) -> tuple[Comparison, ...]:
        arm.move(ptp(posture))
        arm.wait_for_rest()
        start = fresh(arm)
        arm.move(ptp(start.pose))
        arm.wait_for_rest()
        moved = np.degrees(np.abs(fresh(arm).q - start.q))
        arm.move(ptp(HOME))
        return (near("largest move of a joint", float(moved.max()), 0.0, _SAME, "deg"),)

    own_pose.__name__ = name
    own_pose.__doc__ = (
        f"With {where}, do joints that the pose leaves free stay in a motion to the arm's own pose?"
    )
    target = ", ".join(f"{angle:g}" for angle in degrees)
    step(
        movement=Movement(
            f"The arm to {target} deg, and perhaps the free joints against each other",
            "by up to 170 deg",
            "a tenth of every axis' speed",
        ),
        needs=("ptp",),
    )(own_pose)


_free_joints("own_pose_a2", "A2 at 0", 20, 0, 40, -90, 0, 60, 0)
_free_joints("own_pose_a6", "A6 at 0", 0, 45, 0, -90, 0, 0, 0)
_free_joints("own_pose_a2_a6", "A2 and A6 at 0", 20, 0, 40, -90, 20, 0, 10)
_free_joints("own_pose_a4", "A4 at 0", 20, 40, 10, 0, 20, 30, 10)
_free_joints("own_pose_candle", "all axes at 0", 0, 0, 0, 0, 0, 0, 0)


def _angle(quantity: str, measured: float, wanted: float) -> Comparison:
    return near(quantity, float(np.degrees(measured)), float(np.degrees(wanted)), _SAME, "deg")
