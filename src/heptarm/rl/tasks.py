"""The tasks by their names, and a task out of a file."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

from heptarm.errors import CommandRejected
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.rl.contact.plug_insert import PlugInsert
from heptarm.rl.contact.polish import Polish
from heptarm.rl.contact.push import Push
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.task import ReachTask

#: One definition of what is learned: it serves training, evaluation and an arm.
Task: TypeAlias = ReachTask | ContactTask
TASKS: dict[str, type[Task]] = {
    kind.name: kind for kind in (ReachTask, PegInHole, Push, PickPlace, Polish, PlugInsert)
}
OfTask = TypeVar("OfTask", bound=Task)


def environment(kind: type[Task]) -> str:
    """Name of a task's environment at Gymnasium: "heptarm/PegInHole-v0"."""
    return f"heptarm/{kind.__name__.removesuffix('Task')}-v0"


def task_named(name: str) -> Task:
    """The task of that name with its defaults.

    Raises:
        CommandRejected: no such task.
    """
    return _kind(name)()


def task_from_dict(entries: dict[str, Any]) -> Task:
    """Of a task's `as_dict`; one without a name is of the time when there was one task.

    Raises:
        CommandRejected: no such task, or entries that are not its.
    """
    return _kind(entries.get("name", ReachTask.name)).from_dict(entries)


def _kind(name: object) -> type[Task]:
    if not isinstance(name, str) or name not in TASKS:
        raise CommandRejected(
            f"task must be one of {', '.join(TASKS)}, got {name!r}",
            parameter="task",
            value=name,
            hint="the file may be of a newer heptarm; your own task is registered by heptarm.rl.register(TASK)",
        )
    return TASKS[name]
