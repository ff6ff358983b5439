"""Programs: check motions against the robot, its tools and signals, and send them as one request."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isinf

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.handle import BreakRule, MotionHandle
from heptarm.arm.translate.conditions import condition_message, reaction_message
from heptarm.arm.translate.modes import mode_message
from heptarm.arm.translate.motions import in_base, item
from heptarm.arm.translate.triggers import trigger_messages
from heptarm.errors import CommandRejected, ShapeError, inside
from heptarm.values.checks import Array, within
from heptarm.values.condition.condition import Condition, check_condition, condition_nodes
from heptarm.values.condition.reaction import Reaction, check_reaction
from heptarm.values.mode.mode import Mode, check_mode
from heptarm.values.motion.circle import Circ, circle_through
from heptarm.values.motion.line import Lin
from heptarm.values.motion.motion import Hold, Motion, triggers_of
from heptarm.values.motion.planned_path import Path
from heptarm.values.motion.ptp import Ptp, PtpPose
from heptarm.values.motion.spline import JointSpline, Segment, Spline
from heptarm.values.pose import PartialPose, Pose
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.wire import messages as wire

_WHEN = {"queue": wire.When.QUEUE, "replace": wire.When.REPLACE, "reject": wire.When.REJECT}
_DAY = 86400.0
#: A motion may take this much longer than its slowest plausible estimate, and this much more [s].
_GENEROUS, _AND_MORE = 3.0, 15.0
#: A path may begin so far from where the arm is, in each joint [rad].
_AT_BEGIN = 0.01


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
    for index, entry in enumerate(motions):
        if not isinstance(entry, Motion):
            raise ShapeError(
                f"motions[{index}] must be a motion, got {entry!r}",
                parameter=f"motions[{index}]",
                value=entry,
                hint="make motions with ptp, lin, lin_rel, circ, spline and hold; joint positions alone are ptp(q)",
            )
    return tuple(motions)


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a motion starts, as far as it is known: its joint positions, or the pose of a motion frame.

    Attributes:
        q: set-point of the joints, shape (7,) [rad].
        pose: of the motion frame `moving`, in the base.
        moving: its name.
    """

    q: Array | None = None
    pose: Pose | None = None
    moving: str = ""

    def behind(self, motion: Motion) -> _Place:
        """Where a motion that starts here ends."""
        if isinstance(motion, Hold):
            return self
        if isinstance(motion, Ptp):
            return _Place(motion.q)
        if isinstance(motion, JointSpline):
            return _Place(motion.points[-1].q)
        if isinstance(motion, PtpPose | Lin | Circ):
            return _Place(pose=_end(motion), moving=motion.moving)
        if isinstance(motion, Spline):
            return _Place(pose=_end(motion.segments[-1]), moving=motion.moving)
        return _Place()

    def seen(self, moving: str, tooling: Tooling) -> Pose | None:
        """Pose of a motion frame here; None: not known."""
        if self.q is not None:
            return tooling.reached(self.q, moving)
        return self.pose if self.moving == moving else None


def _end(motion: PtpPose | Segment) -> Pose | None:
    end = motion.end if isinstance(motion, Circ) else motion.target
    return end if isinstance(end, Pose) else None


def resolved(
    connection: Connection, tooling: Tooling, motions: tuple[Motion, ...], start: Array | None = None
) -> tuple[Motion, ...]:
    """The motions with numbers for what depends on the arm: poses in the base, and what stays as it is.

    Where the start of an arc is known, its points are checked.

    Args:
        connection: to the cabinet.
        tooling: the attached tool and its frames.
        motions: in their order.
        start: set-point when the first one starts, shape (7,) [rad]; None: the present one.

    Raises:
        CommandRejected: a set-point is not known yet: another motion runs, or one to home, by an offset or, for joints,
            to a pose comes before. Or poses in no fixed frame, points of an arc that define no circle, or a path of
            another robot or that begins elsewhere.
        StaleState: the newest state is too old, or lacks the joints.
    """
    place = _Place(start)
    if start is None and any(map(_keeps, motions)):
        place = _Place(_rest(connection, connection.fresh()))
    elif start is None and any(isinstance(motion, Circ | Spline | Path) for motion in motions):
        newest = connection.newest()
        place = _Place(None if newest is None or newest.groups.joints is None else _rest(connection, newest))
    made: list[Motion] = []
    for index, motion in enumerate(motions):
        with inside(f"motions[{index}]" if len(motions) > 1 else ""):
            placed = in_base(motion, tooling.taught)
            if _keeps(placed):
                placed = _with_kept(placed, place, tooling, index)
            elif isinstance(placed, Circ | Spline):
                _check_arcs(placed, place.seen(placed.moving, tooling))
            elif isinstance(placed, Path):
                _check_path(placed, place.q, connection.robot.name)
        place = place.behind(placed)
        made.append(placed)
    return tuple(made)


def _rest(connection: Connection, state: State) -> Array | None:
    """The joints' set-points in a state, shape (7,) [rad]; None: a program has not ended, or nothing is known."""
    moves = state.motion is not None and (state.motion.active or state.motion.queued > 0)
    if moves or connection.events.pending() > 0 or np.isnan(state.q_cmd).any():
        return None
    return state.q_cmd


def _keeps(motion: Motion) -> bool:
    """Whether its target depends on where it begins: joints, or coordinates of a pose, stay."""
    if isinstance(motion, PtpPose | Lin):
        return isinstance(motion.target, PartialPose)
    return isinstance(motion, Ptp) and motion.keeps


def _with_kept(motion: Motion, place: _Place, tooling: Tooling, index: int) -> Motion:
    if isinstance(motion, Ptp) and place.q is not None:
        return replace(motion, q=np.where(np.isnan(motion.q), place.q, motion.q))
    if isinstance(motion, PtpPose | Lin) and isinstance(motion.target, PartialPose):
        start = place.seen(motion.moving, tooling)
        if start is not None:
            return replace(motion, target=motion.target.completed(start))
    kept, whole = (
        ("joints", "all seven joints") if isinstance(motion, Ptp) else ("coordinates", "a whole pose")
    )
    raise CommandRejected(
        f"motions[{index}] keeps {kept} (NaN) whose set-points are not known yet",
        parameter="q" if isinstance(motion, Ptp) else "target",
        hint=f"wait until the arm rests, or give {whole}",
    )


def _check_path(path: Path, here: Array | None, robot: str) -> None:
    """Refuse a path of another robot, and one that begins elsewhere: the joints would move there unchecked."""
    if path.world.robot.name != robot:
        raise CommandRejected(
            f"the path must be one of this robot, the {robot}, got one of the {path.world.robot.name}",
            parameter="motion",
            value=path.world.robot.name,
            hint="find it with heptarm.CollisionModel(arm.robot.name, ...)",
        )
    if here is None:
        return
    gap = float(np.abs(path.start - here).max())
    if gap > _AT_BEGIN:
        raise CommandRejected(
            f"the path must begin where the arm is, within {_AT_BEGIN:g} rad, got {gap:.3f} rad at "
            f"A{int(np.abs(path.start - here).argmax()) + 1}",
            parameter="motion",
            value=round(gap, 4),
            allowed=f"[0, {_AT_BEGIN:g}] rad",
            hint="find a path from here: arm.find_path(path.end), or move to path.start first",
        )


def _check_arcs(motion: Circ | Spline, start: Pose | None) -> None:
    """Refuse arcs, also segments of a spline, whose points define no circle."""
    if isinstance(motion, Circ):
        if start is not None:
            circle_through(start, motion.via, motion.end)
        return
    for index, segment in enumerate(motion.segments):
        if isinstance(segment, Circ) and start is not None:
            with inside(f"segments[{index}]"):
                circle_through(start, segment.via, segment.end)
        start = _end(segment)


def _text(value: object) -> str:
    return (
        f"{len(value)} of them" if isinstance(value, Sequence) and not isinstance(value, str) else repr(value)
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramTerms:
    """Under what terms a program is carried out: for every motion of it the same.

    Attributes:
        speed: no joint is faster than this fraction of its maximum, (0, 1].
        mode: control mode; None: position.
        until: condition that ends a motion, those of the enclosing blocks among them; None: none.
        then: reaction when `until` has ended a motion.
        when: while another program runs: "queue", "replace" or "reject".
        breaks: rules of the enclosing blocks, whose conditions are part of `until`.

    Raises:
        ShapeError: a wrong type, or no such word.
        LimitError: a speed outside its range.
    """

    speed: float = 1.0
    mode: Mode | None = None
    until: Condition | None = None
    then: Reaction = "stay"
    when: str = "queue"
    breaks: tuple[BreakRule, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "speed", within(self.speed, "speed", 0.0, 1.0, above=True))
        if self.mode is not None:
            check_mode(self.mode)
        if self.until is not None:
            check_condition(self.until)
        check_reaction(self.then)
        if self.when not in _WHEN:
            allowed = ", ".join(map(repr, _WHEN))
            raise ShapeError(
                f"when must be one of {allowed}, got {self.when!r}",
                parameter="when",
                value=self.when,
                allowed=allowed,
            )


@dataclass(frozen=True, slots=True)
class CheckedProgram:
    """Motions that were checked as the cabinet checks them, as far as this side can; made by `checked`.

    Attributes:
        motions: with numbers for what depends on the arm.
        terms: under which they are carried out.
        items: of the message.
        until: for each node of the break condition the part of the condition that the user wrote.
    """

    motions: tuple[Motion, ...]
    terms: ProgramTerms
    items: tuple[wire.Item, ...]
    until: tuple[Condition, ...]


def checked(
    connection: Connection,
    tooling: Tooling,
    motions: tuple[Motion, ...],
    terms: ProgramTerms,
    *,
    start: Array | None = None,
) -> CheckedProgram:
    """Check motions, their triggers, mode and break condition; nothing is sent.

    Args:
        connection: to the cabinet.
        tooling: the attached tool and its frames.
        motions: in their order.
        terms: under which they are carried out.
        start: set-point when the first one starts, shape (7,) [rad]; None: the present one.

    Raises:
        CommandRejected: one of them is not possible; LimitError and others name the value and the range.
    """
    motions = resolved(connection, tooling, motions, start)
    mode = mode_message(terms.mode)
    tooling.check(motions, terms.mode)
    until, parts = condition_message(terms.until, connection.signals)
    tooling.check_until(parts)
    reaction = None if terms.until is None else reaction_message(terms.then)
    items = []
    for index, motion in enumerate(motions):
        triggers = _triggers(index, motion, connection, tooling)
        with inside(f"motions[{index}]" if len(motions) > 1 else ""):
            items.append(
                item(
                    motion,
                    connection.robot,
                    speed=terms.speed,
                    mode=mode,
                    until=until,
                    reaction=reaction,
                    triggers=triggers,
                )
            )
    return CheckedProgram(motions, terms, tuple(items), parts)


def send(connection: Connection, program: CheckedProgram) -> MotionHandle:
    """Send a checked program; see `Arm.start`."""
    motions, terms = program.motions, program.terms
    return MotionHandle.send(
        connection,
        wire.Run(items=program.items, when=_WHEN[terms.when]),
        count=len(motions),
        limit=_limit(connection, motions, terms.speed),
        until=program.until,
        triggers=tuple(map(triggers_of, motions)),
        breaks=terms.breaks,
    )


def _triggers(
    index: int, motion: Motion, connection: Connection, tooling: Tooling
) -> tuple[wire.Trigger, ...]:
    """Messages of a motion's triggers, their frames checked; errors name the motion."""
    with inside(f"motions[{index}]"):
        messages = trigger_messages(motion, connection.signals)
        for place, trigger in enumerate(triggers_of(motion)):
            with inside(f"triggers[{place}]"):
                tooling.check_until([node for node, _ in condition_nodes(trigger.condition)])
    return messages


def _limit(connection: Connection, motions: tuple[Motion, ...], speed: float) -> float:
    """Time after which waiting for them makes no sense [s], with what is before them in the queue."""
    newest = connection.newest()
    override = newest.motion.override if newest is not None and newest.motion is not None else 1.0
    own = (
        longest(motions, connection.robot, speed)
        / max(override, 0.01)
        / min(connection.real_time_factor, 1.0)
    )
    total = own + connection.events.pending()
    return total if total < _DAY else _DAY


def longest(motions: Sequence[Motion], robot: RobotModel, speed: float) -> float:
    """Upper bound of the duration of a healthy program [s]; infinite if it holds until it is cancelled."""
    return _AND_MORE + _GENEROUS * sum(motion.limited_to(speed).longest_duration(robot) for motion in motions)


def is_endless(motions: Sequence[Motion], robot: RobotModel) -> bool:
    """Whether it ends only when it is cancelled."""
    return any(isinf(motion.longest_duration(robot)) for motion in motions)
