"""One turn of the loop: datagram in, answer out, everything that happened into shared memory. No socket, no clock."""

from __future__ import annotations

import json
import math
import struct
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.fri import messages as m
from heptarm.fri.event import Kind
from heptarm.fri.guard import Guard, Limits
from heptarm.fri.policy import Filler, Policy
from heptarm.fri.pose_guard import PoseLimits
from heptarm.fri.session import Session
from heptarm.fri.setpoint import Setpoint
from heptarm.fri.statistics import Histogram
from heptarm.fri.template import Sample
from heptarm.fri.version import Version
from heptarm.rt import layout as at
from heptarm.rt import limited
from heptarm.rt.posing import Posing
from heptarm.rt.state import Output, Params, State, information

Law = Callable[[State, Output, Params], object]

#: After a silence of this many command periods the guard begins anew from the last position, at rest.
SILENT_PERIODS = 5
#: A silence is at least as long [ns]: the cabinet goes on with the last speed for a while, and so does the guard.
SILENT_LEAST = 25_000_000
#: A command given this long before commanding begins still counts [ns].
GRACE = 50_000_000
#: How the event begins that tells of a law which failed.
LAW_FAILED = "the law failed, the arm brakes: "
#: An output is written this often, since an answer may be lost.
REPEAT_OUTPUTS = 10
_ROW = struct.Struct(f"=18q{at.STATE_WORDS - 19}d")
_NAN7, _NAN6 = (math.nan,) * 7, (math.nan,) * 6
_NOTHING_SENT = (_NAN7, _NAN7, _NAN6, _NAN7)


class Cycle:
    """The loop's work, sans IO.

    Args:
        layout: the shared memory.
        version: wire format; None takes it from the first datagram.
        limits: what the guard keeps.
        pose_limits: what it keeps of commanded poses; None for the usual ones.
        policy: what is sent without fresh commands.
        law: called in every cycle of COMMANDING_ACTIVE; None takes the commands of the user's process.
        params: of the law.

    Attributes:
        layout, session, guard, posing, filler, law: what it is made of.
        is_ending: it brakes, whatever is commanded.
        mirrored: last mirrored position and the message's counter; None outside COMMANDING_WAIT.
        slope: interpolator's speed then [rad/s].
        ticks: messages since commands became effective.
        started: when they did [ns].
        commands_seen: commands of the user's process that were taken.
        outputs_seen: tick of the outputs that were taken.
        info: robot and connection of the last message, and what seldom changes.
    """

    def __init__(
        self,
        layout: at.Layout,
        *,
        version: Version | None,
        limits: Limits,
        pose_limits: PoseLimits | None = None,
        policy: Policy,
        law: Law | None = None,
        params: Params | None = None,
    ) -> None:
        self.layout = layout
        self.session = Session(version, latency=Histogram(layout.latency), jitter=Histogram(layout.jitter))
        self.guard = Guard(limits)
        self.posing = Posing(pose_limits or PoseLimits())
        self.filler = Filler(policy)
        self.is_ending = False
        self.law = law
        self._params = params
        self._param_tick = -1
        self._out = Output()
        self._slot = memoryview(bytearray(8 * at.STATE_WORDS))
        self._state = State(np.frombuffer(self._slot, dtype=np.float64))
        self.commands_seen = layout.commands.count
        self._restarts = 0
        self._skipped = 0  # cycles since the last setpoint of which nothing was heard
        self.mirrored: tuple[m.Joints, int] | None = None  # last mirrored position and its sequence
        self.slope: Sequence[float] = _NAN7
        self.ticks = 0
        self.started = 0
        self._sent: tuple[Sequence[float], ...] = _NOTHING_SENT
        self._flags = 0
        self._answered = False
        self._fresh: Sample | None = None
        self.info: tuple[object, object, tuple[int, ...]] = (None, None, ())
        self._full: tuple[Sample | None, m.Monitoring] = (None, m.Monitoring(m.Header(0, 0)))
        self.outputs_seen = layout.outputs.tick
        self._outputs: tuple[int, dict[str, float], dict[str, list[float]]] = (0, {}, {})
        self._inputs: tuple[m.IoValue, ...] = ()
        self._trouble = self.session.trouble
        layout.trouble.write(self._trouble)

    # --------------------------------------------------------------------------------------------- a message

    def turn(self, datagram: bytes, received: int) -> bytes | None:
        """Take a datagram and make its answer; `finish` has to follow.

        Args:
            datagram: its octets.
            received: monotonic clock at its receipt [ns].
        """
        session = self.session
        self._flags, self._answered, before = 0, False, session.received
        self._sent = _NOTHING_SENT
        last = session.sample
        heard = last.sequence if last is not None else 0
        self._fresh = sample = session.receive(datagram, received)
        if sample is None:
            return None
        step = sample.sequence - heard
        self._follow(sample, received, before, step if 0 < step <= _MOST_LOST else 1)
        if not session.is_due:
            return None
        if session.is_commanding and session.mode in _JOINT_MODES and sample.q_ipo is not None:
            setpoint = self._setpoint(sample, received)
            self._count(limited=self.guard.was_limited)
        elif session.is_commanding and session.mode not in _JOINT_MODES and self.posing.guard.is_started:
            setpoint = self._posed(sample, received)
            self._count(limited=self.posing.guard.was_limited)
        else:
            setpoint = _NOTHING
        if session.is_commanding:
            setpoint = self._with_io(sample, setpoint)
        try:
            octets = session.answer(setpoint)
        except CommandRejected as refusal:
            self._outputs = (0, {}, {})
            self.tell(received, str(refusal))
            octets = session.answer(replace(setpoint, io=(), transformations=()))
        self._answered = octets is not None
        return octets

    def _count(self, *, limited: bool) -> None:
        """Note how a setpoint came about."""
        self._flags |= at.LIMITED if limited else 0
        self.session.counters.limited += limited
        self.session.counters.filled += bool(self._flags & at.FILLED)

    def finish(self, now: int) -> None:
        """Publish the turn; called after its answer has left at `now` [ns]."""
        session, header = self.session, self.layout.header
        if self._answered:
            session.answered(now)
            self._flags |= at.ANSWERED
        for event in session.events():
            self.tell(event.at, event.text, event.kind)
        if session.trouble != self._trouble:
            self._trouble = session.trouble
            self.layout.trouble.write(self._trouble)
        if self._fresh is not None:
            self._publish(self._fresh, now - session.received if self._answered else 0)
        session.counters.save(header, at.COUNTS)
        if self.guard.was_limited:
            limited.publish(self.layout, self.guard.report)
        if self.posing.guard.was_limited:
            limited.publish(self.layout, self.posing.guard.report)
        header[at.BEAT] = now

    def idle(self, now: int) -> None:
        """Nothing has come for a while."""
        self.layout.header[at.BEAT] = now
        if self._trouble != self.session.trouble:
            self._trouble = self.session.trouble
            self.layout.trouble.write(self._trouble)

    def end(self) -> None:
        """From now on brake, whatever is commanded."""
        self.is_ending = True

    @property
    def may_end(self) -> bool:
        """Nothing moves by this client."""
        return all(one.is_still or not one.is_started for one in (self.guard, self.posing.guard))

    # ----------------------------------------------------------------------------------------- what is wanted

    def _follow(self, sample: Sample, received: int, before: int, step: int) -> None:
        """Keep guard and filler in step with the session's state."""
        session, guard, posing = self.session, self.guard, self.posing
        by_pose = session.mode is m.CommandMode.CARTESIAN_POSE
        if by_pose:
            posing.look(self._message(sample))
        again = session.counters.restarts != self._restarts
        self._restarts = session.counters.restarts
        self._skipped = 0
        if again or not session.is_commanding:
            guard.stop()
            posing.guard.stop()
        if session.is_commanding:
            period = session.period * session.multiplier * 1e-9 or 1e-3
            if not (posing.guard if by_pose else guard).is_started:
                if by_pose:
                    posing.begin(period, again=again)
                elif self.mirrored is not None and not again:
                    guard.start(self.mirrored[0], self.slope, period=period)
                elif sample.q_ipo is not None:  # the client was not there when commanding began
                    guard.start(sample.q_ipo, _ZEROS7, period=period)
                self.filler.start()
                self.ticks = -1
                # a command given just before the start counts, an old one does not
                self.commands_seen = max(0, self.layout.commands.count - 1)
                self.started = received
                step = 1
            elif received - before > max(SILENT_PERIODS * period * 1e9, SILENT_LEAST):
                if by_pose:
                    posing.resume(period)
                else:
                    guard.start(guard.q, _ZEROS7, period=period)
            else:
                self._skipped = (step - 1) // session.multiplier
            self.ticks += step  # the controller's time goes on while messages are lost
            self.mirrored = None
        elif session.state is m.SessionState.COMMANDING_WAIT and by_pose:
            posing.mirror(sample.sequence, session.period)
        elif session.state is m.SessionState.COMMANDING_WAIT and sample.q_ipo is not None:
            last, self.mirrored = self.mirrored, (sample.q_ipo, sample.sequence)
            self.slope = _ZEROS7
            if last is not None and session.period and sample.sequence > last[1]:
                gap = (sample.sequence - last[1]) * session.period * 1e-9
                self.slope = tuple((new - old) / gap for new, old in zip(sample.q_ipo, last[0], strict=True))
        else:
            self.mirrored = None
            posing.forget()

    def _setpoint(self, sample: Sample, now: int) -> Setpoint:
        guard, ipo = self.guard, sample.q_ipo
        assert ipo is not None
        tau: Sequence[float] | None = None
        wrench: Sequence[float] | None = None
        wish: Sequence[float] | None
        if self.is_ending:
            wish = None
            tau, wrench = _ZEROS7, _ZEROS6
        elif self.law is not None:
            out = self._call(sample, now)
            if out is None:
                wish, tau, wrench = None, _ZEROS7, _ZEROS6
            else:
                wish, tau, wrench = out.q.tolist(), out.tau.tolist(), out.wrench.tolist()
        else:
            self._take()
            wish = self.filler.wish(now, ipo)
            tau, wrench = self.filler.efforts(now)
            self._flags |= at.FILLED if self.filler.is_filled else 0
        if wish is None:
            self._flags |= at.BRAKING
        reach = ipo if guard.limits.reach < math.inf else None
        limited = self._catch_up(wish, reach)
        q = tuple(guard.position(wish, reach))
        mode = self.session.mode
        limited |= guard.was_limited
        sent_tau = tuple(guard.torque(tau or _ZEROS7)) if mode is m.CommandMode.TORQUE else None
        sent_wrench = tuple(guard.force(wrench or _ZEROS6)) if mode is m.CommandMode.WRENCH else None
        guard.was_limited |= limited
        self._sent = (q, sent_tau or _NAN7, sent_wrench or _NAN6, _NAN7)
        return Setpoint(q=q, tau=sent_tau, wrench=sent_wrench)

    def _posed(self, sample: Sample, now: int) -> Setpoint:
        """The setpoint of a session that commands poses; its redundancy stays the interpolator's."""
        wish: Sequence[float] | None = None
        if not self.is_ending and self.law is not None:
            out = self._call(sample, now)
            wish = None if out is None else out.pose.tolist()
        elif not self.is_ending:
            self._take()
            wish = self.filler.pose_wish(now, self.posing.ipo)
            self._flags |= at.FILLED if self.filler.is_filled else 0
        if wish is None:
            self._flags |= at.BRAKING
        pose = self.posing.command(wish, min(self._skipped, _MOST_SKIPPED))
        self._sent = (*_NOTHING_SENT[:3], pose.values)
        return Setpoint(pose=pose)

    def _catch_up(self, wish: Sequence[float] | None, reach: Sequence[float] | None) -> bool:
        """Do the cycles that were skipped, evenly towards the wish; says whether one of them was limited.

        The cabinet has gone on meanwhile: without this its next setpoint would lie behind it.
        """
        guard, steps, limited = self.guard, min(self._skipped, _MOST_SKIPPED) + 1, False
        before = tuple(guard.r)
        for k in range(1, steps):
            between = wish and [old + (new - old) * k / steps for old, new in zip(before, wish, strict=True)]
            guard.position(between, reach)
            limited |= guard.was_limited
        return limited

    def _take(self) -> None:
        """The newest command of the user's process, if there is a new one."""
        ring = self.layout.commands
        if ring.count == self.commands_seen:
            return
        words = ring.read(ring.count - 1)
        if words is None:  # just being written: next time
            return
        self.commands_seen = ring.count
        ints = words.view("int64")
        given, numbers = int(ints[at.C_GIVEN]), words.tolist()
        when = int(ints[at.C_AT])
        if when + GRACE < self.started:
            return
        self.filler.command(
            when,
            q=numbers[at.C_Q : at.C_Q + 7] if given & at.GIVEN_Q else None,
            tau=numbers[at.C_TAU : at.C_TAU + 7] if given & at.GIVEN_TAU else None,
            wrench=numbers[at.C_WRENCH : at.C_WRENCH + 6] if given & at.GIVEN_WRENCH else None,
            pose=numbers[at.C_POSE : at.C_POSE + 7] if given & at.GIVEN_POSE else None,
        )

    def _call(self, sample: Sample, now: int) -> Output | None:
        """Let the law decide; if it fails, None, and brake from then on."""
        out = self._out
        out.q[:], out.tau[:], out.wrench[:] = sample.q_ipo or _NAN7, 0.0, 0.0
        out.pose[:] = self.posing.ipo
        _ROW.pack_into(self._slot, 8, *self._row(sample, 0))
        self.ask(self._state, out, now)
        return None if self.is_ending else out

    def ask(self, state: State, out: Output, now: int) -> None:
        """Call the law with its newest parameters; if it fails, brake from now on."""
        assert self.law is not None and self._params is not None
        ring = self.layout.params
        if ring.count != self._param_tick:
            words = ring.read(ring.count - 1)
            if words is not None:
                self._param_tick = ring.count
                self._params.replace(words[1:])
        try:
            self.law(state, out, self._params)
        except Exception as error:
            self.tell(now, LAW_FAILED + _words(error))
            self.end()

    @property
    def is_plain(self) -> bool:
        """No outputs and no transformations wait to be sent."""
        return not self._outputs[0] and not self._outputs[2]

    def _with_io(self, sample: Sample, setpoint: Setpoint) -> Setpoint:
        """Adds the outputs and transformations that the user's process has left."""
        note = self.layout.outputs
        if note.tick != self.outputs_seen:
            text = note.read()
            if text is not None:
                self.outputs_seen = note.tick
                given = json.loads(text)
                self._outputs = (REPEAT_OUTPUTS, given["io"], given["transformations"])
        left, outputs, frames = self._outputs
        if not left and not frames:
            return setpoint
        self._outputs = (max(0, left - 1), outputs, frames)
        offered = self._message(sample).monitor
        kinds = {one.name: one.type for one in (offered.io if offered is not None else ())}
        return replace(
            setpoint,
            io=tuple(
                m.IoValue(name, kinds.get(name, m.IoType.DIGITAL), m.IoDirection.OUTPUT, value)
                for name, value in outputs.items()
            )
            if left
            else (),
            transformations=tuple(m.Transformation(name, tuple(values)) for name, values in frames.items()),
        )

    # ------------------------------------------------------------------------------------------- what is told

    def tell(self, now: int, text: str, kind: Kind = Kind.CLIENT) -> None:
        """Leave an event for the user's process."""
        ring = self.layout.events
        octets = text.encode()[: at.EVENT_TEXT].ljust(at.EVENT_TEXT, b"\0")
        slot = ring.begin()
        ring.ints[slot, 1], ring.ints[slot, 2] = now, _KINDS.index(kind)
        ring.ints[slot, 3:] = memoryview(octets).cast("q")
        ring.end()

    def _row(self, sample: Sample, latency: int) -> tuple[float, ...]:
        """The words of a state, without the sequence word."""
        session = self.session
        robot, link = sample.robot, sample.connection
        if self.info[0] is not robot or self.info[1] is not link:
            full = self._message(sample)
            self.info = (robot, link, information(full))
            self._read_inputs(full)
        seconds, nanos = sample.stamp
        wrench, pose, e1 = _NAN6, _NAN7, math.nan
        if session.version is not None and session.version.traits.quaternions:
            monitor = self._message(sample).monitor or m.MonitorData()
            wrench = monitor.wrench or _NAN6  # type: ignore[assignment]
            pose = monitor.pose.values if monitor.pose is not None else _NAN7  # type: ignore[assignment]
            e1 = monitor.redundancy.value if monitor.redundancy is not None else math.nan
        overlay, safety, operation, control, drive, multiplier = self.info[2]
        sent = self._sent
        return (
            session.received,
            sample.sequence,
            seconds * 1_000_000_000 + nanos,
            session.state,
            session.quality,
            session.mode,
            overlay,
            safety,
            operation,
            control,
            drive,
            session.period,
            multiplier,
            latency,
            self._flags,
            session.reflected,
            session.sent,
            max(0, self.ticks) if session.is_commanding else 0,
            sample.tracking,
            *(sample.q or _NAN7),
            *(sample.tau or _NAN7),
            *(sample.tau_cmd or _NAN7),
            *(sample.tau_ext or _NAN7),
            *(sample.q_cmd or _NAN7),
            *(sample.q_ipo or _NAN7),
            *wrench,
            *pose,
            e1,
            *sent[0],
            *sent[1],
            *sent[2],
            *(self.posing.on_wire if session.is_commanding else _NAN7),
            *sent[3],
        )

    def _message(self, sample: Sample) -> m.Monitoring:
        """The full message, decoded once."""
        if self._full[0] is not sample:
            self._full = (sample, sample.message)
        return self._full[1]

    def _read_inputs(self, full: m.Monitoring) -> None:
        """Leave the signals for the user's process when they change."""
        signals = full.monitor.io if full.monitor is not None else ()
        if signals != self._inputs:
            self._inputs = signals
            self.layout.inputs.write(json.dumps({one.name: one.value for one in signals}))

    def _publish(self, sample: Sample, latency: int) -> None:
        ring = self.layout.states
        row = self._row(sample, latency)
        _ROW.pack_into(self._slot, 8, *row)
        slot = ring.begin()
        ring.ints[slot, 1:] = self._slot[8:].cast("q")
        ring.end()


_NOTHING = Setpoint()
_MOST_SKIPPED = 25
#: A counter that leaps further has been changed, not been lost.
_MOST_LOST = 1000
_KINDS = list(Kind)
_ZEROS7, _ZEROS6 = (0.0,) * 7, (0.0,) * 6
_JOINT_MODES = (m.CommandMode.POSITION, m.CommandMode.TORQUE, m.CommandMode.WRENCH)


def _words(error: Exception) -> str:
    """An error in one line, with where it came up."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({place.filename.rpartition('/')[2]}, line {place.lineno})"
