"""Reinforcement learning: the tasks, batched simulators, PPO, policies that need no torch.

Importing it registers the environments with Gymnasium, if that is installed: `gymnasium.make("heptarm/Reach-v0")`,
"heptarm/PegInHole-v0" and so on, one for each task.
"""

from __future__ import annotations

import re
from importlib.util import find_spec

from heptarm.errors import CommandRejected, ShapeError
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.tasks import TASKS, Task, environment
from heptarm.values.checks import shown


def register(kind: type[Task] | None = None) -> None:
    """Make a task of your own known by its name, and to Gymnasium; repeated calls have no effect.

    Args:
        kind: the class of the task; None: those that come with heptarm.

    Raises:
        ShapeError: no subclass of `ContactTask`.
        CommandRejected: one without a name of its own, or whose name is that of another task.
    """
    if kind is not None:
        _check(kind)
        TASKS[kind.name] = kind
    if find_spec("gymnasium") is None:
        return
    import gymnasium

    for known in TASKS.values() if kind is None else (kind,):
        if environment(known) not in gymnasium.registry:
            one, many = ("Reach", "Reach") if known.name == "reach" else ("Contact", "Task")
            gymnasium.register(
                environment(known),
                entry_point=f"heptarm.rl.env:{one}Env",
                vector_entry_point=f"heptarm.rl.env:{many}VectorEnv",
                kwargs={} if known.name == "reach" else {"task": known.name, "name": known.name},
            )


def _check(kind: object) -> None:
    """Refuse what cannot be registered, before anything is."""
    if not isinstance(kind, type) or not issubclass(kind, ContactTask):
        raise ShapeError(
            f"kind must be a subclass of ContactTask, got {shown(kind)}",
            parameter="kind",
            value=kind,
            hint=f"heptarm.rl.register({type(kind).__name__})" if isinstance(kind, ContactTask) else "",
        )
    name = vars(kind).get("name")
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name):
        raise CommandRejected(
            f"the class {kind.__name__} must have a name of its own in lower case, such as "
            f"press-plate, got {shown(name)}",
            parameter="name",
            value=name,
            hint=f'name: ClassVar[str] = "press-plate" in the class {kind.__name__}',
        )
    for other in TASKS.values():
        is_same = (other.__module__, other.__qualname__) == (kind.__module__, kind.__qualname__)
        if not is_same and (other.name == name or environment(other) == environment(kind)):
            raise CommandRejected(
                f"name and class of a task must be its own: {name} with {environment(kind)} is taken by "
                f"{other.__module__}.{other.__qualname__}, {other.name} with {environment(other)}",
                parameter="name",
                value=name,
                hint="choose another name, of the task or its class",
            )


register()
