"""Reinforcement learning: the reach task, a batched simulator, PPO, policies that need no torch.

Importing it registers `gymnasium.make("heptarm/Reach-v0")`, if Gymnasium is installed.
"""

from __future__ import annotations

from importlib.util import find_spec

#: Name of the environment at Gymnasium.
ENVIRONMENT = "heptarm/Reach-v0"


def register() -> None:
    """Register the environment with Gymnasium; repeated calls have no effect."""
    import gymnasium

    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(ENVIRONMENT, entry_point="heptarm.rl.env:ReachEnv")


if find_spec("gymnasium") is not None:
    register()
