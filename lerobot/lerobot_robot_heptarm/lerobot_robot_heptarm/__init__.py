"""The robot `heptarm` of LeRobot: `--robot.type=heptarm --robot.target=sim://iiwa14?scene=bins`.

LeRobot imports this package by its name; the class of the configuration registers itself.
"""

from lerobot_robot_heptarm.robot import HeptarmRobot, HeptarmRobotConfig, connected

__all__ = ["HeptarmRobot", "HeptarmRobotConfig", "connected"]
