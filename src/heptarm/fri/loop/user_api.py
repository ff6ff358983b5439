"""Interface for laws and users: states, commands, parameters, signals, statistics."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.fri.loop import shared_memory as at
from heptarm.fri.loop.law_interface import Fields, Given, Initial, Schema, flat
from heptarm.fri.loop.parameters import Param
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import (
    CommandMode,
    ControlMode,
    DriveState,
    OperationMode,
    Overlay,
    Quality,
    RedundancyStrategy,
    Safety,
    SessionState,
)
from heptarm.fri.session.statistics import Counters, Histogram
from heptarm.values.checks import instance, numbers, scalar, shown
from heptarm.values.frames import check_name
from heptarm.values.io import Signal, SignalValue, SignalValues, find_name
from heptarm.values.notebook import as_html
from heptarm.values.pose import Pose
from heptarm.values.text import lines

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

_KINDS = {m.IoType.BOOLEAN: "boolean", m.IoType.DIGITAL: "unsigned", m.IoType.ANALOG: "analog"}
_RANGES = {"boolean": (0.0, 1.0), "unsigned": (0.0, 2.0**64 - 1), "analog": (-math.inf, math.inf)}


_UNKNOWN: Floats = np.full(7, np.nan)
_UNKNOWN.flags.writeable = False


class Signals:
    """Signals of a session, in the order of its messages.

    Args:
        signals: all of them.

    Attributes:
        names: "Group.Signal" of each.
    """

    __slots__ = ("_signals", "names")

    def __init__(self, signals: Iterable[Signal] = ()) -> None:
        self._signals = tuple(signals)
        self.names = tuple(signal.name for signal in self._signals)

    @classmethod
    def of(cls, offer: Iterable[tuple[str, int, int]]) -> Signals:
        """Make the signals of an offer: name, type and direction of each."""
        return cls(
            _signal(name, _KINDS[m.IoType(kind)], is_output=direction == m.IoDirection.OUTPUT)
            for name, kind, direction in offer
        )

    def __len__(self) -> int:
        return len(self._signals)

    def values(self, numbers: Sequence[float], *, is_output: bool | None = None) -> dict[str, SignalValue]:
        """Map names to values.

        Args:
            numbers: one number per signal.
            is_output: True for outputs only, False for inputs only; None for all.
        """
        return {
            signal.name: signal.value(number)
            for signal, number in zip(self._signals, numbers, strict=False)
            if is_output is None or signal.is_output is is_output
        }

    def output(self, name: str, value: SignalValue) -> tuple[str, int | float]:
        """Check a value for an output; return its full name and the number to send.

        Raises:
            CommandRejected: the session has no output of that name.
            LimitError: the value is outside the range of the output.
        """
        outputs = ", ".join(signal.name for signal in self._signals if signal.is_output) or "none"
        check_name(name, "name")
        try:
            signal = self._signals[find_name(name, self.names)]
        except CommandRejected as error:
            raise CommandRejected(
                f"{error.text} in this FRI session",
                parameter="io",
                value=name,
                allowed=outputs,
                hint="name it where the session is opened, as in arm.fri(..., io=[...]); a cabinet that runs another "
                "application registers it in its FRI configuration",
            ) from None
        if not signal.is_output:
            raise CommandRejected(
                f"{signal.name} is an input of the cabinet, which FRI cannot write",
                parameter="io",
                value=name,
                allowed=outputs,
            )
        number = float(value) if isinstance(value, bool) else scalar(value, "value")
        low, high = signal.low, signal.high
        whole = signal.kind == "analog" or number == round(number) if math.isfinite(number) else False
        if not (low <= number <= high) or not whole:
            allowed = {"boolean": "True or False", "unsigned": "0, 1, 2, ..."}.get(
                signal.kind, "a finite number"
            )
            raise LimitError(
                f"{signal.name} ({signal.kind}) must be {allowed}, got {shown(value)}",
                parameter=signal.name,
                value=value,
                allowed=allowed,
            )
        return signal.name, number if signal.kind == "analog" else int(value)


def _signal(name: str, kind: str, *, is_output: bool) -> Signal:
    low, high = _RANGES[kind]
    return Signal(name, is_output, kind, low, high)


class Outputs:
    """Outputs that a law writes: `out.io["LEDBlue"] = True`.

    Attributes:
        signals: signals of the session.
        written: values written in this cycle, by full name.
    """

    __slots__ = ("signals", "written")

    def __init__(self) -> None:
        self.signals = Signals()
        self.written: dict[str, int | float] = {}

    def __setitem__(self, name: str, value: SignalValue) -> None:
        """Write an output; raises the errors of `Signals.output`."""
        full, number = self.signals.output(name, value)
        self.written[full] = number


def _vector(value: npt.ArrayLike, size: int, name: str) -> Floats:
    """A vector that a law assigns; the guard handles entries that are not finite."""
    result = numbers(value, name, f"{size} numbers")
    if result.shape != (size,):
        raise ShapeError(f"{name} must have shape ({size},), got {result.shape}", parameter=name, value=value)
    return result


class Output:
    """Command of a law; reset before every call.

    Attributes:
        q: position, shape (7,) [rad]; initially the interpolator's.
        tau: superposed torques, shape (7,) [Nm]; initially zero.
        wrench: superposed wrench, shape (6,) [N, Nm]; initially zero.
        pose: x y z [m] and quaternion x y z w, shape (7,); a `Pose` can be assigned. Initially the interpolator's, NaN
            in sessions that command no pose.
        e1: redundancy angle of the pose [rad]; initially the interpolator's.
        io: outputs of the cabinet, `out.io["LEDBlue"] = True`; others keep their values.
    """

    __slots__ = ("_e1", "_pose", "_q", "_tau", "_wrench", "io")

    def __init__(self, outputs: Outputs | None = None) -> None:
        self.io = Outputs() if outputs is None else instance(outputs, Outputs, "outputs")
        self._e1: Floats = np.full(1, np.nan)
        self._q: Floats = np.zeros(7)
        self._tau: Floats = np.zeros(7)
        self._wrench: Floats = np.zeros(6)
        self._pose: Floats = np.full(7, np.nan)

    @property
    def q(self) -> Floats:
        """Target position, shape (7,) [rad]."""
        return self._q

    @q.setter
    def q(self, value: npt.ArrayLike) -> None:
        self._q[:] = _vector(value, 7, "out.q")

    @property
    def tau(self) -> Floats:
        """Target torques, shape (7,) [Nm]."""
        return self._tau

    @tau.setter
    def tau(self, value: npt.ArrayLike) -> None:
        self._tau[:] = _vector(value, 7, "out.tau")

    @property
    def wrench(self) -> Floats:
        """Target wrench, shape (6,) [N, Nm]."""
        return self._wrench

    @wrench.setter
    def wrench(self, value: npt.ArrayLike) -> None:
        self._wrench[:] = _vector(value, 6, "out.wrench")

    @property
    def pose(self) -> Floats:
        """Target pose, shape (7,) [m, x y z w]."""
        return self._pose

    @pose.setter
    def pose(self, value: Pose | npt.ArrayLike) -> None:
        self._pose[:] = value.array if isinstance(value, Pose) else _vector(value, 7, "out.pose")

    @property
    def e1(self) -> float:
        """Target redundancy angle of the pose [rad]."""
        return float(self._e1[0])

    @e1.setter
    def e1(self, value: float) -> None:
        self._e1[0] = value if isinstance(value, float) else scalar(value, "out.e1")

    @classmethod
    def on(cls, words: Floats, outputs: Outputs) -> Output:
        """Make an output on the words of `struct heptarm_command`, shape (28,)."""
        made = cls(outputs)
        made._q, made._tau, made._wrench, made._pose, made._e1 = np.split(words, (7, 14, 20, 27))
        return made


class Params(Fields):
    """Parameters of a law: numbers and arrays by name, updated all at once.

    Args:
        values: numbers and arrays, flattened.
        schema: shape and position of each, by name.
        changed: called after an assignment; None makes them read-only.
        declared: what each may be set to, by name; None: any number, also NaN.
    """

    __slots__ = ("_changed", "_declared")

    _changed: Callable[[], None] | None
    _declared: Mapping[str, Param]

    def __init__(
        self,
        values: Floats,
        schema: Schema,
        *,
        changed: Callable[[], None] | None = None,
        declared: Mapping[str, Param] | None = None,
    ) -> None:
        super().__init__(values, schema, "parameter")
        object.__setattr__(self, "_changed", changed)
        object.__setattr__(self, "_declared", declared or {})

    def __getattr__(self, name: str) -> Any:
        part = self._view(name)
        if isinstance(part, np.ndarray):
            part.flags.writeable = False
        return part

    def __setattr__(self, name: str, value: Given) -> None:
        self.set(**{name: value})

    def set(self, **values: Given) -> None:
        """Change several parameters at once: the law sees all changes or none.

        A pose is its seven numbers: x y z [m] and quaternion x y z w.

        Raises:
            ShapeError: a value has a different shape than initially.
            LimitError: a value is outside the range that the parameter's declaration has, or not finite.
            CommandRejected: a parameter is fixed while the law runs.
            AttributeError: no such parameter, or they are read-only.
        """
        if self._changed is None:
            raise AttributeError("parameters are read-only in a law")
        for start, given in [write for name, value in values.items() for write in self._within(name, value)]:
            self._values[start : start + given.size] = given
        self._changed()

    def _within(self, name: str, value: Given) -> list[tuple[int, Floats]]:
        """First word and numbers of a value, checked against its declaration."""
        declaration = self._declared.get(name)
        if declaration is None:
            return self._checked({name: value})
        if not declaration.live:
            raise CommandRejected(
                f"{name} is fixed while the law runs",
                parameter=name,
                hint="make the law with another value, and open another session",
            )
        return [(self._schema[name][1], declaration.checked(value, name).reshape(-1))]

    @property
    def words(self) -> Floats:
        """All values, as the law sees them, read-only: `set` checks what is assigned."""
        shown = self._values.view()
        shown.flags.writeable = False
        return shown

    @staticmethod
    def flat(values: Mapping[str, Initial]) -> tuple[Floats, dict[str, tuple[tuple[int, ...], int]]]:
        """Flatten a mapping into numbers and their schema.

        Raises:
            ShapeError: a value is neither a number nor an array of numbers.
        """
        return flat(values, "params")


class State:
    """One monitoring message and its answer. Arrays are NaN if the controller does not send them.

    Args:
        words: slot of the ring of states, shape (123,); it is not copied.
        signals: signals of the session.
        dq: velocities, shape (7,) [rad/s], of a state that a law sees.

    Attributes:
        signals: signals of the session.
    """

    __slots__ = ("_dq", "_floats", "_ints", "signals")

    def __init__(self, words: Floats, signals: Signals | None = None, dq: Floats | None = None) -> None:
        self._floats = words
        self._dq = _UNKNOWN if dq is None else dq
        self._ints: Ints = words.view(np.int64)
        self.signals = Signals() if signals is None else signals

    @property
    def words(self) -> Floats:
        """All words, as in `shared_memory`."""
        return self._floats

    @property
    def q(self) -> Floats:
        """Measured position, shape (7,) [rad]."""
        return self._floats[at.ARRAYS["q"]]

    @property
    def dq(self) -> Floats:
        """Velocities by the difference to the previous message, shape (7,) [rad/s]; in laws only, NaN elsewhere."""
        return self._dq

    @property
    def tau(self) -> Floats:
        """Measured torques, shape (7,) [Nm]."""
        return self._floats[at.ARRAYS["tau"]]

    @property
    def tau_cmd(self) -> Floats:
        """Torques commanded by the controller, shape (7,) [Nm]."""
        return self._floats[at.ARRAYS["tau_cmd"]]

    @property
    def tau_ext(self) -> Floats:
        """External torques, shape (7,) [Nm]."""
        return self._floats[at.ARRAYS["tau_ext"]]

    @property
    def q_cmd(self) -> Floats:
        """Position commanded by the controller, shape (7,) [rad]; FRI 1.x only."""
        return self._floats[at.ARRAYS["q_cmd"]]

    @property
    def q_ipo(self) -> Floats:
        """Interpolator's position, to which the overlay is added, shape (7,) [rad]."""
        return self._floats[at.ARRAYS["q_ipo"]]

    @property
    def wrench(self) -> Floats:
        """External wrench on the flange, shape (6,) [N, Nm].

        FRI 2.7 sends it. Else it is estimated from `tau_ext` and `q`, in base axes, see `is_wrench_estimated`; NaN if
        the controller sends no external torques.
        """
        return self._floats[at.S_WRENCH : at.S_WRENCH + 6]

    @property
    def is_wrench_estimated(self) -> bool:
        """Whether `wrench` is an estimate from the torques of the joints."""
        return bool(self._ints[at.S_FLAGS] & at.ESTIMATED)

    @property
    def pose(self) -> Pose:
        """Measured pose; FRI 2.x only.

        Raises:
            CommandRejected: this version of FRI has none.
        """
        numbers = self._floats[at.S_POSE : at.S_POSE + 7]
        if numbers[0] != numbers[0]:
            raise CommandRejected(
                "the controller sends no pose", hint="FRI 1.x has none: use heptarm.model.forward(robot, s.q)"
            )
        return _pose(numbers)

    @property
    def pose_ipo(self) -> Pose:
        """Interpolator's pose, to which the overlay is added.

        Raises:
            CommandRejected: this session commands no pose, or not yet.
        """
        return _commanded(self._floats[at.S_POSE_IPO : at.S_POSE_IPO + 7])

    @property
    def e1(self) -> float:
        """Redundancy angle of the pose [rad]; NaN if there is none."""
        return float(self._floats[at.S_E1])

    @property
    def redundancy_strategy(self) -> RedundancyStrategy | None:
        """Meaning of `e1`: E1 is the angle of A3; None if the controller sends none, as FRI 1.x."""
        value = int(self._ints[at.S_STRATEGY])
        return None if value == at.ABSENT else RedundancyStrategy(value)

    @property
    def e1_ipo(self) -> float:
        """Interpolator's redundancy angle [rad]; NaN if the session commands no pose."""
        return float(self._floats[at.S_E1_IPO])

    @property
    def io(self) -> SignalValues:
        """The session's signals in this message: `s.io["Flange.UserButton"]` or `s.io.user_button`."""
        numbers = self._floats[at.S_IO : at.S_IO + len(self.signals)]
        return SignalValues(self.stamp, self.signals.values(numbers.tolist()))

    @property
    def q_sent(self) -> Floats:
        """Position in the answer, shape (7,) [rad]."""
        return self._floats[at.S_Q_SENT : at.S_Q_SENT + 7]

    @property
    def tau_sent(self) -> Floats:
        """Torques in the answer, shape (7,) [Nm]."""
        return self._floats[at.S_TAU_SENT : at.S_TAU_SENT + 7]

    @property
    def wrench_sent(self) -> Floats:
        """Wrench in the answer, shape (6,) [N, Nm]."""
        return self._floats[at.S_WRENCH_SENT : at.S_WRENCH_SENT + 6]

    @property
    def pose_sent(self) -> Pose:
        """Pose in the answer.

        Raises:
            CommandRejected: this session commands no pose, or not yet.
        """
        return _commanded(self._floats[at.S_POSE_SENT : at.S_POSE_SENT + 7])

    @property
    def e1_sent(self) -> float:
        """Redundancy angle in the answer [rad]; NaN if it has none."""
        return float(self._floats[at.S_E1_SENT])

    @property
    def session(self) -> SessionState:
        """State of the session."""
        return SessionState(int(self._ints[at.S_SESSION]))

    @property
    def is_commanding(self) -> bool:
        """Whether commands are effective."""
        return bool(self._ints[at.S_SESSION] == SessionState.COMMANDING_ACTIVE)

    @property
    def quality(self) -> Quality:
        """Quality of the connection."""
        return Quality(int(self._ints[at.S_QUALITY]))

    @property
    def mode(self) -> CommandMode:
        """Client command mode."""
        return CommandMode(int(self._ints[at.S_MODE]))

    @property
    def overlay(self) -> Overlay | None:
        """Type of the overlay."""
        value = int(self._ints[at.S_OVERLAY])
        return None if value == at.ABSENT else Overlay(value)

    @property
    def safety(self) -> Safety | None:
        """Safety state."""
        value = int(self._ints[at.S_SAFETY])
        return None if value == at.ABSENT else Safety(value)

    @property
    def operation_mode(self) -> OperationMode | None:
        """Operation mode."""
        value = int(self._ints[at.S_OPERATION])
        return None if value == at.ABSENT else OperationMode(value)

    @property
    def control_mode(self) -> ControlMode | None:
        """Control mode of the motion under the overlay."""
        value = int(self._ints[at.S_CONTROL])
        return None if value == at.ABSENT else ControlMode(value)

    @property
    def drive(self) -> DriveState | None:
        """State of the drives; TRANSITIONING if they differ."""
        value = int(self._ints[at.S_DRIVE])
        return None if value == at.ABSENT else DriveState(value)

    @property
    def tracking(self) -> float:
        """Tracking performance, 0 to 1; NaN outside COMMANDING_ACTIVE."""
        return float(self._floats[at.S_TRACKING])

    @property
    def sequence(self) -> int:
        """Controller's counter."""
        return int(self._ints[at.S_SEQUENCE])

    @property
    def stamp(self) -> int:
        """Controller's clock [ns since 1970]; 0 if it sends no time."""
        return int(self._ints[at.S_STAMP])

    @property
    def received(self) -> int:
        """Time of receipt, this machine's monotonic clock [ns]."""
        return int(self._ints[at.S_RECEIVED])

    @property
    def age(self) -> float:
        """Time since receipt [s]."""
        return (time.monotonic_ns() - self.received) * 1e-9

    @property
    def period(self) -> float:
        """Send period [s]."""
        return float(self._ints[at.S_PERIOD]) * 1e-9

    @property
    def multiplier(self) -> int:
        """Receive multiplier: number of messages that one answer is for; 1 if the controller sends none."""
        return max(1, int(self._ints[at.S_MULTIPLIER]))

    @property
    def dt(self) -> float:
        """Command period [s]: the send period times the number of messages that one answer is for."""
        return float(self._ints[at.S_PERIOD] * self.multiplier) * 1e-9

    @property
    def t(self) -> float:
        """Controller's time since commands became effective [s]; 0 before."""
        return float(self._ints[at.S_TICKS]) * self.period

    @property
    def latency(self) -> float:
        """Time from receipt to answer [s]; 0 without an answer."""
        return float(self._ints[at.S_LATENCY]) * 1e-9

    @property
    def is_answered(self) -> bool:
        """Whether the message was answered."""
        return bool(self._ints[at.S_FLAGS] & at.ANSWERED)

    @property
    def is_filled(self) -> bool:
        """Whether the policy made the answer, because there was no fresh command."""
        return bool(self._ints[at.S_FLAGS] & at.FILLED)

    @property
    def is_limited(self) -> bool:
        """Whether the guard limited the answer."""
        return bool(self._ints[at.S_FLAGS] & at.LIMITED)

    def __repr__(self) -> str:
        return (
            f"State({self.sequence}, {self.session.name}, {self.quality.name}, q={self.q.round(4).tolist()})"
        )


def _pose(numbers: Floats) -> Pose:
    """Make a pose of FRI's numbers: x y z [mm], w x y z."""
    return Pose.of(numbers[:3] * 1e-3, numbers[[4, 5, 6, 3]])


def _commanded(numbers: Floats) -> Pose:
    """Make a pose of a session that commands poses."""
    if numbers[0] != numbers[0]:
        raise CommandRejected(
            "no pose is commanded in this state",
            hint="open a session that commands poses and wait for COMMANDING_ACTIVE",
        )
    return _pose(numbers)


@dataclass(frozen=True, slots=True)
class Stats:
    """Counts, latency and jitter over all sessions of the client.

    Attributes:
        received: messages of the controller.
        answered: answers sent.
        lost: messages that did not arrive.
        missed: answers that the controller did not receive in time.
        duplicated: messages received twice.
        reordered: messages received after later ones.
        malformed: datagrams that were no message.
        restarts: restarts of the controller's counter.
        commanded: answers whose commands were effective.
        filled: of those, made by the policy without a fresh command.
        limited: of those, limited by the guard.
        overruns: calls of the law that took longer than its time budget.
        stale: commands that were not executed, because their sender had not seen the session.
        quality: number of messages by their quality.
        latency: time from receipt to answer [s]: median, 99 %, 99.9 %, longest.
        jitter: deviation from the send period [s]: median, 99 %, 99.9 %, longest.
    """

    received: int
    answered: int
    lost: int
    missed: int
    duplicated: int
    reordered: int
    malformed: int
    restarts: int
    commanded: int
    filled: int
    limited: int
    overruns: int
    stale: int
    quality: dict[str, int]
    latency: tuple[float, ...]
    jitter: tuple[float, ...]

    def __str__(self) -> str:
        """A few aligned lines with units."""
        times = (" / ".join(f"{t * 1e6:.0f}" for t in row) for row in (self.latency, self.jitter))
        spread = [f"{text} us (median / 99 % / 99.9 % / longest)" for text in times]
        rows = {
            "messages": f"{self.received} received, {self.lost} lost, {self.duplicated} twice, "
            f"{self.reordered} late, {self.malformed} malformed, {self.restarts} restarts",
            "answers": f"{self.answered} sent, {self.missed} missed; {self.commanded} commanded, "
            f"{self.filled} filled by the policy, {self.limited} limited by the guard"
            + (f", {self.overruns} calls of the law over its time budget" if self.overruns else "")
            + (f", {self.stale} commands older than the session, not executed" if self.stale else ""),
            "quality": ", ".join(f"{name} {count}" for name, count in self.quality.items() if count),
            "latency": spread[0],
            "jitter": spread[1],
        }
        return lines("FRI", rows)

    def _repr_html_(self) -> str:
        """The same as a table for a notebook."""
        return as_html(str(self))

    @classmethod
    def of(cls, layout: at.Layout) -> Stats:
        """Read the counts of a loop."""
        counts = Counters()
        counts.load(layout.header, at.COUNTS)
        latency, jitter = Histogram(layout.latency), Histogram(layout.jitter)
        fractions = (0.5, 0.99, 0.999)
        return cls(
            received=counts.received,
            answered=counts.answered,
            lost=counts.lost,
            missed=counts.missed,
            duplicated=counts.duplicated,
            reordered=counts.reordered,
            malformed=counts.malformed,
            restarts=counts.restarts,
            commanded=counts.commanded,
            filled=counts.filled,
            limited=counts.limited,
            overruns=layout.header[at.OVERRUNS],
            stale=layout.header[at.STALE],
            quality={name: getattr(counts, name) for name in ("poor", "fair", "good", "excellent")},
            latency=(*latency.percentiles(*fractions), latency.longest),
            jitter=(*jitter.percentiles(*fractions), jitter.longest),
        )
