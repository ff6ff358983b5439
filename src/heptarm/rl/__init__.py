"""Learning: the task of reaching a point, a batched simulator, PPO, policies that need no torch.

Importing it makes `gymnasium.make("heptarm/Reach-v0")` known, where Gymnasium is installed.
"""

from __future__ import annotations

from importlib.util import find_spec

#: Name of the environment at Gymnasium.
ENVIRONMENT = "heptarm/Reach-v0"


def register() -> None:
    """Make the environment known to Gymnasium; once is enough."""
    import gymnasium

    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(ENVIRONMENT, entry_point="heptarm.rl.env:ReachEnv")


if find_spec("gymnasium") is not None:
    register()
