"""Turns decisions of a policy into commands that a guard has checked. Without arm, loop or clock."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from math import ceil
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError
from heptarm.model.kinematics import forward
from heptarm.rl.task import ReachTask
from heptarm.values.checks import Array, array, within
from heptarm.values.robot import RobotModel

#: A policy that decides the same for so long, without effect, diverges [s]; a command that is still [m, rad].
_STUCK, _STILL = 2.0, 1e-6
_DIVERGES = "the policy diverges: train it again, or evaluate it with `heptarm rl eval`"


@dataclass(frozen=True, slots=True)
class PolicyGuard:
    """Limits of a deployment.

    Attributes:
        low: corner of the box that the flange stays in, base frame, shape (3,) [m].
        high: the opposite corner [m].
        margin: kept from every joint's limits [rad].
        speed: of the commanded joints at most [rad/s].
        stale: an older state ends the deployment [s].

    Raises:
        LimitError: the box has no volume, or a limit is not positive.
    """

    _: KW_ONLY
    low: tuple[float, float, float] = (0.30, -0.50, 0.10)
    high: tuple[float, float, float] = (0.95, 0.50, 0.95)
    margin: float = 0.05
    speed: float = 1.3
    stale: float = 0.25

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            object.__setattr__(self, name, tuple(array(getattr(self, name), 3, name).tolist()))
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            raise LimitError(
                f"low must be below high so that the box has a volume, got {self.low} and {self.high} m",
                code=2,
                parameter="low",
            )
        within(self.margin, "margin", 0.0, 1.0, unit="rad")
        within(self.speed, "speed", 0.0, 10.0, above=True, unit="rad/s")
        within(self.stale, "stale", 0.0, 60.0, above=True, unit="s")

    def check(self, target: Array) -> Array:
        """Return a target, base frame, shape (3,) [m], if it is inside the box.

        Raises:
            LimitError: it is outside.
        """
        if (target >= self.low).all() and (target <= self.high).all():
            return target
        raise LimitError(
            f"the target {np.round(target, 3).tolist()} m is outside the guard's box",
            code=2,
            parameter="target",
            value=target.tolist(),
            allowed=f"{list(self.low)} to {list(self.high)} m",
            hint="choose another target, or a guard with a larger box",
        )


class Watch:
    """An active guard: passes or limits commands, and counts its interventions.

    Args:
        guard: the limits.
        robot: the robot.
        period: of the commands [s].

    Attributes:
        counts: how often it stepped in, by "joint", "speed", "box".
    """

    def __init__(self, guard: PolicyGuard, robot: RobotModel, *, period: float) -> None:
        self._guard, self._robot = guard, robot
        self._step = guard.speed * period
        self._low, self._high = robot.q_min + guard.margin, robot.q_max - guard.margin
        self.counts = Counter(joint=0, speed=0, box=0)

    def allow(self, last: Array, wanted: Array) -> Array:
        """The allowed command, shape (7,) [rad].

        A command beyond the joint margins or the speed limit is clamped; one that moves the flange out
        of the box (or farther out of it) is rejected: the arm holds its last command.
        """
        allowed = np.minimum(np.maximum(wanted, self._low), self._high)
        self.counts["joint"] += bool((allowed != wanted).any())
        bounded = np.minimum(np.maximum(allowed, last - self._step), last + self._step)
        self.counts["speed"] += bool((bounded != allowed).any())
        if self._outside(bounded) > self._outside(last):
            self.counts["box"] += 1
            return last
        return bounded

    def _outside(self, q: Array) -> float:
        """Distance of the flange from the box [m]; 0 inside."""
        tip = forward(self._robot, q)[:3, 3]
        return float(np.maximum(np.maximum(self._guard.low - tip, tip - self._guard.high), 0.0).max())


class Decides(Protocol):
    """Interface of what can be deployed: a `Policy`, or another function."""

    task: ReachTask

    def __call__(self, observation: Array, /) -> npt.NDArray[np.floating[Any]]:
        """The action, shape (actions,), within +-1."""


class Decisions:
    """Asks a policy for its actions, and refuses those of one that diverges.

    Args:
        policy: what decides.
        rate: decisions a second [Hz].
    """

    def __init__(self, policy: Callable[[Array], npt.NDArray[np.floating[Any]]], *, rate: float) -> None:
        self._policy, self._most = policy, ceil(_STUCK * rate)
        self._last, self._count = np.empty(0), 0

    def begin(self) -> None:
        """Start an episode."""
        self._last, self._count = np.empty(0), 0

    def action(self, observation: Array) -> Array:
        """The action for an observation.

        Raises:
            CommandRejected: it is not finite.
        """
        action = np.asarray(self._policy(observation), dtype=np.float64)
        if not np.isfinite(action).all():
            raise CommandRejected(
                f"an action of the policy must be finite, got {action.tolist()}",
                parameter="policy",
                hint=_DIVERGES,
            )
        return action

    def check(self, action: Array, before: Array, command: Array) -> None:
        """Refuse a policy that saturates: for seconds the same action, all of it at its bounds, and no more effect.

        Args:
            action: of this decision.
            before: the last command.
            command: what the action made of it.

        Raises:
            CommandRejected: it does.
        """
        is_same = bool((np.abs(action) >= 1.0).all()) and np.array_equal(np.sign(action), self._last)
        self._count = self._count + 1 if is_same and np.abs(command - before).max() <= _STILL else 0
        self._last = np.sign(action)
        if self._count >= self._most:
            raise CommandRejected(
                f"an action of the policy must not be at its bounds in every direction for {_STUCK:g} s while the "
                f"command is at its limits, got {action.tolist()}",
                parameter="policy",
                hint=_DIVERGES,
            )


class Pilot:
    """Turns measured joints and a target into the next commanded joints, decision by decision.

    Args:
        policy: what decides.
        guard: what it may not do.

    Attributes:
        task: the policy's.
        watch: the guard on duty; its `counts` tell how often it stepped in.
    """

    def __init__(self, policy: Decides, guard: PolicyGuard | None = None) -> None:
        self.task = policy.task
        self.watch = Watch(guard or PolicyGuard(), self.task.model, period=1.0 / self.task.rate)
        self._decisions = Decisions(policy, rate=self.task.rate)
        self._command = self._held = np.empty(0)

    def begin(self, q: Array) -> None:
        """Start an episode at joint positions, shape (7,) [rad]."""
        self._command, self._held = q, self.task.hold(q)
        self._decisions.begin()

    def decide(self, q: Array, dq: Array, target: Array) -> Array:
        """The next command.

        Args:
            q: measured joint positions, shape (7,) [rad].
            dq: measured velocities, shape (7,) [rad/s].
            target: for the flange, base frame, shape (3,) [m].

        Returns:
            Commanded joint positions for the next 1 / `task.rate` seconds, shape (7,) [rad].

        Raises:
            CommandRejected: the policy diverges.
        """
        action = self._decisions.action(self.task.observe(q, dq, target))
        wanted = self.task.advance(self._command, q, action, self._held)
        before, self._command = self._command, self.watch.allow(self._command, wanted)
        self._decisions.check(action, before, self._command)
        return self._command
