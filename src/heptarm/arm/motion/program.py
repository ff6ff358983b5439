"""Programs: check motions against the robot, its tools and signals, and send them as one request."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import inf, isnan
from typing import cast

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.handle import BreakRule, MotionHandle
from heptarm.arm.translate.conditions import condition_message
from heptarm.arm.translate.modes import mode_message
from heptarm.arm.translate.motions import items
from heptarm.arm.translate.triggers import trigger_messages
from heptarm.errors import HeptarmError, ShapeError
from heptarm.values.condition.condition import Condition, condition_nodes
from heptarm.values.condition.trigger import triggers_of
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.circle import Circ
from heptarm.values.motion.dynamics import DynamicMotion, Dynamics
from heptarm.values.motion.hand_guiding import HandGuide
from heptarm.values.motion.line import Lin, LinRel
from heptarm.values.motion.motion import MOTIONS, Hold, Motion, limited_to
from heptarm.values.motion.spline import JointSpline, Segment, Spline
from heptarm.values.robot import RobotModel
from heptarm.wire import messages as wire

_WHEN = {"queue": wire.When.QUEUE, "replace": wire.When.REPLACE, "reject": wire.When.REJECT}
_DAY = 86400.0
#: A motion may take this much longer than its slowest plausible estimate, and this much more [s].
_GENEROUS, _AND_MORE = 3.0, 15.0
#: The longest straight line and the longest arc inside the workspace of the largest arm [m].
_LONGEST_LINE, _LONGEST_ARC = 2.0, 6.0
#: Cartesian speed assumed where none is given [m/s].
_SLOW_LINE = 0.1


def listed(motion: Motion | Sequence[Motion]) -> tuple[Motion, ...]:
    """One motion or several, as a tuple.

    Raises:
        ShapeError: something else, or none at all.
    """
    motions = cast("Sequence[Motion]", (motion,) if isinstance(motion, MOTIONS) else motion)
    if not isinstance(motions, Sequence) or isinstance(motions, str) or not 1 <= len(motions) <= 1000:
        raise ShapeError(
            f"motion must be a motion or a list of 1 to 1000 motions, got {_text(motions)}",
            code=3,
            parameter="motion",
            hint="make motions with ptp, lin, lin_rel, circ, spline and hold",
        )
    for index, one in enumerate(motions):
        if not isinstance(one, MOTIONS):
            raise ShapeError(
                f"motions[{index}] must be a motion, got {one!r}",
                parameter=f"motions[{index}]",
                value=one,
                hint="make motions with ptp, lin, lin_rel, circ, spline and hold; joint positions alone are ptp(q)",
            )
    return tuple(motions)


def _text(value: object) -> str:
    return (
        f"{len(value)} of them" if isinstance(value, Sequence) and not isinstance(value, str) else repr(value)
    )


def send(
    connection: Connection,
    tooling: Tooling,
    motions: tuple[Motion, ...],
    *,
    ceiling: float,
    mode: Mode | None,
    until: Condition | None,
    when: str,
    breaks: tuple[BreakRule, ...] = (),
) -> MotionHandle:
    """Check motions and send them as one program; see `Arm.start`.

    Args:
        connection: to the cabinet.
        tooling: the attached tool and its frames.
        motions: in their order.
        ceiling: no joint is faster than this fraction of its maximum, (0, 1].
        mode: control mode of all of them; None: position.
        until: condition that ends them.
        when: while another program runs: "queue", "replace" or "reject".
        breaks: rules whose conditions are part of `until`.
    """
    if when not in _WHEN:
        allowed = ", ".join(map(repr, _WHEN))
        raise ShapeError(
            f"when must be one of {allowed}, got {when!r}", parameter="when", value=when, allowed=allowed
        )
    message_of_mode = mode_message(mode)
    tooling.check(motions, mode)
    break_condition, parts = condition_message(until, connection.signals)
    tooling.check_until(parts)
    made = items(motions, connection.robot, ceiling, mode=message_of_mode, until=break_condition)
    made = tuple(
        replace(item, triggers=_triggers(index, motion, connection, tooling))
        for index, (item, motion) in enumerate(zip(made, motions, strict=True))
    )
    message = wire.Run(items=made, when=_WHEN[when])
    triggers = tuple(map(triggers_of, motions))
    limit = _limit(connection, motions, ceiling)
    return MotionHandle.send(
        connection, message, count=len(motions), limit=limit, until=parts, triggers=triggers, breaks=breaks
    )


def _triggers(
    index: int, motion: Motion, connection: Connection, tooling: Tooling
) -> tuple[wire.Trigger, ...]:
    """Messages of a motion's triggers, their frames checked; errors name the motion."""
    with _named(f"motions[{index}]."):
        messages = trigger_messages(motion, connection.signals)
        for place, trigger in enumerate(triggers_of(motion)):
            with _named(f"triggers[{place}]."):
                tooling.check_until([node for node, _ in condition_nodes(trigger.condition)])
    return messages


@contextmanager
def _named(prefix: str) -> Iterator[None]:
    """Put a prefix before the parameter that an error names."""
    try:
        yield
    except HeptarmError as error:
        error.parameter = f"{prefix}{error.parameter}"
        raise


def _limit(connection: Connection, motions: tuple[Motion, ...], ceiling: float) -> float:
    """Time after which waiting for them makes no sense [s], with what is before them in the queue."""
    newest = connection.newest()
    override = newest.motion.override if newest is not None and newest.motion is not None else 1.0
    own = (
        longest(motions, connection.robot, ceiling)
        / max(override, 0.01)
        / min(connection.real_time_factor, 1.0)
    )
    total = own + connection.events.pending()
    return total if total < _DAY else _DAY


def longest(motions: Sequence[Motion], robot: RobotModel, ceiling: float) -> float:
    """Upper bound of the duration of a healthy program [s]; infinite if it holds until it is cancelled."""
    return _AND_MORE + _GENEROUS * sum(_slowest(limited_to(motion, ceiling), robot) for motion in motions)


def _slowest(motion: Motion, robot: RobotModel) -> float:
    if isinstance(motion, Hold):
        return motion.duration
    if isinstance(motion, JointSpline):
        return sum(_turn(point.dynamics, robot) for point in motion.points)
    if isinstance(motion, Spline):
        turn = _turn(motion.dynamics, robot) * len(motion.segments)
        return turn + sum(_along(one, motion.dynamics) for one in motion.segments)
    if isinstance(motion, Lin | LinRel | Circ):
        return _turn(motion.dynamics, robot) + _along(motion) + 1.0
    return _turn(motion.dynamics, robot) if isinstance(motion, DynamicMotion) else inf


def _along(one: Segment | LinRel, *whole: Dynamics) -> float:
    """Time for the longest line or arc at its speed [s]."""
    speeds = (*(dynamics.speed_mps for dynamics in (one.dynamics, *whole)), _SLOW_LINE)
    speed = next(speed for speed in speeds if not isnan(speed))
    return (_LONGEST_ARC if isinstance(one, Circ) else _LONGEST_LINE) / speed


def _turn(dynamics: Dynamics, robot: RobotModel) -> float:
    """Time for every joint to move through its whole range, with ramps [s]."""
    limits = (dynamics.joint_speed, dynamics.joint_acceleration, dynamics.joint_jerk)
    speed, acceleration, jerk = (np.nan_to_num(limit, nan=1.0) for limit in limits)
    cruise = (robot.q_max - robot.q_min) / (robot.dq_max * speed)
    ramps = robot.dq_max * speed / (robot.ddq_max * acceleration) + robot.ddq_max / (robot.dddq_max * jerk)
    return float(np.max(cruise + ramps))


def is_endless(motions: Sequence[Motion]) -> bool:
    """Whether it ends only when it is cancelled."""
    return any(
        isinstance(motion, HandGuide) or (isinstance(motion, Hold) and motion.duration == inf)
        for motion in motions
    )
