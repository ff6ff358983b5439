"""The environment `heptarm` of LeRobot: `--env.type=heptarm --env.task=pick-place`, a virtual arm that is judged."""

from lerobot_env_heptarm.environment import HeptarmEnv, HeptarmEnvConfig

__all__ = ["HeptarmEnv", "HeptarmEnvConfig"]
