"""Execution of goals by a motion that follows commands from tick to tick, in a thread of its own."""

from __future__ import annotations

import logging
from abc import abstractmethod
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Protocol

from heptarm.arm.arm import Arm
from heptarm.bridge.execution import Listener, measured
from heptarm.bridge.goal import Goal, GoalRefused
from heptarm.bridge.runner import Runner, Settings, Step
from heptarm.bridge.trajectory import Sample
from heptarm.bridge.worker import Worker
from heptarm.errors import HeptarmError
from heptarm.io.clock import Clock

_log = logging.getLogger("heptarm.bridge")


class Follower(Protocol):
    """A motion that follows commands, tick by tick."""

    @property
    def why(self) -> str:
        """Why it has ended."""
        ...

    def tick(self) -> float | None:
        """Wait for the next tick; the time for which to command now [s], None: the motion has ended."""
        ...

    def follow(self, step: Step) -> None:
        """Do what the runner wants."""
        ...


class Following(Worker):
    """Executes goals in a motion that opens with a goal and closes a moment after the last one.

    In between the arm is free for others.

    Args:
        arm: in control.
        names: of its joints, seven.
        listener: hears of goals.
        linger: how long the motion stays open after a goal [s].
        settings: how to run goals.
        clock: the arm's.
    """

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: Listener,
        *,
        linger: float = 0.5,
        settings: Settings | None = None,
        clock: Clock | None = None,
    ) -> None:
        super().__init__(arm, listener, clock)
        self._linger = linger
        self._runner = Runner(names, arm.robot, settings)
        self._dropped = False
        self._is_open = False
        self._thread.start()

    @property
    def settings(self) -> Settings:
        """How goals are run; exchange it, and the next goal has it."""
        return self._runner.settings

    @settings.setter
    def settings(self, value: Settings) -> None:
        with self._changed:
            self._runner.settings = value

    @property
    def busy(self) -> bool:
        """Whether a goal is under way or the arm brakes after one."""
        return self._runner.busy

    @property
    def goal(self) -> int:
        """Number of the goal under way; 0: none."""
        return self._runner.goal

    def accept(self, goal: Goal) -> int:
        """Take a goal; see `Execution`."""
        try:
            state = measured(self._arm.state)
        except HeptarmError as error:
            raise GoalRefused(f"nothing is known of the arm: {error}") from error
        with self._changed:
            if self._closing:
                raise GoalRefused("the execution is closed")
            number = self._runner.accept(goal, now=self.now, state=state)
            if self._runner.warning:
                _log.warning("goal %d: all default tolerances count: %s", number, self._runner.warning)
            self._changed.notify_all()
            return number

    def at(self, time: float) -> Sample | None:
        """What the goal under way wants at a time; see `Execution`."""
        with self._changed:
            return self._runner.at(time)

    def cancel(self, number: int) -> bool:
        """End a goal early; the arm brakes. False: it is not under way."""
        with self._changed:
            cancelled = self._runner.cancel(number, self.now)
            self._changed.notify_all()
            return cancelled

    def abort(self, text: str) -> None:
        """End the goal under way because of something outside; the arm brakes."""
        with self._changed:
            self._runner.abort(text, now=self.now)
            self._changed.notify_all()

    def drop(self, text: str) -> None:
        """Likewise, but nothing more is commanded: a stop of the safety controller holds the arm already."""
        with self._changed:
            self._runner.abort(text)
            self._dropped = True
            self._changed.notify_all()

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing runs and the servo motion is closed; False: not within `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._runner.busy and not self._is_open, timeout)

    # ------------------------------------------------------------------------------------ thread

    def _wait(self) -> bool:
        with self._changed:
            self._changed.wait_for(lambda: self._closing or self._runner.busy)
            if self._runner.busy:
                return True
            ends = self._runner.ends()
        self._tell(None, ends)
        return False

    @abstractmethod
    def _motion(self) -> AbstractContextManager[Follower]:
        """A motion that follows commands."""

    def _work(self) -> None:
        """One motion: from the first goal to some time after the last one."""
        self._dropped = False
        with self._motion() as follower:
            self._is_open = True
            last = None
            while (now := follower.tick()) is not None:
                state = measured(self._arm.state)
                with self._changed:
                    step = self._runner.advance(now, state)
                    busy = self._runner.busy
                follower.follow(step)
                self._tell(step.feedback, step.ends)
                last = now if busy or last is None else last
                if not busy and (self._closing or self._dropped or now - last >= self._linger):
                    break
        with self._changed:
            if now is None:
                self._runner.abort(f"the motion ended: {follower.why}")
            self._runner.forget()
            self._is_open = False
            ends = self._runner.ends()
            self._changed.notify_all()
        self._tell(None, ends)

    def _lose(self, text: str) -> None:
        """The arm follows no more."""
        with self._changed:
            self._runner.abort(text)
            self._is_open = False
            ends = self._runner.ends()
            self._changed.notify_all()
        self._tell(None, ends)
