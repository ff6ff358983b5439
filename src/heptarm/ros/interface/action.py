"""A row of the table of actions, results, and the dispatcher that begins and carries out goals."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from math import isnan
from typing import Any, Protocol, TypeAlias

from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import HeptarmError, NotReady
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.messages import put
from heptarm.ros.node.task import ArmTask
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.values.result import Cause, Result

_log = logging.getLogger("heptarm.ros")

#: Period of feedback [s].
FEEDBACK_PERIOD = 0.05
#: Most active goals of all actions together: each takes a thread.
MAX_GOALS = 8


class GoalClient(Protocol):
    """The client of a goal."""

    def publish_feedback(self, fields: Mapping[str, Any]) -> None:
        """Publish feedback, of the fields that its type has."""
        ...

    def is_cancel_requested(self) -> bool:
        """Whether the client has requested to cancel the goal."""
        ...


@dataclass(frozen=True, slots=True)
class ActionResult:
    """How a goal ended.

    Attributes:
        outcome: its final state.
        text: what happened.
        fields: further fields of the result, of those that its type has.
        success: field of the result; None: whether the outcome is a success.
    """

    outcome: GoalOutcome
    text: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    success: bool | None = None

    def fill(self, result: Any) -> Any:
        """Fill a ROS result."""
        success = self.outcome is GoalOutcome.SUCCEEDED if self.success is None else self.success
        error = "" if success else self.text  # of a result of iiwa_stack
        fill(result, {"success": success, "message": self.text, "error": error, **self.fields})
        return result


#: Carries a goal out and returns when it has ended.
GoalWork: TypeAlias = Callable[[GoalClient], ActionResult]


@dataclass(frozen=True, slots=True)
class RosAction:
    """An action of the nodes.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type"; a result of our own has `success` and `message`.
        begin: begins a goal; raises HeptarmError to refuse it.
    """

    name: str
    type: str
    begin: Callable[[NodeContext, Any], GoalWork]


class ActionDispatcher:
    """Begins goals and carries them out, at most `MAX_GOALS` at a time.

    Args:
        context: of the node.
    """

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._places = threading.BoundedSemaphore(MAX_GOALS)

    def begin(self, action: RosAction, goal: Any) -> GoalWork:
        """Begin a goal; the caller has to call the returned work.

        Args:
            action: its row.
            goal: of its type.

        Raises:
            HeptarmError: refused; the text gives the reason.
        """
        if not self._places.acquire(blocking=False):
            raise NotReady(f"{MAX_GOALS} goals are active", hint="wait for one of them, or cancel it")
        try:
            work = action.begin(self._context, goal)
        except BaseException as error:
            self._places.release()
            if isinstance(error, HeptarmError) or not isinstance(error, Exception):
                raise
            _log.exception(
                "beginning a goal"
            )  # a goal that is neither accepted nor refused would wait for ever
            raise NotReady(f"internal error of the node: {error!r}") from error
        return partial(self._carry_out, action.name, work)

    def _carry_out(self, name: str, work: GoalWork, client: GoalClient) -> ActionResult:
        try:
            result = work(client)
            if result.outcome is GoalOutcome.ABORTED:
                _log.warning("%s: %s", name, result.text)  # not every type of result has a text
            return result
        except Exception as error:  # a goal without a result would block its client for ever
            _log.exception("carrying out a goal")
            return ActionResult(GoalOutcome.ABORTED, f"internal error of the node: {error!r}")
        finally:
            self._places.release()


def fill(message: Any, fields: Mapping[str, Any]) -> None:
    """Fill a message with those fields that its type has."""
    put(message, {name: value for name, value in fields.items() if hasattr(message, name)})


def result_of_motion(handle: MotionHandle, *, cancelled: bool) -> ActionResult:
    """Convert the result of a motion that has ended.

    Args:
        handle: of the motion.
        cancelled: whether the client of the goal has cancelled it.
    """
    try:
        result = handle.wait(timeout=FEEDBACK_PERIOD)
    except HeptarmError as error:
        return ActionResult(GoalOutcome.ABORTED, str(error))
    return ended(result, cancelled=cancelled)


def ended(result: Result, *, cancelled: bool) -> ActionResult:
    """Convert the result of a motion.

    Args:
        result: of the motion.
        cancelled: whether the client of the goal has cancelled it.
    """
    fields: dict[str, Any] = {
        "residual": 0.0 if isnan(result.residual) else result.residual,
        "item": result.item,
        "stopped_by": "",
        "peak_force": result.peak_force,
        "rest_force": result.rest_force,
    }
    if result.cause is Cause.FINISHED:
        return ActionResult(GoalOutcome.SUCCEEDED, "goal reached", fields)
    if result.cause is Cause.CONDITION:
        condition = "the condition" if result.stopped_by is None else str(result.stopped_by)
        return ActionResult(
            GoalOutcome.SUCCEEDED, f"ended by {condition}", {**fields, "stopped_by": condition}
        )
    if result.cause is Cause.CANCELLED:
        # a stop or a trajectory goal may have cancelled it, which is not a request of the action's client
        outcome = GoalOutcome.CANCELED if cancelled else GoalOutcome.ABORTED
        return ActionResult(outcome, "cancelled; the arm braked on its path", fields)
    return ActionResult(GoalOutcome.PREEMPTED, "preempted by another motion", fields)


def wait_for_task(task: ArmTask, client: GoalClient, report: Callable[[], None]) -> HeptarmError | None:
    """Wait until a task has ended, and end it when its client cancels the goal.

    Args:
        task: to wait for.
        client: of the goal.
        report: publishes feedback; called periodically.

    Returns:
        The error of the task; None: it succeeded.
    """
    try:
        while not task.wait(FEEDBACK_PERIOD):
            with contextlib.suppress(HeptarmError):  # no new state for a moment
                report()
            if client.is_cancel_requested():
                task.end("cancelled")
    except BaseException:
        task.end("its goal failed")
        raise
    try:
        task.result()
    except HeptarmError as error:
        return error
    return None


def result_of_failed_task(task: ArmTask, client: GoalClient, error: HeptarmError) -> ActionResult:
    """Convert the error of a task that was ended, or that failed."""
    if task.end_reason and client.is_cancel_requested():
        return ActionResult(GoalOutcome.CANCELED, "cancelled; the arm braked on its path")
    text = f"{task.name} was ended: {task.end_reason}" if task.end_reason else str(error)
    return ActionResult(GoalOutcome.ABORTED, text)
