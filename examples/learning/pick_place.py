"""A cube from one bin to the other, from places drawn at random: a script for `heptarm rl record`.

heptarm rl record examples/learning/pick_place.py picked --episodes 40 --camera --target 'sim://iiwa14?scene=bins&speed=2'
heptarm convert picked data/picked --to lerobot
"""

import numpy as np

import heptarm as ha

GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
HOME = ha.deg(0, 25, 0, -90, 0, 65, 0)
#: Middle of the other bin, heights of a grasp and above the bins [m].
OTHER, GRASP, ABOVE = (0.53, -0.20), 0.232, 0.34


def gripper_of(arm: ha.Arm) -> ha.TwoSignalGripper:
    """The gripper of the scene."""
    return ha.TwoSignalGripper(
        arm, open="OutputX3Pin1", close="OutputX3Pin2", is_open="InputX3Pin3", is_closed="InputX3Pin4"
    )


def reset(arm: ha.Arm, random: np.random.Generator) -> None:
    """Go home, and put the cube to its place, drawn at random; nothing of it is recorded."""
    gripper_of(arm).open()
    arm.move(ha.ptp(HOME), speed=0.5)
    arm.operator.reset()
    cube = arm.operator.where("part_1")
    x, y = random.uniform((0.515, 0.18), (0.545, 0.22))
    arm.operator.place("part_1", ha.Pose.of((x, y, cube.xyz[2]), cube.quat))


def demonstrate(arm: ha.Arm, random: np.random.Generator) -> bool:
    """Pick the cube up, and put it into the other bin; True: it is there."""
    with arm.tool(GRIPPER):
        gripper, down = gripper_of(arm), arm.pose().quat
        x, y, _ = arm.operator.where("part_1").xyz
        arm.move(ha.ptp(ha.Pose.of((x, y, ABOVE), down)), speed=0.5)
        arm.move(ha.lin(ha.Pose.of((x, y, GRASP), down), speed_mps=0.15))
        gripper.close()
        arm.move(ha.lin(ha.Pose.of((x, y, ABOVE), down), speed_mps=0.15))
        arm.move(ha.ptp(ha.Pose.of((*OTHER, ABOVE), down)), speed=0.5)
        arm.move(ha.lin(ha.Pose.of((*OTHER, GRASP), down), speed_mps=0.15))
        gripper.open()
        arm.move(ha.lin(ha.Pose.of((*OTHER, ABOVE), down), speed_mps=0.15))
    away = arm.operator.where("part_1").xyz[:2] - np.array(OTHER)
    return bool(np.abs(away).max() < 0.05)
