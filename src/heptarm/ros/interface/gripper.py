"""The action of a gripper behind two signals, control_msgs/GripperCommand, as MoveIt and other clients send it."""

from __future__ import annotations

import contextlib
import itertools
import threading
from collections.abc import Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from math import isfinite, nan
from typing import Any

from heptarm.errors import CommandRejected, HeptarmError, NotReady
from heptarm.ros.interface.action import FEEDBACK_PERIOD, ActionResult, GoalClient, GoalWork
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.trajectory.goal import GoalOutcome
from heptarm.skills.gripper import TwoSignalGripper

#: Parameters with the names of signals that every gripper needs.
_NEEDED = ("open", "close", "is_open", "is_closed")
#: Numbers of goals: each preempts those before it.
_numbers = itertools.count(1)


def gripper_command(context: NodeContext, goal: Any) -> GoalWork:
    """Open or close the gripper: it opens from half of `gripper.width` on, and closes below."""
    context.check_active()
    values = context.driver.configuration.values
    missing = [f"gripper.{name}" for name in _NEEDED if not values[f"gripper.{name}"]]
    if missing:
        raise NotReady(
            f"the node has no gripper: {', '.join(missing)} is empty",
            hint="set the parameters gripper.* to names of signals of the cabinet",
        )
    position = float(goal.command.position)
    if not isfinite(position):
        raise CommandRejected(
            f"position must be finite, got {position} m", parameter="position", value=position
        )
    if context.gripper is None:
        context.gripper = TwoSignalGripper(
            context.arm,
            **{name: values[f"gripper.{name}"] for name in _NEEDED},
            holds=values["gripper.holds"] or None,
            timeout=values["gripper.timeout"],
            settle=min(values["gripper.settle"], values["gripper.timeout"]),
        )
    width = values["gripper.width"]
    return _GripperGoal(context, context.gripper, width, opens=position >= 0.5 * width).run


class _GripperGoal:
    """A goal that opens or closes the gripper, in a thread of its own: the arm may move meanwhile."""

    def __init__(self, context: NodeContext, gripper: TwoSignalGripper, width: float, *, opens: bool) -> None:
        self._context, self._gripper = context, gripper
        self._width, self._opens = width, opens
        self._number = context.gripper_goal = next(_numbers)
        self._ended: Future[None] = Future()
        threading.Thread(target=self._command, name="heptarm-gripper").start()

    def _command(self) -> None:
        try:
            (self._gripper.open if self._opens else self._gripper.close)()
            self._ended.set_result(None)
        except Exception as error:  # `run` reports it
            self._ended.set_exception(error)

    def run(self, client: GoalClient) -> ActionResult:
        """Wait for the end switches. A cancelled goal waits no more; the valves keep their command."""
        while True:
            with contextlib.suppress(FutureTimeout):  # in Python 3.10 it is no TimeoutError
                self._ended.exception(timeout=FEEDBACK_PERIOD)
            if self._ended.done():
                break
            with contextlib.suppress(HeptarmError):  # no new state for a moment
                client.publish_feedback(self._fields(reached=False))
            if self._context.gripper_goal != self._number:
                return self._result(GoalOutcome.ABORTED, "preempted by another goal")
            if client.is_cancel_requested():
                return self._result(GoalOutcome.CANCELED, "cancelled; the gripper keeps its command")
        error = self._ended.exception()
        if self._context.gripper_goal != self._number:
            return self._result(GoalOutcome.ABORTED, "preempted by another goal")
        if isinstance(error, HeptarmError):
            return self._result(GoalOutcome.ABORTED, str(error))
        if error is not None:
            raise error
        fields = self._fields(reached=True)
        stalled = bool(fields["stalled"])
        fields = {**fields, "reached_goal": not stalled}
        text = "closed on something" if stalled else "open" if self._opens else "closed"
        return ActionResult(GoalOutcome.SUCCEEDED, text, fields)

    def _result(self, outcome: GoalOutcome, text: str) -> ActionResult:
        try:
            fields: Mapping[str, Any] = self._fields(reached=False)
        except HeptarmError:  # connection lost
            fields = {}
        return ActionResult(outcome, text, fields)

    def _fields(self, *, reached: bool) -> dict[str, Any]:
        """Fields of feedback and result; between its end switches the position of the gripper is not known: NaN."""
        gripper = self._gripper
        position = self._width if gripper.is_open else 0.0 if gripper.is_closed else nan
        stalled = reached and not self._opens and gripper.holds_something
        return {"position": position, "effort": 0.0, "stalled": stalled, "reached_goal": reached}
