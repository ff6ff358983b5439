"""The tasks by their names, and a task out of a file."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

from heptarm.errors import CommandRejected
from heptarm.rl.peg import PegInHole
from heptarm.rl.task import ReachTask

#: One definition of what is learned: it serves training, evaluation and an arm.
Task: TypeAlias = ReachTask | PegInHole
TASKS: dict[str, type[ReachTask] | type[PegInHole]] = {kind.name: kind for kind in (ReachTask, PegInHole)}
OfTask = TypeVar("OfTask", bound=Task)


def task_from_dict(entries: dict[str, Any]) -> Task:
    """Of a task's `as_dict`; one without a name is of the time when there was one task.

    Raises:
        CommandRejected: no such task, or entries that are not its.
    """
    name = entries.get("name", ReachTask.name)
    if name not in TASKS:
        raise CommandRejected(
            f"task must be one of {', '.join(TASKS)}, got {name!r}",
            parameter="task",
            value=name,
            hint="the file may be of a newer heptarm",
        )
    return TASKS[name].from_dict(entries)
