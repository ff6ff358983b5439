"""The queue of the simulated controller: accepted commands, each planned from the end of the one before."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from heptarm.planning.motion import PlanError
from heptarm.planning.plan import Plan
from heptarm.planning.planner import plan
from heptarm.sim.controller.command import MotionCommand
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel


class QueuedMotion(NamedTuple):
    """A waiting command.

    Attributes:
        serial: its number among all accepted commands.
        command: the command.
        plan: from the end of the one before it; None: that end is not known.
    """

    serial: int
    command: MotionCommand
    plan: Plan | None


class Cancellation(NamedTuple):
    """A cancellation that the next tick executes.

    Attributes:
        newest: serial of the newest command at that time; later ones are not affected.
        order_id: which one; None: all.
        fast: the running motion leaves its path.
    """

    newest: int
    order_id: int | None
    fast: bool

    def affects(self, serial: int, command: MotionCommand) -> bool:
        """Whether it cancels a command."""
        return serial <= self.newest and self.order_id in (None, command.id)


class MotionQueue:
    """Waiting commands; added and cancelled from any thread, taken by the tick's thread.

    Args:
        robot: the robot.
        rest: set-point while no command runs, shape (7,) [rad].
    """

    def __init__(self, robot: RobotModel, rest: Callable[[], Array]) -> None:
        self._robot, self._rest = robot, rest
        self._planning = threading.Lock()  # one caller plans at a time; the tick never waits for it
        self._lock = threading.Lock()  # held for a few instructions only
        self._serial = 0  # of the newest accepted command
        self._inbox: deque[QueuedMotion] = deque()
        self._cancels: deque[Cancellation] = deque()
        self._tail: Array | None = None  # end of the last accepted command; None: not known
        self._open = 0  # accepted commands that have not ended
        self._cancel_count = 0

    @property
    def idle(self) -> bool:
        """Whether no command is running or waiting."""
        return self._open == 0

    @property
    def is_quiet(self) -> bool:
        """Whether it is idle and the next tick has no cancellation to execute."""
        return self._open == 0 and not self._cancels

    @property
    def is_interrupted(self) -> bool:
        """Whether the next tick has a cancellation to execute."""
        return bool(self._cancels)

    def submit(self, command: MotionCommand) -> None:
        """Plan a command from the end of the queue and append it.

        While the arm brakes, its final position is not known; then the command is planned when its turn comes, and
        its listener receives a planning error.

        Raises:
            PlanError: it cannot be planned; nothing has changed.
        """
        with self._planning:
            with self._lock:
                start = self._rest() if self._open == 0 else self._tail
                cancels = self._cancel_count
            planned = None if start is None else self._plan(command, start)
            with self._lock:
                if cancels != self._cancel_count:
                    planned = None  # the end of the running motion is not known any more
                self._tail = None if planned is None else planned.end
                self._open += 1
                self._serial += 1
                self._inbox.append(QueuedMotion(self._serial, command, planned))

    def _plan(self, command: MotionCommand, start: Array) -> Plan:
        return plan(self._robot, command.motion, start, tcp=command.tcp)

    def cancel(self, order_id: int | None, *, fast: bool) -> None:
        """Cancel a command (None: all) in the next tick."""
        with self._lock:
            self._tail = None
            self._cancel_count += 1
            self._cancels.append(Cancellation(self._serial, order_id, fast))

    def cancelled(self) -> list[Cancellation]:
        """The cancellations to execute, in their order."""
        return [self._cancels.popleft() for _ in range(len(self._cancels))]

    def drop(self, cancellations: Sequence[Cancellation]) -> None:
        """Drop the waiting commands that are cancelled, in one pass: an application may cancel a thousand at once."""
        newest = {one.order_id: one.newest for one in cancellations}  # the last of an id is the newest
        dropped: list[MotionCommand] = []
        with self._lock:
            for _ in range(len(self._inbox)):
                motion = self._inbox.popleft()
                if motion.serial <= max(newest.get(None, 0), newest.get(motion.command.id, 0)):
                    dropped.append(motion.command)
                else:
                    self._inbox.append(motion._replace(plan=None))
        for command in dropped:
            self.close(command, "cancelled", "")

    def diverge(self) -> None:
        """Forget the planned end of the running command: it will end elsewhere."""
        with self._lock:
            self._tail = None

    def take(self) -> QueuedMotion | None:
        """The next command; None: none waits."""
        return self._inbox.popleft() if self._inbox else None

    def planned(self, motion: QueuedMotion, here: Array) -> Plan | None:
        """The plan of the next command from the present position [rad]; None: it ended by a planning error."""
        if motion.plan is not None and float(np.abs(motion.plan.start - here).max()) <= 1e-9:
            return motion.plan
        try:
            planned = self._plan(motion.command, here.copy())
        except PlanError as error:
            self.close(motion.command, "error", str(error))
            return None
        with self._lock:
            if motion.serial == self._serial:
                self._tail = planned.end
        return planned

    def close(self, command: MotionCommand, cause: str, text: str) -> None:
        """Report the end of a command to its listener."""
        with self._lock:
            self._open -= 1
        if command.listener is not None:
            command.listener.finished(cause, text)
