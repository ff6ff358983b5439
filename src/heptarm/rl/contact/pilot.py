"""Turns what an arm measures into set-points of a task with contacts, decision by decision: no arm, loop or clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from heptarm.rl.contact.task import ContactTask, Moment
from heptarm.rl.pilot import Decisions
from heptarm.rl.policy import Policy
from heptarm.values.checks import Array

#: An episode is over when nothing has been missing for so long [s].
_SETTLED = 0.5


class ContactPilot:
    """An episode of a policy; poses, wrenches and set-points are in the frame of the task, rotations as vectors.

    Args:
        policy: of a task with contacts.
        steps: most decisions of an episode; None: as many as in training.

    Attributes:
        task: the policy's.
        now: what was measured last, with the set-point in force.
    """

    def __init__(self, policy: Policy[Any], *, steps: int | None = None) -> None:
        self.task: ContactTask = policy.task
        self._most = self.task.steps if steps is None else steps
        self._decisions = Decisions(policy, rate=self.task.rate)
        self._frames: deque[Array] = deque()
        self._step = self._settled = 0
        self.now = Moment(np.zeros(6), self.task.begin(np.zeros(6)), np.zeros(6), np.zeros(0))

    @property
    def missing(self) -> float:
        """What is missing as far as the arm can tell [m]."""
        return float(self.task.left(self.now))

    @property
    def is_over(self) -> bool:
        """Whether nothing has been missing for half a second, or the episode has had all of its decisions."""
        return self._settled >= _SETTLED * self.task.rate or self._step >= self._most

    def begin(self, pose: Array, target: Array, bodies: Mapping[str, Array], *, q: Array) -> None:
        """Start an episode with the arm at rest.

        Args:
            pose: of the tip, shape (6,) [m, rad].
            target: what the episode is about, shape (k,).
            bodies: poses of the free bodies that the task looks at, shape (6,) each.
            q: joint positions, shape (7,) [rad].
        """
        self._decisions.begin()
        task, memory = self.task, np.zeros(self.task.memory_size)
        self.now = Moment(pose, task.begin(pose), np.zeros(6), target, bodies=bodies, memory=memory, q=q)
        self._frames = deque([task.frame(self.now)] * (max(task.history) + 1))
        self._step = self._settled = 0

    def decide(self) -> tuple[Array, Array]:
        """Ask the policy.

        Returns:
            The set-point in force, and the one to be in force at the next decision, shape (command_size,) each.

        Raises:
            CommandRejected: the policy diverges.
        """
        last = self.now.command
        action = self._decisions.action(self.task.observe(np.array(self._frames)))
        command = self.task.advance(last, self.now.pose, action)
        self._decisions.check(action, last, command)
        self.now = replace(self.now, command=command)
        return last, command

    def measure(self, pose: Array, wrench: Array, bodies: Mapping[str, Array], *, q: Array) -> None:
        """Take what has become of a decision.

        Args:
            pose: of the tip, shape (6,) [m, rad].
            wrench: on the tip, its mean since the decision less that before the episode, shape (6,) [N, Nm].
            bodies: see `begin`.
            q: joint positions, shape (7,) [rad].
        """
        task = self.task
        now = replace(self.now, pose=pose, wrench=wrench, bodies=bodies, q=q)
        self._step += 1
        self.now = replace(now, memory=task.remember(now), time=np.array(self._step / task.rate))
        self._frames.appendleft(task.frame(self.now))
        self._frames.pop()
        self._settled = self._settled + 1 if self.missing <= task.radius else 0
