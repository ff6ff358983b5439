"""Single motions as actions: what a goal asks for, and how far it is until it ends; free of ROS."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isnan

from heptarm.arm.handle import MotionHandle
from heptarm.bridge.driver import Driver
from heptarm.bridge.goal import Outcome
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.values.circ import circ
from heptarm.values.motion import Motion, lin, ptp
from heptarm.values.pose import Pose
from heptarm.values.result import Cause

#: Paths to a pose, as heptarm_msgs/MovePose numbers them.
PTP, LIN, CIRC = range(3)
#: How often progress is told [s].
_PERIOD = 0.05


@dataclass(frozen=True, slots=True)
class Moved:
    """How a motion ended.

    Attributes:
        outcome: in what state.
        text: what happened, in words.
        residual: largest joint distance from the commanded position [rad]; 0: it never moved.
    """

    outcome: Outcome
    text: str
    residual: float = 0.0


def to_joints(driver: Driver, names: Sequence[str], values: Sequence[float]) -> Motion:
    """To joint positions; joints left out stay. See `Driver.positions`.

    Raises:
        HeptarmError: the names, the numbers, or a number outside the joint's range.
    """
    return ptp(driver.positions(names, values))


def to_pose(path: int, pose: Pose, via: Pose) -> Motion:
    """To a pose of the moved frame in the base.

    Args:
        path: PTP, LIN or CIRC.
        pose: where to.
        via: a point of the arc, for CIRC.

    Raises:
        CommandRejected: there is no such path, or no such arc.
    """
    if path == PTP:
        return ptp(pose)
    if path == LIN:
        return lin(pose)
    if path == CIRC:
        return circ(via, pose)
    raise CommandRejected(
        f"path is {path}; 0 (PTP), 1 (LIN) or 2 (CIRC) is wanted", parameter="path", value=path
    )


def start(driver: Driver, motion: Motion, speed: float) -> MotionHandle:
    """Start it; it takes the place of whatever runs.

    Args:
        driver: whose arm it is.
        motion: what to do.
        speed: ceiling, (0, 1]; 0: the node's.

    Raises:
        HeptarmError: refused; the text says why.
    """
    return driver.start(motion, speed=None if speed == 0.0 else speed)


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
        return Moved(Outcome.SUCCEEDED, "the arm has arrived", residual)
    if result.cause is Cause.CANCELLED:
        # whoever cancels it here, by a stop or by the goal of a trajectory, is not the action's client
        outcome = Outcome.CANCELED if cancelled else Outcome.ABORTED
        return Moved(outcome, "cancelled; the arm braked on its path", residual)
    return Moved(Outcome.PREEMPTED, "another motion took the place of this one", residual)
