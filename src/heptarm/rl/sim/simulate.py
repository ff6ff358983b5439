"""The simulation that belongs to a task."""

from __future__ import annotations

from typing import Any

from heptarm.errors import CommandRejected
from heptarm.rl.peg import PegInHole
from heptarm.rl.sim.batch import BatchReach, Engine
from heptarm.rl.sim.episodes import TaskBatch
from heptarm.rl.sim.peg_batch import BatchPeg
from heptarm.rl.tasks import Task


def simulate(task: Task, *, engine: Any = Engine, reveal: bool = False, **given: Any) -> TaskBatch:
    """Many simulated arms in a task; the arguments are those of its class.

    Raises:
        CommandRejected: another engine than MuJoCo on the processor, for a task with contacts.
    """
    if not isinstance(task, PegInHole):
        return BatchReach(task, engine=engine, **given)
    if engine is not Engine:
        raise CommandRejected(
            f"{task.name} is simulated by MuJoCo on the processor alone", parameter="engine"
        )
    return BatchPeg(task, reveal=reveal, **given)
