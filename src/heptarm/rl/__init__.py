"""Reinforcement learning: the tasks, batched simulators, PPO, policies that need no torch.

Importing it registers the environments with Gymnasium, if that is installed: `gymnasium.make("heptarm/Reach-v0")`,
"heptarm/PegInHole-v0" and so on, one for each task.
"""

from __future__ import annotations

from importlib.util import find_spec

from heptarm.rl.tasks import TASKS, Task, environment


def register(kind: type[Task] | None = None) -> None:
    """Make a task of your own known by its name, and to Gymnasium; repeated calls have no effect.

    Args:
        kind: the class of the task; None: those that come with heptarm.
    """
    if kind is not None:
        TASKS[kind.name] = kind
    if find_spec("gymnasium") is None:
        return
    import gymnasium

    for known in TASKS.values() if kind is None else (kind,):
        if environment(known) not in gymnasium.registry:
            entry = "ReachEnv" if known.name == "reach" else "ContactEnv"
            gymnasium.register(
                environment(known),
                entry_point=f"heptarm.rl.env:{entry}",
                vector_entry_point="heptarm.rl.env:TaskVectorEnv",
                kwargs={} if known.name == "reach" else {"task": known.name},
            )


register()
