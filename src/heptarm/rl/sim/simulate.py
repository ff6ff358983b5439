"""The simulation that belongs to a task."""

from __future__ import annotations

from typing import Any

from heptarm.rl.peg import PegInHole
from heptarm.rl.sim.batch import BatchReach
from heptarm.rl.sim.peg_batch import BatchPeg
from heptarm.rl.tasks import Task


def simulate(task: Task, **given: Any) -> BatchReach | BatchPeg:
    """Many simulated arms in a task; the arguments are those of its class."""
    return BatchPeg(task, **given) if isinstance(task, PegInHole) else BatchReach(task, **given)
