"""The simulation that belongs to a task."""

from __future__ import annotations

from typing import Any

from heptarm.errors import CommandRejected
from heptarm.rl.sim.batch import BatchReach, Engine
from heptarm.rl.sim.contact_batch import BatchContact
from heptarm.rl.sim.episodes import BatchSettings, TaskBatch
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import Task


def simulate(
    task: Task, settings: BatchSettings | None = None, *, engine: Any = Engine, reveal: bool = False
) -> TaskBatch:
    """Many simulated arms in a task.

    Args:
        task: the task.
        settings: how many, and what differs between them.
        engine: class of the simulation's engine.
        reveal: whether observations end with what only the value network of a training sees.

    Raises:
        CommandRejected: another engine than MuJoCo on the processor, for a task with contacts.
    """
    if isinstance(task, ReachTask):
        return BatchReach(task, settings, engine=engine)
    if engine is not Engine:
        raise CommandRejected(
            f"{task.name} is simulated by MuJoCo on the processor alone", parameter="engine"
        )
    return BatchContact(task, settings, reveal=reveal)
