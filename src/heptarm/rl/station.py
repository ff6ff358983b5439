"""The shipped scene `peg-in-hole` as a place of work: the peg taken out of its holder, and where the hole is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from heptarm.errors import NotReady
from heptarm.skills.gripper import TwoSignalGripper
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.tool import Tool, Workpiece

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm

GRIPPER = Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=Pose.at(0, 0, 0.16))
PEG = Workpiece("peg", mass=0.19, com=(0, 0, 0.025), frames={"tip": Pose.at(0, 0, 0.065)})
#: The peg's head in its holder, and the middle of the rim [m]; height above the holder on the way [m].
_HEAD, _HOLE, _OVER = (0.6, -0.1, 0.265), (0.6, 0.1, 0.24), 0.1
#: Joint positions before the holder, and speeds: a fraction, and near things [m/s].
_BEFORE, _SPEED, _NEAR = deg(0, 25, 0, -90, 0, 65, 0), 0.5, 0.1


@contextmanager
def held_peg(arm: Arm) -> Iterator[Pose]:
    """Take the peg out of its holder; it is in the gripper and attached while the `with` block runs.

    The block gets the pose of the hole: origin in the middle of the rim, z into it. The peg's end is the frame "tip".

    Args:
        arm: of a virtual cabinet with the scene `peg-in-hole`.

    Raises:
        NotReady: nothing is between the closed fingers.
    """
    with arm.tool(GRIPPER):
        gripper = TwoSignalGripper(
            arm, open="OutputX3Pin1", close="OutputX3Pin2", is_open="InputX3Pin3", is_closed="InputX3Pin4"
        )
        gripper.open()
        arm.move(ptp(_BEFORE), speed=_SPEED)
        down = arm.pose().quat
        head = Pose.of(_HEAD, down)
        arm.move(ptp(head.shifted(z=_OVER)), speed=_SPEED)
        arm.move(lin(head, speed_mps=_NEAR))
        gripper.close()
        if not gripper.holds_something:
            raise NotReady(
                "the gripper holds no peg", hint="connect to a fresh sim://iiwa14?scene=peg-in-hole"
            )
        with arm.attached(PEG):
            arm.move(lin_rel(z=_OVER, frame="base", speed_mps=_NEAR))
            yield Pose.of(_HOLE, down)
