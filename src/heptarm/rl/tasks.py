"""The tasks by their names, and a task out of a file."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

from heptarm.errors import CommandRejected, LimitError
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.pick_place import PickPlace
from heptarm.rl.contact.plug_insert import PlugInsert
from heptarm.rl.contact.polish import Polish
from heptarm.rl.contact.push import Push
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.task import ReachTask
from heptarm.values.robot import RobotModel

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


def deployed_task(task: object, kind: type[OfTask], robot: RobotModel) -> OfTask:
    """The task of a policy, before it is deployed.

    Args:
        task: the policy's.
        kind: of the tasks that are deployed here: `ReachTask`, or `ContactTask`.
        robot: the robot of the arm.

    Raises:
        CommandRejected: it is of another kind, or of none.
        LimitError: it was trained for another robot.
    """
    name = getattr(task, "name", type(task).__name__)
    if not isinstance(task, kind):
        wanted = f"the task {ReachTask.name}" if kind is ReachTask else "a task with contacts"
        raise CommandRejected(
            f"the policy must be of {wanted}, got one of {name}",
            parameter="policy",
            value=name,
            hint=f"heptarm.rl.{'deploy_contact' if kind is ReachTask else 'deploy'} deploys it",
        )
    if robot.name != task.model.name:
        raise LimitError(
            f"the policy was trained for the {task.model.title}; this is a {robot.title}",
            parameter="policy",
            value=task.robot,
            hint=f"train one with --robot {robot.name}",
        )
    return task


def _kind(name: object) -> type[Task]:
    if not isinstance(name, str) or name not in TASKS:
        raise CommandRejected(
            f"task must be one of {', '.join(TASKS)}, got {name!r}",
            parameter="task",
            value=name,
            hint="the file may be of a newer heptarm; your own task is registered by heptarm.rl.register(TASK)",
        )
    return TASKS[name]
