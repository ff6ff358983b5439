"""What a recording commands: programs as they were sent, streams as set-points, and what came from outside."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from math import isnan
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.record.fri_commands import FriCommands
from heptarm.record.journal import REQUEST, restored
from heptarm.record.recorded import FRI, RecordedData, RecordedEvent, RecordedMotion
from heptarm.values.checks import Array
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.robot import RobotModel
from heptarm.wire import messages as wire

#: Requests besides programs that change what the arm does; the twin repeats them.
_REPEATED = (
    wire.Cancel,
    wire.Stop,
    wire.Pause,
    wire.Resume,
    wire.Recover,
    wire.SetOverride,
    wire.DefineTool,
    wire.AttachTool,
    wire.AttachLoad,
    wire.SetSignals,
)
_KINDS = {kind.__name__: kind for kind in _REPEATED}
#: What persons and the safety configuration request: the bit that reports it, and the word of the simulated operator.
#: Of several that are reported at once the first counts.
_STOPS = (
    (wire.SafetyBits.EMERGENCY_STOP, "emergency_stop"),
    (wire.SafetyBits.OPERATOR_SAFETY_OPEN, "operator_safety"),
    (wire.SafetyBits.PROTECTIVE_STOP, "protective_stop"),
)
_ANY_STOP = (
    wire.SafetyBits.EMERGENCY_STOP | wire.SafetyBits.OPERATOR_SAFETY_OPEN | wire.SafetyBits.PROTECTIVE_STOP
)
#: A joint that moves less than this in a stream rests [rad].
_STILL = 1e-4
#: FRI's client command modes that superpose a load.
_LOADS = (wire.FriCommandMode.TORQUE, wire.FriCommandMode.WRENCH)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedSession:
    """An FRI session whose client superposed a load.

    Attributes:
        opened: the request that opened it.
        commands: what the client sent.
    """

    opened: wire.FriOpen
    commands: FriCommands


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """A program of the recording.

    Attributes:
        motion: what is known of it.
        sent: when its request was accepted [s]; of a stream when it began.
        until: when it ended, or the recording did [s].
        start: set-point at its begin, shape (7,) [rad].
        program: as it was sent; None: the set-points are repeated as a stream, or a session by its commands.
        session: of FRI, with its commands; None: it is none, or they are not recorded.
        stream: these set-points; None: of a program or a session, or the arm did not move.
        mode: control mode of a stream; None: position.
    """

    motion: RecordedMotion
    sent: float
    until: float
    start: Array
    program: wire.Run | None = None
    session: RecordedSession | None = None
    stream: Trajectory | None = None
    mode: wire.Mode | None = None


@dataclass(frozen=True, slots=True)
class RepeatedStep:
    """What happened besides programs.

    Attributes:
        t: when [s].
        message: a request that is repeated; None: it came from outside.
        word: of the simulated operator, such as "emergency_stop"; empty: it is a request.
    """

    t: float
    message: Any = None
    word: str = ""


@dataclass(frozen=True, slots=True)
class Commands:
    """All that a recording commands.

    Attributes:
        robot: the robot.
        sections: programs, in the order in which they were sent.
        steps: what happened besides them, in order.
        tools: tools and workpieces that were known at its begin.
        tool: name of the one that was attached then; empty: none.
        frame: motion frame of it; empty: its first.
        workpiece: name of the attached workpiece; empty: none.
        override: at the begin, [0, 1].
        notes: what the twin cannot repeat.
    """

    robot: RobotModel
    sections: tuple[Section, ...]
    steps: tuple[RepeatedStep, ...]
    tools: tuple[wire.ToolInfo, ...] = ()
    tool: str = ""
    frame: str = ""
    workpiece: str = ""
    override: float = 1.0
    notes: tuple[str, ...] = field(default=())


def commands_of(run: RecordedData) -> Commands:
    """Read the commands of a recording.

    Raises:
        CommandRejected: it commands nothing, is of an unknown robot, lacks the joints, or a later version wrote it.
    """
    robot = run.robot
    if robot is None:
        raise _unusable(
            run, f"its robot {run.facts.get('robot', '')!r} is not known", "a later heptarm may know it"
        )
    major, minor = _version(run)
    if (major, minor) > (wire.MAJOR, wire.MINOR):
        raise _unusable(
            run,
            f"it was recorded with version {major}.{minor} of the protocol, this heptarm knows "
            f"{wire.MAJOR}.{wire.MINOR}",
            f"use heptarm {run.facts.get('heptarm', '')} or later".replace("  ", " "),
        )
    if "q_cmd" not in run or len(run.t) < 2 or np.isnan(run["q_cmd"]).all():
        raise _unusable(run, "it has no set-points of the joints", 'record the state group "joints"')
    try:
        requests = {event.id: event for event in run.events if event.kind == REQUEST and event.id}
        notes: list[str] = []
        sections = sorted(_sections(run, requests, notes), key=lambda section: section.sent)
        tools = restored(json.loads(run.facts.get("tools", "[]")), tuple[wire.ToolInfo, ...])
        steps = sorted(_steps(run), key=lambda step: step.t)
    except ValueError as error:
        raise _unusable(
            run,
            f"its requests cannot be read: {error}",
            f"heptarm {run.facts.get('heptarm', '')} wrote it; use that version or a later one",
        ) from error
    if not sections:
        raise _unusable(run, "the arm executes no motion in it", "record while the arm moves")
    mode: dict[str, Any] = next(
        (event.content["mode"] for event in run.events if "mode" in event.content), {}
    )
    override = run["override"] if "override" in run else np.ones(1)
    known = override[np.isfinite(override)]
    return Commands(
        robot,
        tuple(sections),
        tuple(steps),
        tools,
        str(mode.get("tool", "")),
        str(mode.get("frame", "")),
        str(mode.get("workpiece", "")),
        float(known[0]) if len(known) else 1.0,
        tuple(dict.fromkeys(notes)),
    )


def _version(run: RecordedData) -> tuple[int, int]:
    """Version of the protocol in which the requests are; those before 2.0 did not note it."""
    try:
        major, minor = run.facts.get("protocol", "2.0").split(".")
        return int(major), int(minor)
    except ValueError:
        raise _unusable(
            run, f"its version of the protocol is {run.facts['protocol']!r}", "record it again"
        ) from None


def _unusable(run: RecordedData, why: str, hint: str) -> CommandRejected:
    return CommandRejected(
        f"{run.path.name} cannot be repeated in the simulator: {why}",
        parameter="recording",
        value=str(run.path),
        hint=hint,
    )


# ------------------------------------------------------------------------------------------------- programs


def _sections(run: RecordedData, requests: dict[int, RecordedEvent], notes: list[str]) -> Iterator[Section]:
    """Programs of the recording: as they were sent where that is recorded, otherwise their set-points."""
    last = float(run.t[-1])
    for motion in run.motions:
        request = requests.get(motion.id)
        until = last if isnan(motion.end) else min(motion.end, last)
        if until <= motion.begin:
            continue
        name = "" if request is None else request.name
        program = restored(request.content, wire.Run) if request is not None and name == "Run" else None
        is_guided = program is not None and any(
            isinstance(item.motion, wire.HandGuide) for item in program.items
        )
        if is_guided:
            notes.append(
                f"motion {motion.id}: hand guiding is repeated by the positions to which the arm was guided"
            )
        before = int(np.searchsorted(run.t, motion.begin)) - 1
        is_whole = before >= 0 or motion.begin - float(run.t[0]) >= 0.0
        if program is not None and request is not None and is_whole and not is_guided:
            start = _row(run, "q_cmd", max(before, 0))
            yield Section(motion, min(request.t, motion.begin), until, start, program)
            continue
        yield _stream(run, motion, until, request, notes, measured=is_guided)


def _stream(
    run: RecordedData,
    motion: RecordedMotion,
    until: float,
    request: RecordedEvent | None,
    notes: list[str],
    *,
    measured: bool,
) -> Section:
    """A section of set-points: of a stream of targets, an FRI session, another client, or one that began before."""
    name = "" if request is None else request.name
    mode: wire.Mode | None = None
    session: RecordedSession | None = None
    t, q = run.t, run["q" if measured else "q_cmd"]
    if request is not None and name == "ServoOpen":
        mode = restored(request.content, wire.ServoOpen).mode
    elif request is not None and name == "FriOpen":
        opened = restored(request.content, wire.FriOpen)
        mode = opened.mode
        if opened.command in _LOADS:
            sent = [one for one in FriCommands.of(run) if motion.begin <= one.begin <= until]
            if sent and sent[0].is_answered.any():
                session = RecordedSession(opened, sent[0])
            else:
                notes.append(
                    f"motion {motion.id}: the {opened.command.name.lower()} that its FRI client superposed is left "
                    "out: the recording has no cycles of the session"
                )
        if f"{FRI}q_cmd" in run:
            t, q = run[f"{FRI}t"], run[f"{FRI}q_cmd"]
    elif not measured:
        mode = _mode_at(run, 0.5 * (motion.begin + until))  # it is reported a moment after the begin
    inside = (t >= motion.begin) & (t <= until) & ~np.isnan(q).any(axis=1)
    times, rows = np.unique(t[inside], return_index=True)
    points = q[inside][rows]
    moves = len(times) > 1 and bool(np.ptp(points, axis=0).max() > _STILL)
    stream = Trajectory.of(times, points, robot=run.facts["robot"]) if moves and session is None else None
    begin = int(np.searchsorted(run.t, motion.begin).clip(0, len(run.t) - 1))
    start = points[0] if len(points) else _row(run, "q_cmd", begin)
    return Section(motion, motion.begin, until, start, session=session, stream=stream, mode=mode)


def _row(run: RecordedData, name: str, index: int) -> Array:
    """A row of joint positions; where it has none the nearest that has, shape (7,) [rad]."""
    known = np.flatnonzero(~np.isnan(run[name]).any(axis=1))
    nearest = int(known[np.abs(known - index).argmin()])
    return np.asarray(run[name][nearest], dtype=np.float64)


def _mode_at(run: RecordedData, t: float) -> wire.Mode | None:
    """The control mode in force at a time [s]; None: it was not recorded, or is that of hand guiding."""
    found: Any = None
    for event in run.events:
        if event.kind == "signals" and "mode" in event.content and (found is None or event.t <= t):
            found = event.content["mode"].get("mode")
    if not isinstance(found, dict) or found.get("type") == "HandGuidingMode":
        return None
    mode: wire.Mode = restored(found, wire.Mode)
    return mode


# --------------------------------------------------------------------------------------- what else happened


def _steps(run: RecordedData) -> Iterator[RepeatedStep]:
    """Requests besides programs, and what came from outside."""
    for event in run.events:
        if event.kind == REQUEST and event.name in _KINDS:
            yield RepeatedStep(event.t, restored(event.content, _KINDS[event.name]))
    changes = [
        (event.t, restored(event.content, wire.SafetyChanged))
        for event in run.events
        if event.name == "SafetyChanged" and event.kind == "event"
    ]
    if not changes:
        return
    first = (changes[0][0], wire.SafetyChanged(bits=wire.SafetyBits.NONE, mode=changes[0][1].mode, text=""))
    seen = run["safety"] if "safety" in run else np.zeros(len(run.t), np.int64)
    for (last, before), (t, now) in pairwise([first, *changes]):
        if now.mode != before.mode:
            yield RepeatedStep(t, word=now.mode.name.lower())
        begun = next((word for bit, word in _STOPS if now.bits & ~before.bits & bit), "")
        if begun:
            bit = next(bit for bit, word in _STOPS if word == begun)
            states = run.t[((seen & int(bit)) != 0) & (run.t <= t) & ((run.t > last) | (last == t))]
            yield RepeatedStep(float(states[0]) if len(states) else t, word=begun)  # an event may come late
        elif before.bits & ~now.bits & _ANY_STOP and not now.bits & _ANY_STOP:
            yield RepeatedStep(t, word="clear")
