"""Reinforcement learning: the tasks, batched simulators, PPO, policies that need no torch.

Importing it registers `gymnasium.make("heptarm/Reach-v0")` and "heptarm/PegInHole-v0", if Gymnasium is installed.
"""

from __future__ import annotations

from importlib.util import find_spec

#: Names of the environments at Gymnasium.
ENVIRONMENT, PEG_IN_HOLE = "heptarm/Reach-v0", "heptarm/PegInHole-v0"


def register() -> None:
    """Register the environments with Gymnasium; repeated calls have no effect."""
    import gymnasium

    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(ENVIRONMENT, entry_point="heptarm.rl.env:ReachEnv")
    if PEG_IN_HOLE not in gymnasium.registry:
        gymnasium.register(
            PEG_IN_HOLE,
            entry_point="heptarm.rl.peg_env:PegInHoleEnv",
            vector_entry_point="heptarm.rl.peg_env:PegInHoleVectorEnv",
        )


if find_spec("gymnasium") is not None:
    register()
