"""The run of a twin: what a recording commands goes to a virtual cabinet, when it was commanded."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from math import isnan
from pathlib import Path
from typing import Any, Literal

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.connect import connect
from heptarm.arm.link.target import parse_target
from heptarm.arm.motion.handle import MotionHandle
from heptarm.arm.translate.modes import mode_message, read_mode
from heptarm.errors import CommandRejected, HeptarmError, MotionError
from heptarm.fri.guard.joint_guard import Limits
from heptarm.record.recording import Recording, load
from heptarm.twin.commands import Commands, RecordedSession, RepeatedStep, Section, commands_of
from heptarm.twin.comparison import (
    SETTLE,
    Repetition,
    Twin,
    aligned_twin,
    bands_of,
    deviations_of,
)
from heptarm.twin.fri_law import RecordedLaw
from heptarm.values.checks import instance, within
from heptarm.values.frames import FLANGE
from heptarm.values.mode.mode import HandGuiding, Mode, check_mode
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.robot import RobotModel, known_robot
from heptarm.values.state import State
from heptarm.values.tool import Tool
from heptarm.wire import messages as wire

#: Simulated seconds per second by default; a stream of set-points needs a state of the cabinet for each, and on a busy
#: machine the client of an FRI session needs more time for its answers than the recorded one had.
_FASTER, _SLOWER = 5.0, 0.5
#: States of the twin per second of its clock [Hz].
_RATE = 500.0
#: Targets per second of a stream [Hz], and its watchdog [s].
_STREAM_RATE, _STREAM_WATCHDOG = 100.0, 2.0
#: At the end of a stream the arm has settled when no joint deviates more [rad] or is faster [rad/s].
_SETTLED, _STILL = 5e-3, 0.02
#: The arm is where a motion began if no joint is farther away [rad].
_THERE = 1e-6
#: A motion may take this many times as long as it was recorded, and so much longer, before the twin goes on [s].
_TIMES, _LONGER = 3.0, 10.0
#: Longest wait for the first state of a motion, and between two looks at an FRI session [s].
_BEGINS, _LOOKS = 30.0, 0.05
#: A limit of loads and their rates that limits nothing [Nm, N, Nm/s, N/s].
_ANY = 1e9


def replay_in_sim(
    recording: str | Path | Recording,
    *,
    target: str | None = None,
    arm: str = "",
    speed: float = 1.0,
    mode: Mode | None = None,
    tool: Tool | None = None,
    bands: Mapping[str, float] | None = None,
) -> Twin:
    """Carry out in the simulator what a recording commands, and compare both over one time line.

    Programs are sent as they were sent, with their control modes, break conditions, triggers and tools; so are
    pauses, stops and changes of the override, at their times after the begin of the running motion. Emergency stops,
    opened safeguards and protective stops come when they came. What the arm does by itself, such as a break condition
    that fires or a drive that trips, has to happen in the simulator as well. Torques and wrenches that an FRI client
    superposed are superposed again, by an FRI session. Where no program is in the file (a servo stream, other FRI
    sessions, another client's motion, one that began before the file), the recorded set-points are repeated as a
    stream, in the recorded control mode. Pauses between motions take no longer than the arm needs to
    come to rest.

    Args:
        recording: the file, or what `load` has read; a black box is one, too.
        target: the simulator: "sim://MODEL?OPTION=VALUE" for a private one with a scene or a payload, or
            "sim://HOST:PORT". None: a private one of the recorded robot.
        arm: which one, in a recording of several arms.
        speed: what if: a factor on the speed, (0, 1], by the override.
        mode: what if: control mode of every motion; None: as recorded.
        tool: what if: the tool on the flange, in place of the recorded ones. Motions, conditions and modes find the
            frames that they name by the same names. None: as recorded.
        bands: largest deviations that are no difference, by signal; of those left out `heptarm.twin.comparison.BANDS`.

    Returns:
        Both recordings, how far each signal deviates, and where they part.

    Raises:
        CommandRejected: the recording commands nothing, is of another robot than the simulator, or a later version
            wrote it; or the target is no simulator. LimitError: a speed or a band outside its range.
        MissingExtra: the packages of the simulator or of recordings are not installed.
        ConnectFailed: the simulator does not start.
    """
    instance(arm, str, "arm")
    if target is not None and not instance(target, str, "target").startswith("sim://"):
        raise CommandRejected(
            f"target must be a simulator, sim://..., got {target!r}: a twin moves unattended",
            parameter="target",
            value=target,
            hint="replay a trajectory on a robot with arm.replay(run.trajectory())",
        )
    within(speed, "speed", 0.0, 1.0, above=True)
    check_mode(mode)
    if tool is not None:
        instance(tool, Tool, "tool")
    limits = bands_of(bands)
    if isinstance(recording, Recording) and arm:
        raise CommandRejected(
            "arm must be chosen when the recording is read",
            parameter="arm",
            value=arm,
            hint="ha.load(path, arm=...)",
        )
    run = recording if isinstance(recording, Recording) else load(recording, arm=arm)
    commands = commands_of(run)
    with (
        tempfile.TemporaryDirectory(prefix="heptarm-twin-") as folder,
        connect(
            _target(target, commands), watchdog=5.0, black_box=False, state_rate=_RATE, timeout=30.0
        ) as sim,
    ):
        _check_robot(sim, commands, run)
        runner = _Run(sim, commands, speed, mode, tool)
        runner.prepare()
        path = Path(folder) / "simulated.mcap"
        with sim.record(path, rate=_RATE):
            runner.execute()
        simulated = load(path)
    simulated, motions, times = aligned_twin(run, simulated, runner.repetitions, same_speed=speed == 1.0)
    simulated = replace(simulated, path=Path("simulated"))
    deviations = deviations_of(run, simulated, times, limits)
    return Twin(run, simulated, deviations, motions, (*commands.notes, *runner.notes))


def _target(target: str | None, commands: Commands) -> str:
    """The simulator; a private one is as fast as what it has to repeat allows."""
    is_timed = any(step.word for step in commands.steps) or any(
        section.program is None for section in commands.sections
    )
    has_session = any(section.session is not None for section in commands.sections)
    speed = _SLOWER if has_session else 1.0 if is_timed else _FASTER
    if target is None:
        name, _, flange = commands.robot.name.partition("+")
        return f"sim://{name}?speed={speed:g}" + (f"&flange={flange}" if flange else "")
    parsed = parse_target(target)
    if not parsed.is_private or "speed" in dict(parsed.options):
        return target
    return f"{target}{'&' if '?' in target else '?'}speed={speed:g}"


def _check_robot(arm: Arm, commands: Commands, run: Recording) -> None:
    """Refuse a simulator of another robot."""
    recorded, given = commands.robot, known_robot(arm.robot.name)
    if given is None or given.base_name != recorded.base_name:
        raise CommandRejected(
            f"target must be an {recorded.base_name}, the robot of {run.path.name}, got an {arm.robot.name}",
            parameter="target",
            value=arm.robot.name,
            allowed=recorded.base_name,
            hint=f'leave out the target, or give "sim://{recorded.base_name}"',
        )


@dataclass(slots=True)
class _Seen:
    """Number of the motion that the twin runs; 0: none was seen."""

    number: int = 0

    def note(self, state: State) -> None:
        """Look for it in a state."""
        if not self.number and state.motion is not None and state.motion.active:
            self.number = state.motion.id


class _Run:
    """What is going on in a virtual cabinet while a recording is repeated.

    Args:
        arm: in control of it.
        commands: what is repeated.
        speed: factor on the override.
        mode: control mode of every motion; None: as recorded.
        tool: on the flange; None: as recorded.

    Attributes:
        repetitions: what ran.
        notes: what could not be repeated.
    """

    def __init__(
        self,
        arm: Arm,
        commands: Commands,
        speed: float,
        mode: Mode | None,
        tool: Tool | None,
    ) -> None:
        self._arm, self._commands = arm, commands
        self._speed, self._mode, self._tool = speed, mode, tool
        self._handles: list[tuple[Section, MotionHandle]] = []
        self._numbers: dict[int, int] = {}  # of the recording's programs in the twin
        self.repetitions: list[Repetition] = []
        self.notes: list[str] = []

    def prepare(self) -> None:
        """Move to the begin, with the tool that was attached."""
        commands = self._commands
        if self._tool is not None:
            self._arm.attach_tool(self._tool)
        else:
            known = {tool.name: tool for tool in commands.tools}
            for tool in commands.tools:
                self._request(wire.DefineTool(tool=tool))
            if commands.tool:
                frame = "" if commands.frame == FLANGE else commands.frame
                self._request(wire.AttachTool(name=commands.tool, frame=frame))
            if commands.workpiece in known:
                self._request(wire.AttachLoad(load=known[commands.workpiece], attached=True))
        self._approach(commands.sections[0])
        self._request(wire.SetOverride(value=commands.override * self._speed))

    def execute(self) -> None:
        """Repeat everything in its order."""
        sections, steps = self._commands.sections, self._commands.steps
        first = min(section.sent for section in sections)
        # what was set before the first program holds when it begins
        queue: list[tuple[float, Section | RepeatedStep]] = [
            (max(step.t, first), step) for step in steps if step.t >= 0.0 or not step.word
        ]
        queue += [(section.sent, section) for section in sections]
        for t, entry in sorted(queue, key=lambda pair: pair[0]):
            # what comes from outside is scheduled before its time: the simulator keeps that to a tick
            if isinstance(entry, Section) or not entry.word or self._running(t) is None:
                self._wait_until(t)
            if isinstance(entry, RepeatedStep):
                self._repeat(entry)
                continue
            self._begin(entry)
        self._wait_for_rest()

    # ---------------------------------------------------------------------------------------- programs

    def _begin(self, section: Section) -> None:
        if section.program is not None:
            self._send(section, section.program)
        elif section.session is not None:
            self._answer(section, section.session)
        elif section.stream is not None:
            self._stream(section)
        else:
            self.notes.append(f"motion {section.motion.id}: the arm does not move in it")

    def _send(self, section: Section, program: wire.Run) -> None:
        """Send a program as it was sent."""
        if not self._handles:
            self._approach(section)
        if self._mode is not None:
            message = mode_message(self._mode)
            items = tuple(_with_mode(item, message) for item in program.items)
            program = wire.Run(items=items, when=program.when)
        try:
            handle = MotionHandle.send(self._arm.connection, program, count=len(program.items))
        except HeptarmError as error:
            self.repetitions.append(Repetition(section, 0, str(error)))
            return
        self._numbers[section.motion.id] = handle.id
        self.repetitions.append(Repetition(section, handle.id))
        self._handles.append((section, handle))

    def _stream(self, section: Section) -> None:
        """Repeat set-points as a stream of targets."""
        assert section.stream is not None
        self._wait_for_rest()
        self._approach(section)
        mode = (
            self._mode if self._mode is not None else None if section.mode is None else _mode_of(section.mode)
        )
        stamp = self._now()
        for step in self._stops_within(section):
            self._schedule(step.word, stamp + (step.t - section.motion.begin))
        with self._repetition(section) as seen:
            self._follow(section.stream, mode, seen.note)

    def _answer(self, section: Section, session: RecordedSession) -> None:
        """Repeat what an FRI client superposed, by an FRI client."""
        self._wait_for_rest()
        self._approach(section)
        opened, commands = session.opened, session.commands
        mode = _mode_of(opened.mode) if self._mode is None and opened.mode is not None else self._mode
        kind: Literal["torque", "wrench"]
        load: Literal["tau", "wrench"]
        kind, load = (
            ("torque", "tau") if opened.command is wire.FriCommandMode.TORQUE else ("wrench", "wrench")
        )
        with (
            self._repetition(section) as seen,
            self._arm.fri(
                kind,
                period_ms=round(1e3 * opened.period),
                multiplier=opened.receive_multiplier,
                mode=mode,
                law=RecordedLaw(commands, load, speed=self._speed),
                limits=_unlimited(self._arm.robot),
                timeout=_BEGINS,
            ) as client,
        ):
            stamp = self._now()
            seen.note(self._arm.state)
            for step in self._stops_within(section):
                self._schedule(step.word, stamp + (step.t - commands.begin) / self._speed)
            while client.active and client.state.t < commands.t[-1] / self._speed:
                client.wait(_LOOKS)

    @contextmanager
    def _repetition(self, section: Section) -> Iterator[_Seen]:
        """Note the number of a motion that a client repeats here, or why it is refused."""
        seen, refusal = _Seen(), ""
        try:
            yield seen
        except MotionError:
            pass  # the twin's recording has its cause
        except HeptarmError as error:
            refusal = str(error)
        self._numbers[section.motion.id] = seen.number
        self.repetitions.append(Repetition(section, seen.number, refusal))

    def _follow(self, stream: Trajectory, mode: Mode | None, note: Callable[[State], None]) -> None:
        """Follow set-points by the simulator's clock, which a busy machine holds up, until the arm has settled.

        Args:
            stream: the set-points.
            mode: control mode.
            note: gets each state.
        """
        arm, period = self._arm, 1.0 / _STREAM_RATE
        with arm.servo(
            "joint",
            rate=_STREAM_RATE,
            watchdog=_STREAM_WATCHDOG,
            speed=1.0,
            acceleration=1.0,
            mode=mode,
            min_trajectory_time=period,
        ) as servo:
            begun, t, settled = arm.state.stamp, 0.0, False
            while servo.active and not settled and t < stream.duration + SETTLE * self._speed:
                q, dq = stream.at(t + period * self._speed)  # where it will be when the arm gets there
                servo.set(q, self._speed * dq)
                due = begun + round((t / self._speed + period) * 1e9)

                def is_due(seen: State, due: int = due) -> bool:
                    return seen.stamp >= due or not servo.active

                state = arm.wait_until(is_due, timeout=_STREAM_WATCHDOG)
                note(state)
                t = (state.stamp - begun) * 1e-9 * self._speed
                settled = t >= stream.duration and bool(
                    np.abs(state.q - stream.q[-1]).max() < _SETTLED and np.abs(state.dq).max() < _STILL
                )

    def _stops_within(self, section: Section) -> list[RepeatedStep]:
        return [
            step
            for step in self._commands.steps
            if step.word and section.motion.begin <= step.t <= section.until
        ]

    def _approach(self, section: Section) -> None:
        """Move to where a motion began."""
        robot = self._arm.robot
        start = np.clip(section.start, robot.q_min, robot.q_max)
        with suppress(MotionError):
            if float(np.abs(self._arm.wait_for_rest().q_cmd - start).max()) > _THERE:
                self._arm.move(ptp(start), speed=1.0)

    # --------------------------------------------------------------------------------- what else happened

    def _repeat(self, step: RepeatedStep) -> None:
        """Repeat a request, or what came from outside."""
        running = self._running(step.t)
        if step.word:
            is_streamed = any(
                section.program is None and section.motion.begin <= step.t <= section.until
                for section in self._commands.sections
            )
            if is_streamed:
                return  # scheduled with the stream
            at = self._now() if running is None else self._stamp(running, step.t)
            self._schedule(step.word, at)
            return
        message = step.message
        if isinstance(message, wire.SetOverride):
            message = wire.SetOverride(value=message.value * self._speed)
        elif isinstance(message, wire.Cancel) and message.id:
            if message.id not in self._numbers:
                return
            message = wire.Cancel(id=self._numbers[message.id])
        elif isinstance(message, wire.DefineTool | wire.AttachTool) and self._tool is not None:
            return
        elif isinstance(message, wire.DefineTool | wire.AttachTool | wire.AttachLoad):
            self._wait_for_rest()
        self._request(message)

    def _request(self, message: Any) -> None:
        """Send a request; what the cabinet refuses is noted."""
        try:
            self._arm.connection.request(message)
        except CommandRejected as error:
            self.notes.append(f"{type(message).__name__} was refused: {error.text}")

    def _schedule(self, word: str, seconds: float) -> None:
        """Let the simulated operator act at a time of the simulator's clock [s]."""
        if self._arm.connection.cabinet is None:
            self.notes.append(f"{word}: a simulator that runs by itself has no operator for this program")
            return
        self._arm.operator.do(f"{word}@{max(seconds, 0.0):.3f}")

    # ------------------------------------------------------------------------------------------ times

    def _running(self, t: float) -> tuple[Section, MotionHandle] | None:
        """The program that ran at a time of the recording, if it has begun in the twin."""
        for section, handle in reversed(self._handles):
            if section.motion.begin <= t <= section.until and handle.id:
                return section, handle
        return None

    def _stamp(self, running: tuple[Section, MotionHandle], t: float) -> float:
        """Time of the simulator's clock at a time of the recording [s]."""
        section, handle = running
        return self._began(handle) + (t - section.motion.begin)

    def _began(self, handle: MotionHandle) -> float:
        """When a program began [s], on the simulator's clock; it is waited for."""
        connection, number = self._arm.connection, handle.id
        seen = [
            state for state in connection.history() if state.motion is not None and state.motion.id == number
        ]
        if not seen:
            seen = [
                connection.wait_for(
                    lambda state: handle.done or (state.motion is not None and state.motion.id == number),
                    _BEGINS,
                )
            ]
        return seen[0].stamp * 1e-9

    def _now(self) -> float:
        """The simulator's clock [s]."""
        return self._arm.state.stamp * 1e-9

    def _wait_until(self, t: float) -> None:
        """Wait for a time of the recording: after the begin of the program that ran then, or until the arm rests."""
        running = self._running(t)
        if running is None:
            if self._handles and t > self._handles[-1][0].until:
                self._wait_for_rest()
            return
        stamp, handle = self._stamp(running, t), running[1]
        with suppress(HeptarmError):
            self._arm.connection.wait_for(
                lambda state: handle.done or state.stamp * 1e-9 >= stamp,
                _LONGER + max(0.0, stamp - self._now()) / self._arm.real_time_factor,
            )

    def _wait_for_rest(self) -> None:
        """Wait until every program has ended, or a standstill is all that can be expected, and the arm has settled."""
        for section, handle in self._handles:
            if handle.done:
                continue
            recorded = section.until - section.motion.begin
            limit = (_LONGER + _TIMES * recorded / self._speed) / min(self._arm.real_time_factor, 1.0)
            if isnan(section.motion.end):  # it has not ended in the recording
                self._wait_for_stamp(self._stamp((section, handle), section.until), limit)
                with suppress(HeptarmError):
                    handle.cancel()
            with suppress(HeptarmError):
                handle.wait(timeout=limit)
        if self._handles:
            self._wait_for_stamp(self._now() + SETTLE, _LONGER)

    def _wait_for_stamp(self, stamp: float, limit: float) -> None:
        with suppress(HeptarmError):
            self._arm.connection.wait_for(lambda state: state.stamp * 1e-9 >= stamp, limit)


def _unlimited(robot: RobotModel) -> Limits:
    """Limits of a guard that leaves what the guard of the recorded client let through."""
    least = Limits.of(robot, fraction=1.0, margin=0.0)
    return replace(least, dtau_max=(_ANY,) * 7, wrench_max=(_ANY,) * 6, dwrench_max=(_ANY,) * 6)


def _with_mode(item: wire.Item, mode: wire.Mode | None) -> wire.Item:
    return wire.Item(
        motion=item.motion,
        frame=item.frame,
        mode=mode,
        until=item.until,
        triggers=item.triggers,
        reaction=item.reaction,
    )


def _mode_of(message: wire.Mode) -> Mode | None:
    """The value of a recorded control mode; None: position."""
    mode = read_mode(message)
    return None if isinstance(mode, HandGuiding) else mode
