"""One cycle of the loop, in Python: what native/fri_cycle.c has to do."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from heptarm.errors import CommandRejected
from heptarm.fri.guard.fallback import Policy
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.guard.pose_guard import PoseLimits
from heptarm.fri.guard.torque_guard import TorqueGuard
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.cycle import LAW_FAILED, describe
from heptarm.fri.loop.native import COLLIDED, GAP_PERIODS, GRACE, MIN_GAP, REPEATS, REPEATS_ANALOG
from heptarm.fri.loop.parameters import RateLimiter
from heptarm.fri.loop.settings import LoopSettings
from heptarm.fri.loop.user_api import Floats, Output, Outputs, Params, Signals, State
from heptarm.fri.loop.wrench import chain_of
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.fri.session.statistics import Histogram
from heptarm.values.condition.collision import Collision
from heptarm.values.pose import Pose

from .answers import NOTHING, Setpoint
from .collision_watch import CollisionWatch, as_numbers
from .fallback import CommandFallback
from .gap_recovery import joints_after_gap, motion_in_gap, vector_in_gap
from .joint_guard import JointGuard
from .pose_guard import PoseGuard, between, moved
from .record import NAN6, NAN7, NOTHING_SENT, Record, Sent
from .sample import Sample
from .session import Session
from .wrench import WrenchEstimator

#: Largest number of skipped cycles that are done after a short gap.
_MAX_SKIPPED = 25
#: A larger jump of the counter is a change of the counter, not lost messages.
_MAX_LOST = 1000
_KINDS = {m.IoType.BOOLEAN: 0, m.IoType.DIGITAL: 1, m.IoType.ANALOG: 2}
_ZEROS7, _ZEROS6 = (0.0,) * 7, (0.0,) * 6
_JOINT_MODES = (m.CommandMode.POSITION, m.CommandMode.TORQUE, m.CommandMode.WRENCH)


def from_wire(values: Sequence[float]) -> tuple[float, ...]:
    """Convert FRI's x y z [mm], quaternion w x y z to x y z [m], x y z w."""
    x, y, z, qw, qx, qy, qz = values
    return (1e-3 * x, 1e-3 * y, 1e-3 * z, qx, qy, qz, qw)


def to_wire(pose: Sequence[float]) -> tuple[float, ...]:
    """Convert x y z [m], quaternion x y z w to FRI's x y z [mm], w x y z."""
    x, y, z, qx, qy, qz, qw = pose
    return (1e3 * x, 1e3 * y, 1e3 * z, qw, qx, qy, qz)


class PoseCommander:
    """Pose commands of a session: interpolator's pose, guard, start and recovery.

    Args:
        limits: limits of the guard.

    Attributes:
        guard: limits the poses.
        ipo: interpolator's pose, shape (7,) [m, x y z w]; NaN before the first one.
        ipo_e1: its redundancy angle [rad]; NaN if it has none.
    """

    def __init__(self, limits: PoseLimits) -> None:
        self.guard = PoseGuard(limits)
        self.forget()

    def forget(self) -> None:
        """Reset: the session commands no pose."""
        self._frame: m.Transformation | None = None
        self._redundancy: m.Redundancy | None = None
        self.ipo: Sequence[float] = NAN7
        self.ipo_e1 = math.nan
        self._mirrored: tuple[Sequence[float], float, int] | None = None
        self._twist: Sequence[float] = _ZEROS6
        self._e1_rate = 0.0  # [rad/s]

    @property
    def has_pose(self) -> bool:
        """Whether the interpolator has sent a pose."""
        return self._frame is not None

    @property
    def ipo_on_wire(self) -> tuple[float, ...]:
        """Interpolator's pose in FRI's numbers; NaN before the first one."""
        return self._frame.values if self._frame is not None else NAN7

    def update(self, message: m.Monitoring) -> None:
        """Read pose and redundancy of the interpolator from a message."""
        if message.ipo is not None and message.ipo.pose is not None:
            self._frame, self._redundancy = message.ipo.pose, message.ipo.redundancy
            self.ipo = from_wire(self._frame.values)
            has_angle = self._redundancy is not None and self._redundancy.strategy is m.RedundancyStrategy.E1
            self.ipo_e1 = self._redundancy.value if self._redundancy is not None and has_angle else math.nan

    def mirror(self, sequence: int, period: int) -> None:
        """Note that this pose is mirrored; update the velocity of the interpolator.

        Args:
            sequence: counter of the message.
            period: send period [ns].
        """
        if self._frame is None:
            return
        last, self._mirrored = self._mirrored, (self.ipo, self.ipo_e1, sequence)
        self._twist, self._e1_rate = _ZEROS6, 0.0
        if last is not None and period and sequence > last[2]:
            gap = (sequence - last[2]) * period * 1e-9
            self._twist = tuple(value / gap for value in between(last[0], self.ipo))
            rate = (self.ipo_e1 - last[1]) / gap
            self._e1_rate = rate if math.isfinite(rate) else 0.0

    def begin(self, period: float, *, again: bool) -> None:
        """Start the guard when commands become effective; do nothing without a pose of the interpolator.

        Args:
            period: command period [s].
            again: whether the session is a new one.
        """
        if self._mirrored is not None and not again:
            pose, e1, _ = self._mirrored
            self.guard.start(pose, self._twist, period=period, e1=e1, e1_speed=self._e1_rate)
        elif self._frame is not None:  # the client connected after commanding had started
            self.guard.start(self.ipo, period=period, e1=self.ipo_e1)
        self._mirrored = None

    def resume(self, message: m.Monitoring, last: Floats | None, *, time: float, period: float) -> None:
        """Restart the guard after a gap, from the estimated pose and velocity.

        Args:
            message: first message after the gap.
            last: words of the state before the gap.
            time: duration of the gap [s].
            period: command period [s].
        """
        guard, monitor = self.guard, message.monitor
        displacement: Sequence[float] = _ZEROS6
        e1_change = 0.0
        if (
            last is not None
            and monitor is not None
            and monitor.pose is not None
            and math.isfinite(last[at.S_POSE])
        ):
            then = State(last)
            displacement = between(then.pose.array.tolist(), from_wire(monitor.pose.values))
            if monitor.redundancy is not None and math.isfinite(then.e1):
                e1_change = monitor.redundancy.value - then.e1
        translation, velocity = vector_in_gap([value / period for value in guard.v], displacement[:3], time)
        rotation, angular_velocity = vector_in_gap(
            [value / period for value in guard.w], displacement[3:], time
        )
        e1_change, e1_rate = motion_in_gap(guard.u / period, e1_change, time)
        before = moved(guard.sent, [-value for value in (*guard.v, *guard.w)])
        guard.start(
            moved(before, (*translation, *rotation)),
            (*velocity, *angular_velocity),
            period=period,
            e1=guard.e1 - guard.u + e1_change,
            e1_speed=e1_rate,
        )

    def command(self, target: Sequence[float] | None, skipped: int) -> m.Transformation:
        """Limit a target pose and convert it to FRI's numbers.

        Args:
            target: shape (7,) [m, x y z w]; None brakes.
            skipped: cycles without a message; they are done evenly towards the target.
        """
        guard, limited = self.guard, False
        reach = self.ipo if guard.limits.reach < math.inf else None
        if skipped:
            start = (*guard.goal[0], *guard.goal[1])
            displacement = target and between(start, target)
            for k in range(1, skipped + 1):
                fraction = k / (skipped + 1)
                step = displacement and moved(start, [fraction * value for value in displacement])
                guard.pose(step, reach)
                limited |= guard.was_limited
        pose = guard.pose(target, reach)
        guard.was_limited |= limited
        assert self._frame is not None
        return replace(self._frame, values=to_wire(pose))

    def command_elbow(self, target: float | None) -> m.Redundancy | None:
        """Limit the target redundancy angle of a pose, after `command`; None if the interpolator has none.

        Args:
            target: angle [rad]; None brakes.
        """
        if self._redundancy is None or math.isnan(self.guard.e1):
            return self._redundancy
        return m.Redundancy(m.RedundancyStrategy.E1, self.guard.elbow(target))


class SignalExchange:
    """Signals and frames of a session, exchanged with the user's process.

    Args:
        layout: the shared memory.

    Attributes:
        signals: signals of the session.
        numbers: their values in the last message.
        outputs: outputs that a law writes.
        outputs_seen: tick of the last outputs and frames read from the user's process.
        pending: outputs that are not shown yet, by full name: value, number of answers that may still repeat it.
    """

    def __init__(self, layout: at.Layout) -> None:
        self._layout = layout
        self.signals = Signals()
        self.numbers: Sequence[float] = ()
        self.outputs = Outputs()
        self.outputs_seen = int(layout.outputs._words[0])
        self._known: dict[str, m.IoValue] = {}
        self._asked: tuple[m.Transformation, ...] = ()
        self.pending: dict[str, tuple[int | float, int]] = {}
        self._taken = 0  # count of the newest output
        self._frames: dict[str, tuple[tuple[float, ...], m.TimeStamp | None]] = {}
        self._published: tuple[object, ...] = ((), ())

    @property
    def is_idle(self) -> bool:
        """Whether the session has no signals, requests no frames, and no output is pending."""
        return not self._known and not self._asked and not self.pending

    def update(self, sample: Sample) -> None:
        """Read signals and requested frames of a message."""
        full = sample.message
        io = full.monitor.io if full.monitor is not None else ()
        self._known = {one.name: one for one in io}
        self._asked = full.requested
        self.numbers = [float(one.value) for one in io]
        self._publish(io)

    def _publish(self, io: tuple[m.IoValue, ...]) -> None:
        """Publish the names of signals and frames for the user's process when they change."""
        names = (
            tuple((one.name, one.type, one.direction) for one in io),
            tuple(one.name for one in self._asked),
        )
        if names == self._published:
            return
        self._published = names
        self.signals = self.outputs.signals = Signals.of(names[0])
        self.pending = {name: one for name, one in self.pending.items() if name in self._known}

    def take(self) -> None:
        """Read new outputs and frames of the user's process."""
        words = self._layout.outputs._words
        if words[0] == self.outputs_seen:
            return
        self.outputs_seen = int(words[0])
        place, newest = 3, self._taken
        for _ in range(int(words[1])):
            count, is_analog, bits = (int(one) for one in words[place : place + 3])
            if count > self._taken:
                kind = "<d" if is_analog else "<Q"
                newest = max(newest, count)
                self._request(at._name(words[place + 3 :]), struct.unpack(kind, struct.pack("<q", bits))[0])
            place += 3 + at.NAME_WORDS
        self._taken = newest
        stamp = next((one.stamp for one in self._asked), None)
        for _ in range(int(words[2])):
            name = at._name(words[place:])
            numbers = tuple(words[place + at.NAME_WORDS :][:7].view(np.float64).tolist())
            if name not in self._frames or self._frames[name][0] != numbers:
                self._frames[name] = (numbers, stamp)
            place += at.NAME_WORDS + 7

    def write(self) -> None:
        """Request the outputs that the law has written and the cabinet does not show yet."""
        for name, value in self.outputs.written.items():
            known, pending = self._known.get(name), self.pending.get(name)
            if (pending is None or pending[0] != value) and (known is None or known.value != value):
                self._request(name, value)
        self.outputs.written.clear()

    def _request(self, name: str, value: int | float) -> None:
        is_analog = isinstance(value, float)
        self.pending[name] = (value, REPEATS_ANALOG if is_analog else REPEATS)

    def add(self, setpoint: Setpoint, version: Version, report: Callable[[str], None]) -> Setpoint:
        """Add pending outputs and frames to a setpoint.

        Args:
            setpoint: setpoint without them.
            version: wire format.
            report: called with a text for an output that the cabinet does not accept.
        """
        if not self.pending and not (self._frames and self._asked):
            return setpoint
        io = []
        for name, (value, left) in list(self.pending.items()):
            known = self._known.get(name)
            is_analog = isinstance(value, float)
            if (  # the session has changed since the output was checked
                known is None
                or known.direction is not m.IoDirection.OUTPUT
                or (known.type is m.IoType.ANALOG) != is_analog
            ):
                del self.pending[name]
                report(f"this FRI session no longer has an output '{name}'")
                continue
            shown = known.value == value and left < REPEATS
            if shown or not left:
                del self.pending[name]
                if not shown and known.type is not m.IoType.ANALOG:
                    report(f"the cabinet does not accept {name} = {value}: it shows {known.value}")
                continue
            self.pending[name] = (value, left - 1)
            io.append(m.IoValue(name, known.type, m.IoDirection.OUTPUT, value))
        return replace(setpoint, io=tuple(io), transformations=self.frames(version))

    def frames(self, version: Version) -> tuple[m.Transformation, ...]:
        """Frames for the next answer: those that are requested and given."""
        names = [one.name for one in self._asked]
        return tuple(
            m.Transformation(name, frame_to_wire(numbers, version), stamp)
            for name, (numbers, stamp) in self._frames.items()
            if name in names
        )

    def forget(self) -> None:
        """Drop all pending outputs."""
        self.pending.clear()


def frame_to_wire(pose: Sequence[float], version: Version) -> tuple[float, ...]:
    """Convert a frame to the numbers of a version.

    Args:
        pose: x y z [m], quaternion x y z w.
        version: wire format.

    Returns:
        12 numbers (3x4 row by row, translation in mm) in 1.x; x y z [mm], w x y z in 2.x.
    """
    if version.traits.quaternions:
        return to_wire(pose)
    x, y, z, qx, qy, qz, qw = pose
    matrix = Pose.of((1e3 * x, 1e3 * y, 1e3 * z), np.array((qx, qy, qz, qw))).matrix
    return tuple(matrix[:3].reshape(-1).tolist())


class Cycle:
    """Processing of one message per call: session, guard, law, and publication.

    Args:
        layout: the shared memory.
        settings: settings of the loop.
    """

    def __init__(self, layout: at.Layout, settings: LoopSettings) -> None:
        self.layout, arm = layout, settings.arm
        values, schema = settings.law_params
        self.session = Session(
            settings.wire,
            latency=Histogram(layout.latency),
            jitter=Histogram(layout.jitter),
            positions=(tuple(arm.q_min.tolist()), tuple(arm.q_max.tolist())),
            fastest=arm.dq_max.tolist(),
        )
        self.guard = JointGuard(settings.limits or Limits.of(arm))
        self.torque_guard = TorqueGuard(
            settings.limits or Limits.of(arm), settings.bodies, report=self.guard.report
        )
        self.pose_commander = PoseCommander(settings.pose_limits or PoseLimits())
        self.fallback = CommandFallback(settings.policy or Policy())
        self.is_ending = False
        self.law = settings.law
        given = values.copy()
        self._params = Params(given, schema)
        self._follower = RateLimiter(given, settings.law_rates)
        self._param_tick = -1
        self.q_before: m.Joints | None = None
        self.exchange = SignalExchange(layout)
        self.record = Record(layout, self.session)
        self.session.publish = lambda event: self.record.report(event.at, event.text, event.kind)
        self.estimator = WrenchEstimator(chain_of(arm))
        guard = settings.collision
        self.watch = None if guard is None else CollisionWatch(**as_numbers(guard))
        self._out = Output(self.exchange.outputs)
        self.commands_seen = layout.commands.count
        self.epoch, self._commanded, self._is_stale = 0, False, False
        self._began = self._before_began = 0
        self._skipped = 0  # cycles without a message since the last setpoint
        self.mirrored: tuple[m.Joints, int] | None = None  # position, counter
        self.slope: Sequence[float] = NAN7
        self.started = 0
        self._answered = False
        self._fresh: Sample | None = None

    # --------------------------------------------------------------------------------------------- one message

    def turn(self, datagram: bytes, received: int) -> bytes | None:
        """Process a datagram and make its answer; call `finish` next."""
        return self._turn(datagram, received)

    def forget_controller(self) -> None:
        """Reset for another controller: its counter, version and interpolator are not those of the last one."""
        self.session.restart()
        self._began += 1
        self.guard.stop()
        self.pose_commander.guard.stop()
        self.pose_commander.forget()
        self.mirrored = self.q_before = None

    def _turn(self, datagram: bytes, received: int) -> bytes | None:
        session, record, exchange = self.session, self.record, self.exchange
        record.flags, record.sent, self._answered, before = 0, NOTHING_SENT, False, session.received
        last = session.sample
        previous = last.sequence if last is not None else 0
        self._fresh = sample = session.receive(datagram, received)
        if sample is None:
            return None
        self._differentiate(sample, sample.sequence - previous)
        self._find_wrench(sample)
        exchange.update(sample)
        record.signals, record.state.signals = exchange.numbers, exchange.signals
        self._detect_collision(sample, received)
        self._follow(sample, received, before, sample.sequence - previous)
        record.ipo, record.ipo_e1 = self.pose_commander.ipo_on_wire, self.pose_commander.ipo_e1
        if not session.is_due or session.version is None:
            return None
        exchange.take()
        if session.is_commanding and session.mode in _JOINT_MODES and sample.q_ipo is not None:
            setpoint = self._joint_setpoint(sample, received)
            self._count(limited=self.guard.was_limited)
        elif (
            session.is_commanding
            and session.mode not in _JOINT_MODES
            and self.pose_commander.guard.is_started
        ):
            setpoint = self._pose_setpoint(sample, received)
            self._count(limited=self.pose_commander.guard.was_limited)
        else:
            setpoint = NOTHING
        if not exchange.is_idle:
            exchange.write()
            setpoint = exchange.add(setpoint, session.version, lambda text: record.report(received, text))
        try:
            answer = session.answer(setpoint)
        except (CommandRejected, ValueError) as refusal:  # unknown names, or too many for one datagram
            exchange.forget()
            record.report(received, str(refusal))
            answer = session.answer(replace(setpoint, io=(), transformations=()))
        self._answered = answer is not None
        return answer

    def _differentiate(self, sample: Sample, leap: int) -> None:
        """Update the velocity by the difference to the previous message; `leap` is the increment of the counter."""
        before, self.q_before = self.q_before, sample.q
        gap = leap * self.session.period * 1e-9
        if sample.q is None:
            self.record.dq[:] = math.nan
        elif before is None or not 0 < leap <= _MAX_LOST or gap <= 0.0:
            self.record.dq[:] = 0.0
        else:
            self.record.dq[:] = [(new - old) / gap for new, old in zip(sample.q, before, strict=True)]

    def _find_wrench(self, sample: Sample) -> None:
        """Take the external wrench of a message, or estimate it from the torques."""
        monitor = sample.message.monitor
        sent = monitor.wrench if monitor is not None else None
        if sent is not None and not math.isnan(sent[0]):
            self.record.wrench = sent
        elif self.estimator is None or sample.q is None or sample.tau_ext is None:
            self.record.wrench = NAN6
        else:
            self.record.wrench = self.estimator.wrench(sample.q, sample.tau_ext)
            self.record.flags |= at.ESTIMATED

    def _detect_collision(self, sample: Sample, now: int) -> None:
        """Brake from now on if the external torque of a joint is outside its band while commands are effective."""
        if self.watch is None or self.is_ending or not self.session.is_commanding:
            return
        found = self.watch.collision(sample.tau_ext, self.record.dq.tolist())
        if found is not None:
            write_collision(self.layout, found)
            text = str(found) if sample.tau_ext is not None else "the controller sends no external torques"
            self.record.report(now, COLLIDED + text)
            self.end()

    def _count(self, *, limited: bool) -> None:
        """Count limited and filled setpoints."""
        self.record.flags |= at.LIMITED if limited else 0
        self.session.counters.limited += limited
        self.session.counters.filled += bool(self.record.flags & at.FILLED)

    def finish(self, now: int) -> None:
        """Publish the cycle, after its answer was sent at `now` [ns]."""
        session, header = self.session, self.layout.header
        if self._answered:
            session.answered(now)
            self.record.flags |= at.ANSWERED
        self.record.report_all()
        if self._fresh is not None:
            self.record.publish(self._fresh, now - session.received if self._answered else 0)
            header[at.EPOCH] = self.epoch
        session.counters.save(header, at.COUNTS)
        write_report(self.layout, self.guard.report)
        write_report(self.layout, self.pose_commander.guard.report)
        header[at.BEAT] = now

    def end(self) -> None:
        """Brake from now on, regardless of commands."""
        self.is_ending = True

    @property
    def may_end(self) -> bool:
        """Whether no axis moves by commands of this client."""
        return all(one.is_still or not one.is_started for one in (self.guard, self.pose_commander.guard))

    # ----------------------------------------------------------------------------------------- setpoints

    def _follow(self, sample: Sample, received: int, before: int, leap: int) -> None:
        """Update guards and fallback for the session's state; `leap` is the increment of the controller's counter."""
        step = leap if 0 < leap <= _MAX_LOST else 1
        session, guard, pose_commander, record = self.session, self.guard, self.pose_commander, self.record
        by_pose = session.mode is m.CommandMode.CARTESIAN_POSE
        if by_pose:
            pose_commander.update(sample.message)
        elif pose_commander.has_pose:
            pose_commander.guard.stop()
            pose_commander.forget()
        began = self._began + session.counters.restarts
        again, self._before_began = began != self._before_began, began
        commands = session.state >= m.SessionState.COMMANDING_WAIT
        if commands and (again or not self._commanded):
            self.epoch += 1
            self._is_stale = False
        self._commanded = commands
        self._skipped = 0
        if again or not session.is_commanding:
            guard.stop()
            pose_commander.guard.stop()
        if session.is_commanding:
            self.fallback.period = session.period * session.multiplier * 1e-9
            period = self.fallback.period or 1e-3
            if not (pose_commander.guard if by_pose else guard).is_started:
                if by_pose:
                    pose_commander.begin(period, again=again)
                elif self.mirrored is not None and not again:
                    guard.start(self.mirrored[0], self.slope, period=period)
                elif sample.q_ipo is not None:  # the client connected after commanding had started
                    guard.start(sample.q_ipo, _ZEROS7, period=period)
                self.torque_guard.start()
                self.fallback.start()
                record.ticks = -1
                # a command given just before the start counts, an older one does not
                self.commands_seen = max(0, self.layout.commands.count - 1)
                self.started = received
                step = 1
            elif (gap := self._gap(leap, received - before, period)) > 0.0:
                if by_pose:
                    pose_commander.resume(
                        sample.message, self.layout.states.newest(), time=gap, period=period
                    )
                else:
                    self._resume(sample, time=gap, period=period)
            else:
                self._skipped = (step - 1) // session.multiplier
                if not by_pose and guard.period != period:
                    guard.start(guard.q, [v / guard.period for v in guard.v], period=period)
            record.ticks += step  # the controller's time advances while messages are lost
            self.mirrored = None
        elif session.state is m.SessionState.COMMANDING_WAIT and by_pose:
            pose_commander.mirror(sample.sequence, session.period)
        elif session.state is m.SessionState.COMMANDING_WAIT and sample.q_ipo is not None:
            last, self.mirrored = self.mirrored, (sample.q_ipo, sample.sequence)
            self.slope = _ZEROS7
            if last is not None and session.period and sample.sequence > last[1]:
                gap = (sample.sequence - last[1]) * session.period * 1e-9
                self.slope = tuple((new - old) / gap for new, old in zip(sample.q_ipo, last[0], strict=True))
        else:
            self.mirrored = None
            pose_commander.forget()

    def _gap(self, leap: int, elapsed: int, period: float) -> float:
        """Duration of a gap in the messages, by the controller's counter [s]; 0.0 if it is short."""
        time = leap * self.session.period if 0 < leap <= _MAX_LOST else elapsed
        return time * 1e-9 if time > max(GAP_PERIODS * period * 1e9, MIN_GAP) else 0.0

    def _resume(self, sample: Sample, *, time: float, period: float) -> None:
        """Restart the joint guard after a gap, from the estimated positions and velocities."""
        guard, words = self.guard, self.layout.states.newest()
        assert words is not None
        before, is_exact = State(words), True
        then: Floats = np.full(7, np.nan)
        now: Sequence[float] = NAN7
        if sample.q_cmd is not None and not np.isnan(before.q_cmd[0]):
            then, now = before.q_cmd, sample.q_cmd
        elif sample.q is not None and not np.isnan(before.q[0]):  # a compliant arm may deviate permanently
            then, now = before.q, sample.q
            is_exact = sample.robot is not None and sample.robot.control_mode is m.ControlMode.POSITION
        commanded = [q - v for q, v in zip(guard.q, guard.v, strict=True)]
        speeds = [v / period for v in guard.v]
        positions, velocities = joints_after_gap(
            commanded, speeds, then.tolist(), now, time=time, period=period, is_exact=is_exact
        )
        guard.start(positions, velocities, period=period)

    def _joint_setpoint(self, sample: Sample, now: int) -> Setpoint:
        guard, ipo = self.guard, sample.q_ipo
        assert ipo is not None
        tau: Sequence[float] | None = None
        wrench: Sequence[float] | None = None
        target: Sequence[float] | None
        if self.is_ending:
            target = None
            tau, wrench = _ZEROS7, _ZEROS6
        elif self.law is not None:
            out = self._run_law(sample, now)
            if out is None:
                target, tau, wrench = None, _ZEROS7, _ZEROS6
            else:
                target, tau, wrench = out.q.tolist(), out.tau.tolist(), out.wrench.tolist()
        else:
            self._read_command()
            target = self.fallback.position_target(now, ipo)
            tau, wrench = self.fallback.efforts(now)
            self.record.flags |= at.FILLED if self.fallback.is_filled else 0
        if target is None:
            self.record.flags |= at.BRAKING
        reach = ipo if guard.limits.reach < math.inf else None
        limited = self._catch_up(target, reach)
        q = tuple(guard.position(target, reach))
        mode = self.session.mode
        limited |= guard.was_limited
        sent_tau = self._torques(sample, tau or _ZEROS7) if mode is m.CommandMode.TORQUE else None
        sent_wrench = self._wrench(sample, wrench or _ZEROS6) if mode is m.CommandMode.WRENCH else None
        guard.was_limited |= limited
        self.record.sent = Sent(q, sent_tau or NAN7, sent_wrench or NAN6)
        return Setpoint(q=q, tau=sent_tau, wrench=sent_wrench)

    def _torques(self, sample: Sample, target: Sequence[float]) -> tuple[float, ...]:
        """Limit target torques; while the arm brakes, they bring it to rest."""
        guard, by_motion = self.guard, self.torque_guard
        tau = by_motion.limit(
            guard.torque(target),
            q=sample.q or NAN7,
            dq=self.record.dq,
            period=guard.period,
            is_braking=bool(self.record.flags & at.BRAKING),
        )
        guard.was_limited |= by_motion.was_limited
        return tuple(tau)

    def _wrench(self, sample: Sample, target: Sequence[float]) -> tuple[float, ...]:
        """Limit a target wrench; while the arm brakes, it brings it to rest."""
        guard, by_motion = self.guard, self.torque_guard
        wrench = by_motion.limit_wrench(
            guard.force(target),
            q=sample.q or NAN7,
            dq=self.record.dq,
            period=guard.period,
            is_braking=bool(self.record.flags & at.BRAKING),
        )
        guard.was_limited |= by_motion.was_limited
        return tuple(wrench)

    def _pose_setpoint(self, sample: Sample, now: int) -> Setpoint:
        """Make the setpoint of a session that commands poses."""
        target: Sequence[float] | None = None
        elbow: float | None = None
        if not self.is_ending and self.law is not None:
            out = self._run_law(sample, now)
            target, elbow = (None, None) if out is None else (out.pose.tolist(), float(out.e1))
        elif not self.is_ending:
            self._read_command()
            target = self.fallback.pose_target(now, self.pose_commander.ipo)
            elbow = self.fallback.elbow_target(now, self.pose_commander.ipo_e1)
            self.record.flags |= at.FILLED if self.fallback.is_filled else 0
        if target is None:
            self.record.flags |= at.BRAKING
        pose = self.pose_commander.command(target, min(self._skipped, _MAX_SKIPPED))
        redundancy = self.pose_commander.command_elbow(elbow)
        self.record.sent = Sent(pose=pose.values, e1=math.nan if redundancy is None else redundancy.value)
        return Setpoint(pose=pose, redundancy=redundancy)

    def _catch_up(self, target: Sequence[float] | None, reach: Sequence[float] | None) -> bool:
        """Do the skipped cycles, evenly towards the target; return whether one of them was limited.

        The cabinet has moved on in the meantime: otherwise the next setpoint would lie behind the arm.
        """
        guard, steps, limited = self.guard, min(self._skipped, _MAX_SKIPPED) + 1, False
        before = tuple(guard.r)
        for k in range(1, steps):
            step = target and [old + (new - old) * k / steps for old, new in zip(before, target, strict=True)]
            guard.position(step, reach)
            limited |= guard.was_limited
        return limited

    def _read_command(self) -> None:
        """Read the newest command of the user's process, if there is a new one."""
        ring = self.layout.commands
        if ring.count == self.commands_seen:
            return
        words = ring.read(ring.count - 1)
        if words is None:  # being written: read it in the next cycle
            return
        self.commands_seen = ring.count
        ints = words.view("int64")
        given, numbers = int(ints[at.C_GIVEN]), words.tolist()
        when = int(ints[at.C_AT])
        if when + GRACE < self.started:
            return
        if ints[at.C_EPOCH] != self.epoch:
            self.layout.header[at.STALE] += 1
            if not self._is_stale:
                self.record.report(
                    self.session.received,
                    "commands of a program that has not seen this session are not executed: the arm is held until the "
                    "program has read a state of it",
                )
            self._is_stale = True
            return
        self.fallback.command(
            when,
            q=numbers[at.C_Q : at.C_Q + 7] if given & at.GIVEN_Q else None,
            tau=numbers[at.C_TAU : at.C_TAU + 7] if given & at.GIVEN_TAU else None,
            wrench=numbers[at.C_WRENCH : at.C_WRENCH + 6] if given & at.GIVEN_WRENCH else None,
            pose=numbers[at.C_POSE : at.C_POSE + 7] if given & at.GIVEN_POSE else None,
            e1=numbers[at.C_E1] if given & at.GIVEN_E1 else None,
        )

    def _run_law(self, sample: Sample, now: int) -> Output | None:
        """Call the law with a prepared output; None if it failed, and brake from then on."""
        out, pose_commander, record = self._out, self.pose_commander, self.record
        out.q[:], out.tau[:], out.wrench[:] = sample.q_ipo or NAN7, 0.0, 0.0
        out.pose[:], out.e1 = pose_commander.ipo, pose_commander.ipo_e1
        record.fill(sample, 0)
        self.call_law(record.state, out, now)
        return None if self.is_ending else out

    def call_law(self, state: State, out: Output, now: int) -> None:
        """Call the law with its newest parameters; brake from now on if it fails."""
        assert callable(self.law)
        ring = self.layout.params
        if ring.count != self._param_tick and (words := ring.read(ring.count - 1)) is not None:
            if self._param_tick < 0:
                self._follower.begin(words[1:])
            self._follower.target[:] = words[1:]
            self._param_tick = ring.count
        self._follower.step(state.dt)
        try:
            self.law(state, out, self._params)
        except BaseException as error:
            self.record.report(now, LAW_FAILED + describe(error))
            self.end()


def write_report(layout: at.Layout, report: object) -> None:
    """Write the report of a guard."""
    ints, floats = layout.block.ints, layout.block.floats
    size, (counts, worst, allowed) = at._places(report)  # type: ignore[arg-type]
    for kind in range(len(report.counts)):  # type: ignore[attr-defined]
        start, end = size * kind, size * (kind + 1)
        ints[counts + start : counts + end] = report.counts[kind]  # type: ignore[attr-defined]
        floats[worst + start : worst + end] = report.worst[kind]  # type: ignore[attr-defined]
        floats[allowed + start : allowed + end] = report.allowed[kind]  # type: ignore[attr-defined]


def write_collision(layout: at.Layout, found: Collision) -> None:
    """Write the first collision."""
    floats = layout.block.floats
    floats[at.COLLISION_TORQUE], floats[at.COLLISION_ALLOWED] = found.torque, found.allowed
    layout.block.ints[at.COLLIDED] = 1 + found.joint
