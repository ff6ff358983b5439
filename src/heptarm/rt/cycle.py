"""One turn of the loop: datagram in, answer out, everything that happened into shared memory. No socket, no clock."""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace

from heptarm.errors import CommandRejected
from heptarm.fri import messages as m
from heptarm.fri.guard import Guard
from heptarm.fri.limits import Limits
from heptarm.fri.policy import Filler, Policy
from heptarm.fri.pose_guard import PoseLimits
from heptarm.fri.session import Session
from heptarm.fri.setpoint import NOTHING, Setpoint
from heptarm.fri.silence import carried_on
from heptarm.fri.statistics import Histogram
from heptarm.fri.template import Sample
from heptarm.fri.version import Version
from heptarm.rt import layout as at
from heptarm.rt import limited
from heptarm.rt.exchange import Exchange
from heptarm.rt.output import Output
from heptarm.rt.params import Params
from heptarm.rt.posing import Posing
from heptarm.rt.record import NAN6, NAN7, NOTHING_SENT, Record, Sent
from heptarm.rt.state import State

Law = Callable[[State, Output, Params], object]

#: After a silence of this many command periods commanding goes on from where the arm has come to.
SILENT_PERIODS = 5
#: A silence is at least as long [ns]: up to then what was skipped is done evenly towards the wish.
SILENT_LEAST = 25_000_000
#: A command given this long before commanding begins still counts [ns].
GRACE = 50_000_000
#: How the event begins that tells of a law which failed.
LAW_FAILED = "the law failed, the arm brakes: "


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
        layout, session, guard, posing, filler, exchange, record, law: what it is made of.
        is_ending: it brakes, whatever is commanded.
        mirrored: last mirrored position and the message's counter; None outside COMMANDING_WAIT.
        slope: interpolator's speed then [rad/s].
        started: when commands became effective [ns].
        commands_seen: commands of the user's process that were taken.
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
        self.exchange = Exchange(layout)
        self.record = Record(layout, self.session)
        self._out = Output(self.exchange.outputs)
        self.commands_seen = layout.commands.count
        self._restarts = 0
        self._skipped = 0  # cycles since the last setpoint of which nothing was heard
        self.mirrored: tuple[m.Joints, int] | None = None  # last mirrored position and its sequence
        self.slope: Sequence[float] = NAN7
        self.started = 0
        self._answered = False
        self._fresh: Sample | None = None

    # --------------------------------------------------------------------------------------------- a message

    def turn(self, datagram: bytes, received: int) -> bytes | None:
        """Take a datagram and make its answer; `finish` has to follow.

        Args:
            datagram: its octets.
            received: monotonic clock at its receipt [ns].
        """
        session, record, exchange = self.session, self.record, self.exchange
        record.flags, record.sent, self._answered, before = 0, NOTHING_SENT, False, session.received
        last = session.sample
        heard = last.sequence if last is not None else 0
        self._fresh = sample = session.receive(datagram, received)
        if sample is None:
            return None
        exchange.look(sample)
        record.signals, record.state.signals = exchange.numbers, exchange.signals
        self._follow(sample, received, before, sample.sequence - heard)
        record.ipo, record.ipo_e1 = self.posing.on_wire, self.posing.ipo_e1
        if not session.is_due or session.version is None:
            return None
        exchange.take()
        if session.is_commanding and session.mode in _JOINT_MODES and sample.q_ipo is not None:
            setpoint = self._setpoint(sample, received)
            self._count(limited=self.guard.was_limited)
        elif session.is_commanding and session.mode not in _JOINT_MODES and self.posing.guard.is_started:
            setpoint = self._posed(sample, received)
            self._count(limited=self.posing.guard.was_limited)
        else:
            setpoint = NOTHING
        if not exchange.is_idle:
            exchange.write()
            setpoint = exchange.add(setpoint, session.version, lambda text: record.tell(received, text))
        try:
            octets = session.answer(setpoint)
        except CommandRejected as refusal:
            exchange.forget()
            record.tell(received, str(refusal))
            octets = session.answer(replace(setpoint, io=(), transformations=()))
        self._answered = octets is not None
        return octets

    def _count(self, *, limited: bool) -> None:
        """Note how a setpoint came about."""
        self.record.flags |= at.LIMITED if limited else 0
        self.session.counters.limited += limited
        self.session.counters.filled += bool(self.record.flags & at.FILLED)

    def finish(self, now: int) -> None:
        """Publish the turn; called after its answer has left at `now` [ns]."""
        session, header = self.session, self.layout.header
        if self._answered:
            session.answered(now)
            self.record.flags |= at.ANSWERED
        self.record.tell_all()
        if self._fresh is not None:
            self.record.publish(self._fresh, now - session.received if self._answered else 0)
        session.counters.save(header, at.COUNTS)
        if self.guard.was_limited:
            limited.publish(self.layout, self.guard.report)
        if self.posing.guard.was_limited:
            limited.publish(self.layout, self.posing.guard.report)
        header[at.BEAT] = now

    def idle(self, now: int) -> None:
        """Nothing has come for a while."""
        self.layout.header[at.BEAT] = now
        self.record.tell_all()

    def end(self) -> None:
        """From now on brake, whatever is commanded."""
        self.is_ending = True

    @property
    def may_end(self) -> bool:
        """Nothing moves by this client."""
        return all(one.is_still or not one.is_started for one in (self.guard, self.posing.guard))

    # ----------------------------------------------------------------------------------------- what is wanted

    def _follow(self, sample: Sample, received: int, before: int, leap: int) -> None:
        """Keep guard and filler in step with the session's state; `leap` is how far the controller's counter went."""
        step = leap if 0 < leap <= _MOST_LOST else 1
        session, guard, posing, record = self.session, self.guard, self.posing, self.record
        by_pose = session.mode is m.CommandMode.CARTESIAN_POSE
        if by_pose:
            posing.look(sample.message)
        elif posing.knows:
            posing.guard.stop()
            posing.forget()
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
                record.ticks = -1
                # a command given just before the start counts, an old one does not
                self.commands_seen = max(0, self.layout.commands.count - 1)
                self.started = received
                step = 1
            elif (silent := self._silent(leap, received - before, period)) > 0.0:
                if by_pose:
                    posing.resume(sample.message, self.layout.states.newest(), time=silent, period=period)
                else:
                    self._resume(sample, time=silent, period=period)
            else:
                self._skipped = (step - 1) // session.multiplier
            record.ticks += step  # the controller's time goes on while messages are lost
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

    def _silent(self, leap: int, elapsed: int, period: float) -> float:
        """How long nothing was heard, by the controller's counter [s]; 0.0 if not for long."""
        time = leap * self.session.period if 0 < leap <= _MOST_LOST else elapsed
        return time * 1e-9 if time > max(SILENT_PERIODS * period * 1e9, SILENT_LEAST) else 0.0

    def _resume(self, sample: Sample, *, time: float, period: float) -> None:
        """After a silence: go on from where the arm has come to, with the speed that it still has."""
        guard, words = self.guard, self.layout.states.newest()
        assert words is not None and sample.q is not None
        then, now, is_exact = State(words).q, sample.q, True
        if sample.q_cmd is not None:
            then, now = State(words).q_cmd, sample.q_cmd
        else:  # an arm that is soft may be measured beside its set-point
            is_exact = sample.robot is not None and sample.robot.control_mode is m.ControlMode.POSITION
        chain = [q - v for q, v in zip(guard.q, guard.v, strict=True)]
        speeds = [v / period for v in guard.v]
        places, later = carried_on(
            chain, speeds, then.tolist(), now, time=time, period=period, is_exact=is_exact
        )
        guard.start(places, later, period=period)

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
            self.record.flags |= at.FILLED if self.filler.is_filled else 0
        if wish is None:
            self.record.flags |= at.BRAKING
        reach = ipo if guard.limits.reach < math.inf else None
        limited = self._catch_up(wish, reach)
        q = tuple(guard.position(wish, reach))
        mode = self.session.mode
        limited |= guard.was_limited
        sent_tau = tuple(guard.torque(tau or _ZEROS7)) if mode is m.CommandMode.TORQUE else None
        sent_wrench = tuple(guard.force(wrench or _ZEROS6)) if mode is m.CommandMode.WRENCH else None
        guard.was_limited |= limited
        self.record.sent = Sent(q, sent_tau or NAN7, sent_wrench or NAN6)
        return Setpoint(q=q, tau=sent_tau, wrench=sent_wrench)

    def _posed(self, sample: Sample, now: int) -> Setpoint:
        """The setpoint of a session that commands poses."""
        wish: Sequence[float] | None = None
        elbow: float | None = None
        if not self.is_ending and self.law is not None:
            out = self._call(sample, now)
            wish, elbow = (None, None) if out is None else (out.pose.tolist(), float(out.e1))
        elif not self.is_ending:
            self._take()
            wish = self.filler.pose_wish(now, self.posing.ipo)
            elbow = self.filler.elbow_wish(now, self.posing.ipo_e1)
            self.record.flags |= at.FILLED if self.filler.is_filled else 0
        if wish is None:
            self.record.flags |= at.BRAKING
        pose = self.posing.command(wish, min(self._skipped, _MOST_SKIPPED))
        redundancy = self.posing.command_elbow(elbow)
        self.record.sent = Sent(
            pose=pose.values, e1=math.nan if redundancy is None else redundancy.value
        )
        return Setpoint(pose=pose, redundancy=redundancy)

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
            e1=numbers[at.C_E1] if given & at.GIVEN_E1 else None,
        )

    def _call(self, sample: Sample, now: int) -> Output | None:
        """Let the law decide; if it fails, None, and brake from then on."""
        out, posing, record = self._out, self.posing, self.record
        out.q[:], out.tau[:], out.wrench[:] = sample.q_ipo or NAN7, 0.0, 0.0
        out.pose[:], out.e1 = posing.ipo, posing.ipo_e1
        record.fill(sample, 0)
        self.ask(record.state, out, now)
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
            self.record.tell(now, LAW_FAILED + _words(error))
            self.end()


_MOST_SKIPPED = 25
#: A counter that leaps further has been changed, not been lost.
_MOST_LOST = 1000
_ZEROS7, _ZEROS6 = (0.0,) * 7, (0.0,) * 6
_JOINT_MODES = (m.CommandMode.POSITION, m.CommandMode.TORQUE, m.CommandMode.WRENCH)


def _words(error: Exception) -> str:
    """An error in one line, with where it came up."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({place.filename.rpartition('/')[2]}, line {place.lineno})"
