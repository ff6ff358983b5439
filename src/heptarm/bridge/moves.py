"""Actions that are one program of motions: what a goal asks for, and how far it is until it ends; free of ROS."""

from __future__ import annotations

import queue
import time
from collections.abc import Sequence
from functools import partial
from typing import Any

from heptarm.arm.handle import MotionHandle
from heptarm.bridge import motions
from heptarm.bridge.action import PERIOD, Action, Client, Doing, Ended, Work, end_of
from heptarm.bridge.conditions import condition_of
from heptarm.bridge.events import event_message, with_triggers
from heptarm.bridge.order import positions
from heptarm.errors import CommandRejected
from heptarm.values.circ import circ
from heptarm.values.event import MotionEvent
from heptarm.values.motion import TOOL, Motion, lin, ptp
from heptarm.values.spline import spline, spline_joints


class Moves(Doing):
    """Single motions and programs; unless a goal says another it takes the place of whatever runs."""

    def joints(self, goal: Any) -> Work:
        """Move to joint positions."""
        return self._single(goal, ptp(positions(self._driver, goal.joint_names, goal.position)))

    def pose(self, goal: Any) -> Work:
        """Move to a pose."""
        base = self._driver.configuration.frame("base")
        moving = goal.moving or TOOL
        how: dict[str, Any] = {"moving": moving}
        if goal.speed_mps:
            how["speed_mps"] = goal.speed_mps
        if goal.path == motions.LIN_REL:
            return self._single(goal, motions.offset(goal.pose, how))
        pose = motions.stamped_pose(goal.pose, base)
        if goal.path == motions.PTP:
            return self._single(goal, ptp(pose, moving=moving))
        if goal.path == motions.LIN:
            return self._single(goal, lin(pose, **how))
        if goal.path == motions.CIRC:
            return self._single(goal, circ(motions.stamped_pose(goal.via, base), pose, **how))
        raise CommandRejected(
            f"path is {goal.path}; 0 (PTP), 1 (LIN), 2 (CIRC) or 3 (LIN_REL) is wanted",
            parameter="path",
            value=goal.path,
        )

    def spline(self, goal: Any) -> Work:
        """Move along a curve."""
        if len(goal.segments) and len(goal.position):
            raise CommandRejected(
                "a spline goes through segments or through joint positions",
                parameter="segments",
                hint="give one",
            )
        if len(goal.position):
            points = motions.joint_points(self._driver, goal.joint_names, goal.position)
            return self._single(goal, spline_joints(points))
        how: dict[str, Any] = {
            name: getattr(goal, name) for name in ("speed_mps", "acceleration_mps2") if getattr(goal, name)
        }
        segments = [motions.segment_of(one) for one in goal.segments]
        return self._single(goal, spline(segments, moving=goal.moving or TOOL, **how))

    def program(self, goal: Any) -> Work:
        """Carry several motions out."""
        return self._start(goal, motions.program_of(self._driver, goal.motions))

    def _single(self, goal: Any, motion: Motion) -> Work:
        return self._start(goal, (with_triggers(motion, goal.triggers),))

    def _start(self, goal: Any, program: Sequence[Motion]) -> Work:
        when: Any = getattr(goal, "when", "") or "replace"
        speed = None if goal.speed == 0.0 else goal.speed
        handle = self._driver.start(program, speed=speed, until=condition_of(goal.until), when=when)
        news: queue.SimpleQueue[MotionEvent] = queue.SimpleQueue()
        handle.add_event_callback(news.put)
        return partial(self._follow, handle, news)

    def _follow(self, handle: MotionHandle, news: queue.SimpleQueue[MotionEvent], client: Client) -> Ended:
        """Wait until a motion has ended, and cancel it when asked to; the arm brakes on its path then."""
        cancelled = False
        while not handle.done:
            self._tell(handle, news, client)
            if not cancelled and client.has_cancelled():
                cancelled = True
                handle.cancel()
            time.sleep(PERIOD)
        self._tell(handle, news, client)
        return end_of(handle, cancelled=cancelled)

    def _tell(self, handle: MotionHandle, news: queue.SimpleQueue[MotionEvent], client: Client) -> None:
        events = [event_message(self._ros, handle.id, news.get()) for _ in range(news.qsize())]
        client.tell(
            {
                "progress": handle.progress,
                "item": max(handle.item, 0),
                "segment": handle.segment,
                "remaining": handle.remaining,
                "events": events,
            }
        )


#: All of them.
MOVES = (
    Action("~/move_joints", "heptarm_msgs/MoveJoints", Moves.joints),
    Action("~/move_pose", "heptarm_msgs/MovePose", Moves.pose),
    Action("~/move_spline", "heptarm_msgs/MoveSpline", Moves.spline),
    Action("~/run_program", "heptarm_msgs/RunProgram", Moves.program),
)
