"""Teleoperators of LeRobot for the robot heptarm: `heptarm_leader`, another arm; `heptarm_script`, a planned way."""

from lerobot_teleoperator_heptarm.leader import HeptarmLeader, HeptarmLeaderConfig
from lerobot_teleoperator_heptarm.script import HeptarmScript, HeptarmScriptConfig

__all__ = ["HeptarmLeader", "HeptarmLeaderConfig", "HeptarmScript", "HeptarmScriptConfig"]
