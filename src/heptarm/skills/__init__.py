"""Skills: touching, inserting, grasping, teaching, replaying, collision guarding, teleoperation: functions of an arm.

They use only the public methods of `Arm`, so each is an example of how to build one; `Arm` offers some as methods.
"""

from heptarm.skills.grasping import Grasp, grasps, pick, place
from heptarm.skills.gripper import Gripper, TwoSignalGripper
from heptarm.skills.insertion import Insertion, insert
from heptarm.skills.pose_following import LeaderArm, follow_poses
from heptarm.skills.takeover import Takeover
from heptarm.skills.teleoperation import teleoperate

__all__ = [
    "Grasp",
    "Gripper",
    "Insertion",
    "LeaderArm",
    "Takeover",
    "TwoSignalGripper",
    "follow_poses",
    "grasps",
    "insert",
    "pick",
    "place",
    "teleoperate",
]
