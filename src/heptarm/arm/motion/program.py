"""Programs: check motions against the robot, its tools and signals, and send them as one request."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import isinf

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.handle import BreakRule, MotionHandle
from heptarm.arm.translate.conditions import condition_message, reaction_message
from heptarm.arm.translate.modes import mode_message
from heptarm.arm.translate.motions import items
from heptarm.arm.translate.triggers import trigger_messages
from heptarm.errors import CommandRejected, HeptarmError, ShapeError
from heptarm.values.arrays import Array
from heptarm.values.condition.condition import Condition, condition_nodes
from heptarm.values.condition.reaction import Reaction
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.motion import Hold, Motion, triggers_of
from heptarm.values.motion.ptp import Ptp
from heptarm.values.robot import RobotModel
from heptarm.wire import messages as wire

_WHEN = {"queue": wire.When.QUEUE, "replace": wire.When.REPLACE, "reject": wire.When.REJECT}
_DAY = 86400.0
#: A motion may take this much longer than its slowest plausible estimate, and this much more [s].
_GENEROUS, _AND_MORE = 3.0, 15.0


def listed(motion: Motion | Sequence[Motion]) -> tuple[Motion, ...]:
    """One motion or several, as a tuple.

    Raises:
        ShapeError: something else, or none at all.
    """
    motions = (motion,) if isinstance(motion, Motion) else motion
    if not isinstance(motions, Sequence) or isinstance(motions, str) or not 1 <= len(motions) <= 1000:
        raise ShapeError(
            f"motion must be a motion or a list of 1 to 1000 motions, got {_text(motions)}",
            code=3,
            parameter="motion",
            hint="make motions with ptp, lin, lin_rel, circ, spline and hold",
        )
    for index, one in enumerate(motions):
        if not isinstance(one, Motion):
            raise ShapeError(
                f"motions[{index}] must be a motion, got {one!r}",
                parameter=f"motions[{index}]",
                value=one,
                hint="make motions with ptp, lin, lin_rel, circ, spline and hold; joint positions alone are ptp(q)",
            )
    return tuple(motions)


def with_kept_joints(
    connection: Connection, motions: tuple[Motion, ...], start: Array | None = None
) -> tuple[Motion, ...]:
    """The motions with a number for every joint that a PTP keeps: its set-point when the PTP starts.

    Args:
        connection: to the cabinet.
        motions: in their order.
        start: set-point when the first one starts, shape (7,) [rad]; None: the present one.

    Raises:
        CommandRejected: the set-point is not known yet: another motion runs, or one to a pose or home comes before.
        StaleState: the newest state is too old, or lacks the joints.
    """
    if not any(isinstance(one, Ptp) and one.keeps for one in motions):
        return motions
    known = start
    if start is None:
        state = connection.fresh()
        moves = state.motion is not None and (state.motion.active or state.motion.queued > 0)
        known = None if moves else state.q_cmd
    made: list[Motion] = []
    for index, one in enumerate(motions):
        if isinstance(one, Ptp) and one.keeps:
            if known is None:
                raise CommandRejected(
                    f"motions[{index}] keeps joints (NaN) whose set-points are not known yet",
                    parameter=f"motions[{index}].q",
                    hint="wait until the arm rests, or give all seven joints",
                )
            made.append(replace(one, q=np.where(np.isnan(one.q), known, one.q)))
        else:
            made.append(one)
        last = made[-1]
        if isinstance(last, Ptp):
            known = last.q
        elif not isinstance(last, Hold):
            known = None
    return tuple(made)


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
    then: Reaction = "stay",
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
        then: reaction when `until` has ended one of them.
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
    reaction = None if until is None else reaction_message(then)
    made = items(
        motions, connection.robot, ceiling, mode=message_of_mode, until=break_condition, reaction=reaction
    )
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
    return _AND_MORE + _GENEROUS * sum(
        motion.limited_to(ceiling).longest_duration(robot) for motion in motions
    )


def is_endless(motions: Sequence[Motion], robot: RobotModel) -> bool:
    """Whether it ends only when it is cancelled."""
    return any(isinf(motion.longest_duration(robot)) for motion in motions)
