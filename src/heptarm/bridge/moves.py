"""Motions as actions: one table for both nodes, what a goal asks for, and how far it is until it ends; free of ROS.

A node makes an action of every row of `MOVES`::

    handle = start(driver, row, goal)              # raises HeptarmError: refused
    moved = follow(handle, on_progress=..., is_cancelled=...)
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from math import isnan
from typing import Any

from heptarm.arm.handle import MotionHandle
from heptarm.bridge import motions
from heptarm.bridge.conditions import condition_of
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.bridge.order import positions
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.circ import circ
from heptarm.values.motion import TOOL, Motion, lin, ptp
from heptarm.values.result import Cause
from heptarm.values.spline import spline, spline_joints

#: How often progress is told [s].
_PERIOD = 0.05


@dataclass(frozen=True, slots=True)
class Move:
    """An action that moves the arm.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        type: "package/Type".
        motions: what a goal of that type asks for.
    """

    name: str
    type: str
    motions: Callable[[Driver, Any], tuple[Motion, ...]]


@dataclass(frozen=True, slots=True)
class Moved:
    """How a motion ended.

    Attributes:
        outcome: in what state.
        text: what happened, in words.
        residual: largest joint distance from the commanded position [rad]; 0: it never moved.
        stopped_by: the part of the condition that ended it, in words; empty: none.
        item: number of the motion of the program that ran last.
    """

    outcome: Outcome
    text: str
    residual: float = 0.0
    stopped_by: str = ""
    item: int = 0

    def fill(self, result: Any) -> Any:
        """The result of an action with what it has fields for."""
        told = {
            "success": self.outcome is Outcome.SUCCEEDED,
            "message": self.text,
            "residual": self.residual,
            "stopped_by": self.stopped_by,
            "item": self.item,
        }
        for name, value in told.items():
            if hasattr(result, name):
                setattr(result, name, value)
        return result


def _to_joints(driver: Driver, goal: Any) -> tuple[Motion, ...]:
    return (ptp(positions(driver, goal.joint_names, goal.position)),)


def _to_pose(driver: Driver, goal: Any) -> tuple[Motion, ...]:
    base = driver.configuration.frame("base")
    moving = goal.moving or TOOL
    how: dict[str, Any] = {"moving": moving}
    if goal.speed_mps:
        how["speed_mps"] = goal.speed_mps
    if goal.path == motions.LIN_REL:
        return (motions.offset(goal.pose, how),)
    pose = motions.stamped_pose(goal.pose, base)
    if goal.path == motions.PTP:
        return (ptp(pose, moving=moving),)
    if goal.path == motions.LIN:
        return (lin(pose, **how),)
    if goal.path == motions.CIRC:
        return (circ(motions.stamped_pose(goal.via, base), pose, **how),)
    raise CommandRejected(
        f"path is {goal.path}; 0 (PTP), 1 (LIN), 2 (CIRC) or 3 (LIN_REL) is wanted",
        parameter="path",
        value=goal.path,
    )


def _along_spline(driver: Driver, goal: Any) -> tuple[Motion, ...]:
    if len(goal.segments) and len(goal.position):
        raise CommandRejected(
            "a spline goes through segments or through joint positions", parameter="segments", hint="give one"
        )
    if len(goal.position):
        return (spline_joints(motions.joint_points(driver, goal.joint_names, goal.position)),)
    how: dict[str, Any] = {
        name: getattr(goal, name) for name in ("speed_mps", "acceleration_mps2") if getattr(goal, name)
    }
    segments = [motions.segment_of(one) for one in goal.segments]
    return (spline(segments, moving=goal.moving or TOOL, **how),)


def _program(driver: Driver, goal: Any) -> tuple[Motion, ...]:
    return motions.program_of(driver, goal.motions)


#: All of them.
MOVES = (
    Move("~/move_joints", "heptarm_msgs/MoveJoints", _to_joints),
    Move("~/move_pose", "heptarm_msgs/MovePose", _to_pose),
    Move("~/move_spline", "heptarm_msgs/MoveSpline", _along_spline),
    Move("~/run_program", "heptarm_msgs/RunProgram", _program),
)


def start(driver: Driver, row: Move, goal: Any) -> MotionHandle:
    """Start what a goal asks for; unless it says another it takes the place of whatever runs.

    Args:
        driver: whose arm it is.
        row: which action.
        goal: of its type.

    Raises:
        HeptarmError: refused; the text says why.
    """
    when: Any = getattr(goal, "when", "") or "replace"
    return driver.start(
        row.motions(driver, goal),
        speed=None if goal.speed == 0.0 else goal.speed,
        until=condition_of(goal.until),
        when=when,
    )


def follow(
    handle: MotionHandle, *, on_progress: Callable[[float], None], is_cancelled: Callable[[], bool]
) -> Moved:
    """Wait until a motion has ended, and cancel it when asked to.

    Args:
        handle: of the motion.
        on_progress: told how much is done, [0, 1].
        is_cancelled: whether to cancel; the arm brakes on its path then.
    """
    cancelled = False
    try:
        while not handle.done:
            on_progress(handle.progress)
            if not cancelled and is_cancelled():
                cancelled = True
                handle.cancel()
            time.sleep(_PERIOD)
        result = handle.wait(timeout=_PERIOD)
    except HeptarmError as error:
        return Moved(Outcome.ABORTED, str(error))
    residual = 0.0 if isnan(result.residual) else result.residual
    if result.cause is Cause.FINISHED:
        on_progress(1.0)
        return Moved(Outcome.SUCCEEDED, "the arm has arrived", residual, item=result.item)
    if result.cause is Cause.CONDITION:
        fired = "the condition" if result.stopped_by is None else str(result.stopped_by)
        return Moved(Outcome.SUCCEEDED, f"ended by {fired}", residual, fired, result.item)
    if result.cause is Cause.CANCELLED:
        # whoever cancels it here, by a stop or by the goal of a trajectory, is not the action's client
        outcome = Outcome.CANCELED if cancelled else Outcome.ABORTED
        return Moved(outcome, "cancelled; the arm braked on its path", residual, item=result.item)
    return Moved(
        Outcome.PREEMPTED, "another motion took the place of this one", residual, item=result.item
    )
