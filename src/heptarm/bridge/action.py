"""What all actions of the nodes share but for trajectories: a row of their table, their clients, their ends."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isnan
from typing import Any, Protocol, TypeAlias

from heptarm.arm.handle import MotionHandle
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.bridge.messages import Ros, put
from heptarm.bridge.task import Task
from heptarm.errors import HeptarmError
from heptarm.values.result import Cause

#: How often progress is told [s].
PERIOD = 0.05


class Client(Protocol):
    """Who has sent a goal."""

    def tell(self, fields: Mapping[str, Any]) -> None:
        """Feedback, of the fields that its type has."""
        ...

    def has_cancelled(self) -> bool:
        """Whether it does not want the goal any more."""
        ...


@dataclass(frozen=True, slots=True)
class Ended:
    """How a goal ended.

    Attributes:
        outcome: in what state.
        text: what happened, in words.
        fields: further fields of the result, of those that its type has.
        success: whether it did what it should; None: if it succeeded.
    """

    outcome: Outcome
    text: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    success: bool | None = None

    def fill(self, result: Any) -> Any:
        """The result of an action."""
        success = self.outcome is Outcome.SUCCEEDED if self.success is None else self.success
        fill(result, {"success": success, "message": self.text, **self.fields})
        return result


#: Carries a goal out and waits for its end.
Work: TypeAlias = Callable[[Client], Ended]


@dataclass(frozen=True, slots=True)
class Action:
    """An action of the nodes.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type"; its results have `success` and `message`.
        begin: what a goal begins, of an instance of the class that the nodes offer; it raises HeptarmError: refused.
    """

    name: str
    type: str
    begin: Callable[[Any, Any], Work]


class Doing:
    """What actions work with.

    Args:
        driver: whose arm it is.
        ros: of which ROS the goals are.
    """

    def __init__(self, driver: Driver, ros: Ros) -> None:
        self._driver = driver
        self._arm = driver.arm
        self._ros = ros


def fill(message: Any, fields: Mapping[str, Any]) -> None:
    """Give those fields values that a message has."""
    put(message, {name: value for name, value in fields.items() if hasattr(message, name)})


def end_of(handle: MotionHandle, *, cancelled: bool) -> Ended:
    """How a motion ended that is done.

    Args:
        handle: of the motion.
        cancelled: whether the goal's client has cancelled it.
    """
    try:
        result = handle.wait(timeout=PERIOD)
    except HeptarmError as error:
        return Ended(Outcome.ABORTED, str(error))
    fields: dict[str, Any] = {
        "residual": 0.0 if isnan(result.residual) else result.residual,
        "item": result.item,
        "stopped_by": "",
    }
    if result.cause is Cause.FINISHED:
        return Ended(Outcome.SUCCEEDED, "the arm has arrived", fields)
    if result.cause is Cause.CONDITION:
        fired = "the condition" if result.stopped_by is None else str(result.stopped_by)
        return Ended(Outcome.SUCCEEDED, f"ended by {fired}", {**fields, "stopped_by": fired})
    if result.cause is Cause.CANCELLED:
        # whoever cancels it here, by a stop or by the goal of a trajectory, is not the action's client
        outcome = Outcome.CANCELED if cancelled else Outcome.ABORTED
        return Ended(outcome, "cancelled; the arm braked on its path", fields)
    return Ended(Outcome.PREEMPTED, "another motion took the place of this one", fields)


def watch(task: Task, client: Client, tell: Callable[[], None]) -> HeptarmError | None:
    """Wait until a task has ended, and end it when its client has cancelled it.

    Args:
        task: what to wait for.
        client: of the goal.
        tell: tells how far it is, again and again.

    Returns:
        What went wrong; None: nothing.
    """
    try:
        while not task.wait(PERIOD):
            with contextlib.suppress(HeptarmError):  # no news for a moment
                tell()
            if client.has_cancelled():
                task.end("cancelled")
    except BaseException:
        task.end("nobody waits for it")
        raise
    try:
        task.result()
    except HeptarmError as error:
        return error
    return None


def failure(task: Task, client: Client, error: HeptarmError) -> Ended:
    """How a goal ended whose task was ended, or went wrong."""
    if task.why and client.has_cancelled():
        return Ended(Outcome.CANCELED, "cancelled; the arm braked on its path")
    return Ended(Outcome.ABORTED, f"{task.what} has ended: {task.why}" if task.why else str(error))
