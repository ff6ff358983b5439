"""A policy at the wheel: what it decides becomes a command that a guard has passed. No arm, no loop, no clock."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from heptarm.rl.guard import Guard, Watch
from heptarm.rl.task import ReachTask
from heptarm.values.arrays import Array


class Decides(Protocol):
    """What can be deployed: a `Policy`, or anything else that decides."""

    task: ReachTask

    def __call__(self, observation: Array, /) -> npt.NDArray[np.floating[Any]]:
        """The action, shape (actions,), within +-1."""


class Pilot:
    """Turns measured joints and a target into the next commanded joints, decision by decision.

    Args:
        policy: what decides.
        guard: what it may not do.

    Attributes:
        task: the policy's.
        watch: the guard on duty; its `counts` tell how often it stepped in.
    """

    def __init__(self, policy: Decides, guard: Guard | None = None) -> None:
        self.task = policy.task
        self.watch = Watch(guard or Guard(), self.task.model, period=1.0 / self.task.rate)
        self._policy = policy
        self._command = self._held = np.empty(0)

    def begin(self, q: Array) -> None:
        """An episode begins here, shape (7,) [rad]."""
        self._command, self._held = q, self.task.hold(q)

    def decide(self, q: Array, dq: Array, target: Array) -> Array:
        """The next command.

        Args:
            q: measured joint positions, shape (7,) [rad].
            dq: measured velocities, shape (7,) [rad/s].
            target: for the flange, base frame, shape (3,) [m].

        Returns:
            Commanded joint positions for the next 1 / `task.rate` seconds, shape (7,) [rad].
        """
        action = self._policy(self.task.observe(q, dq, target)).astype(np.float64)
        wanted = self.task.advance(self._command, q, action, self._held)
        self._command = self.watch.allow(self._command, wanted)
        return self._command
