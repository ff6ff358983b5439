"""Goals that move the arm by one program: its start, feedback while it runs, and its result."""

from __future__ import annotations

import queue
import time
from collections.abc import Sequence
from typing import Any

from heptarm.arm.motion.handle import MotionHandle
from heptarm.ros.interface.action import (
    FEEDBACK_PERIOD,
    ActionResult,
    GoalClient,
    GoalWork,
    result_of_motion,
)
from heptarm.ros.interface.conditions import condition_of, reaction_of
from heptarm.ros.interface.context import NodeContext
from heptarm.ros.interface.events import event_message
from heptarm.values.motion.motion import Motion
from heptarm.values.result import MotionEvent


def run_motion(context: NodeContext, motion: Motion, *, speed: float | None = None) -> GoalWork:
    """Start a motion in place of any other.

    Args:
        context: of the node.
        motion: to start.
        speed: speed limit, (0, 1]; None: that of the parameter `speed`.
    """
    return ProgramGoal(context, context.driver.start(motion, speed=speed)).run


def start_program(context: NodeContext, goal: Any, program: Sequence[Motion]) -> GoalWork:
    """Start several motions as one program, with the speed, the condition and the reaction of a goal.

    Raises:
        HeptarmError: refused; the text gives the reason.
    """
    when: Any = getattr(goal, "when", "") or "replace"
    speed = None if goal.speed == 0.0 else goal.speed
    until, then = condition_of(goal.until), reaction_of(goal.then)
    handle = context.driver.start(program, speed=speed, until=until, then=then, when=when)
    return ProgramGoal(context, handle).run


class ProgramGoal:
    """A goal whose program moves the arm.

    Args:
        context: of the node.
        handle: of the program.
    """

    def __init__(self, context: NodeContext, handle: MotionHandle) -> None:
        self._ros, self._handle = context.ros, handle
        self._events: queue.SimpleQueue[MotionEvent] = queue.SimpleQueue()
        handle.add_event_callback(self._events.put)

    def run(self, client: GoalClient) -> ActionResult:
        """Wait until the program has ended; a cancelled one brakes on its path."""
        cancelled = False
        while not self._handle.done:
            self._publish(client)
            if not cancelled and client.is_cancel_requested():
                cancelled = True
                self._handle.cancel()
            time.sleep(FEEDBACK_PERIOD)
        self._publish(client)
        return result_of_motion(self._handle, cancelled=cancelled)

    def _publish(self, client: GoalClient) -> None:
        handle = self._handle
        count = self._events.qsize()
        events = [event_message(self._ros, handle.id, self._events.get()) for _ in range(count)]
        client.publish_feedback(
            {
                "progress": handle.progress,
                "item": max(handle.item, 0),
                "segment": handle.segment,
                "remaining": handle.remaining,
                "events": events,
            }
        )
