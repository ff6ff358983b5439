"""FRI overlays through the whole stack at 1 kHz: a sine in position, an arm held by torques, a force on a table.

API, TCP, Java application, doubles and plant on one side, the loop's process on the other, UDP between them. A session
that a stalled machine ends early keeps what it has recorded; its figures report how long it lasted.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import heptarm as ha
from bench.fri import laws
from bench.measure.blocks import PROCESSORS
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.stalls import Stalls
from heptarm.arm.fri.session import Fri
from heptarm.errors import HeptarmError
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance

#: Of the sine; torque and wrench take a minute of it at most. Shorter runs are for a first look.
SECONDS = float(os.environ.get("BENCH_SECONDS", "600"))

BENT = ha.deg(0, 30, 0, -90, 0, 60, 0)
#: Of the sine [rad], [Hz]: at most 0.19 rad/s, so that a message's delay alone is 0.2 mrad.
AMPLITUDE, FREQUENCY = 0.15, 0.2
#: Distance by which the torque law moves the joints from their start [rad].
OFFSET = np.array([0.05, 0.05, -0.05, 0.05, -0.05, 0.05, 0.1])
FORCE = 10.0
#: Height of the flange above the table when the force starts [m].
GAP = 0.005
#: Force and torque laws have brought the arm to rest after this time [s].
SETTLED = 4.0
#: A message counts as disturbed if a bare realtime thread missed a period within this time before it [s].
BEFORE, AFTER, STALL = 0.002, 0.05, 1e-3
#: Compliant along z, stiff across it.
COMPLIANT = CartesianImpedance(stiffness=(3000, 3000, 0, 200, 200, 200))

#: Plant and client share a processor: a stop of that processor then meets both, and neither misses the other's message.
CPU = max(PROCESSORS)

#: Of torque and wrench [s].
SHORT = min(SECONDS, 60.0) + SETTLED

Floats = npt.NDArray[np.float64]


class Tape:
    """All messages of a session in which commands were effective, taken from the loop's history now and then.

    Attributes:
        lost: messages that never came to the client, or that it did not answer.
        late: those that it answered more than a period after the kernel had them.
        losses: when messages were found lost [ns of the monotonic clock], once for each.
    """

    def __init__(self, session: Fri) -> None:
        self._session = session
        self._last = -1
        self._times: list[float] = []
        self._received: list[int] = []
        self._positions: list[Floats] = []
        self.losses: list[int] = []
        self.late = 0

    @property
    def lost(self) -> int:
        """Number of lost messages."""
        return len(self.losses)

    def take(self) -> None:
        """Record what is new."""
        for s in self._session.history():
            if s.sequence > self._last and s.is_commanding:
                lost = (s.sequence - self._last - 1 if self._last >= 0 else 0) + (not s.is_answered)
                self.losses += [s.received] * lost
                self.late += s.latency > s.period
                self._last = s.sequence
                self._times.append(s.t)
                self._received.append(s.received)
                self._positions.append(s.q.copy())

    def record(self, seconds: float, look: Callable[[], object] = lambda: None) -> bool:
        """Record for a while of the session's time; returns whether the session is still active.

        Args:
            seconds: how long.
            look: called every 20 ms or so.
        """
        end, due = self._session.state.t + seconds, 0.0
        while (rest := end - self._session.state.t) > 0.0 and self._session.wait(min(rest, 0.02)):
            look()
            if time.monotonic() > due:
                self.take()
                due = time.monotonic() + 0.5
        self.take()
        return self._session.active

    @property
    def t(self) -> Floats:
        """Times, shape (n,) [s]."""
        return np.array(self._times)

    @property
    def received(self) -> npt.NDArray[np.int64]:
        """Times of receipt, shape (n,) [ns of the monotonic clock]."""
        return np.array(self._received, dtype=np.int64)

    @property
    def q(self) -> Floats:
        """Measured positions, shape (n, 7) [rad]."""
        return np.array(self._positions)


@dataclass(frozen=True)
class Session:
    """Outcome of a session, whatever it commanded.

    Attributes:
        lasted: time for which commands were effective [s].
        error: what ended it early; None if nothing did.
        messages: in which commands were effective.
        lost: messages that the client never had or did not answer.
        late: messages that it answered more than a period late.
        lost_calm: messages that were lost while a bare realtime thread was on time.
        stalls: how often such a thread missed a period.
        longest: for how long at most [s].
        report: counts and latencies.
    """

    lasted: float
    error: HeptarmError | None
    messages: int
    lost: int
    late: int
    lost_calm: int
    stalls: int
    longest: float
    report: dict[str, Any]

    @property
    def facts(self) -> dict[str, Any]:
        """For the detail of a figure."""
        return {
            "lasted_s": round(self.lasted, 3),
            "error": str(self.error or ""),
            "messages": self.messages,
            "stalls": self.stalls,
            "longest_stall_ms": round(self.longest * 1e3, 2),
            **self.report,
        }


@dataclass(frozen=True)
class Tracking:
    """Accuracy with which the plant followed a sine.

    Attributes:
        session: how the session went.
        error: largest distance between plant and law at the same time [rad].
        calm: the same without the messages that came when the machine stalled [rad].
        beyond: messages at which it was more than a milliradian.
        moments: when it came to be more than that [s].
        left_out: fraction of the messages that came when the machine stalled.
        delayed: largest distance between plant and the law `delay` messages before [rad].
        delay: that makes it least.
    """

    session: Session
    error: float
    calm: float
    beyond: int
    moments: list[float]
    left_out: float
    delayed: float
    delay: int


@dataclass(frozen=True)
class Balance:
    """Accuracy with which torques alone held the arm.

    Attributes:
        session: how the session went.
        held_for: time after the approach [s].
        error: largest distance of a joint from its goal after the approach [rad].
        reached: how far the torques had moved the joints, the least of them as a fraction of the offset.
    """

    session: Session
    held_for: float
    error: float
    reached: float


@dataclass(frozen=True)
class Press:
    """Accuracy with which a force was held on the table.

    Attributes:
        session: how the session went.
        held_for: time in contact [s].
        least: force [N].
        most: force [N].
        mean: force [N].
    """

    session: Session
    held_for: float
    least: float
    most: float
    mean: float


@dataclass
class Recording:
    """A session that is recorded; complete after the `with` block of `_recorded`."""

    stalls: Stalls
    fri: Fri
    tape: Tape
    error: HeptarmError | None = None

    def calm(self, times: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Whether times are away from stalls of the machine."""
        return ~self.stalls.during(times, before=BEFORE, after=AFTER, longer=STALL)

    @property
    def session(self) -> Session:
        """The outcome."""
        tape, missed = self.tape, self.stalls.lengths[self.stalls.lengths >= STALL]
        t = tape.t
        return Session(
            float(t[-1] - t[0]),
            self.error,
            len(t),
            tape.lost,
            tape.late,
            int(self.calm(np.array(tape.losses, dtype=np.int64)).sum()),
            len(missed),
            float(missed.max(initial=0.0)),
            _report(self.fri),
        )


@contextlib.contextmanager
def _recorded(arm: ha.Arm, kind: str, **settings: Any) -> Iterator[Recording]:
    """Open a session and watch the machine; an error that ended it early is kept beside the recorded data."""
    found: Recording | None = None
    stalls = Stalls()
    try:
        with stalls, arm.fri(kind, history=8192, cpu=CPU, **settings) as fri:  # type: ignore[arg-type]
            found = Recording(stalls, fri, Tape(fri))
            yield found
    except HeptarmError as error:
        if found is None or not len(found.tape.t):
            raise  # nothing was measured
        found.error = error


def track(arm: ha.Arm, seconds: float, *, period_ms: int = 1) -> Tracking:
    """Let all joints follow a sine by a position overlay."""
    arm.move(ha.ptp(BENT))
    params = {"amplitude": AMPLITUDE, "frequency": FREQUENCY}
    with _recorded(arm, "position", period_ms=period_ms, law=laws.sine, params=params) as found:
        found.tape.record(seconds)
    center = found.fri.start.q_ipo
    t, q = found.tape.t, found.tape.q - center

    def error(delay: int) -> Floats:
        target = [laws.swing(now, AMPLITUDE, FREQUENCY) for now in t - delay * period_ms * 1e-3]
        distance: Floats = np.abs(q - np.array(target)[:, None]).max(axis=1)
        return distance

    errors = [error(delay) for delay in range(4)]
    best = min(range(4), key=lambda delay: float(np.sum(errors[delay] ** 2)))
    beyond = errors[0] > 1e-3
    calm = found.calm(found.tape.received)
    return Tracking(
        found.session,
        float(errors[0].max()),
        float(errors[0][calm].max(initial=0.0)),
        int(beyond.sum()),
        t[1:][beyond[1:] & ~beyond[:-1]].round(2).tolist(),
        1.0 - float(calm.mean()),
        float(errors[best].max()),
        best,
    )


def balance(arm: ha.Arm, seconds: float, *, settled: float = SETTLED, period_ms: int = 1) -> Balance:
    """Move compliant joints by torques alone and hold them there."""
    arm.move(ha.ptp(BENT))
    params, mode = {"start": BENT, "goal": BENT + OFFSET}, JointImpedance(stiffness=0.0)
    with _recorded(arm, "torque", period_ms=period_ms, mode=mode, law=laws.balance, params=params) as found:
        found.tape.record(seconds)
    tape = found.tape
    held = tape.q[tape.t > settled]
    if not len(held):
        raise found.error or RuntimeError(f"no message later than {settled:g} s: nothing is held yet")
    return Balance(
        found.session,
        float(tape.t[-1]) - settled,
        float(np.abs(held - BENT - OFFSET).max()),
        float(((held - BENT) / OFFSET).min()),
    )


def press(arm: ha.Arm, seconds: float, *, settled: float = SETTLED, period_ms: int = 1) -> Press:
    """Push on the table that the arm stands on, compliant along z, by a wrench alone."""
    arm.move(ha.ptp(BENT))
    height = float(arm.wait_for_rest().pose.xyz[2])
    arm.move(ha.lin_rel(z=GAP - height, frame="base"), speed=0.3)
    forces: list[tuple[float, float]] = []
    params = {"force": FORCE}
    with _recorded(
        arm, "wrench", period_ms=period_ms, mode=COMPLIANT, law=laws.press, params=params
    ) as found:

        def measure() -> None:
            forces.append((found.fri.state.t, float(arm.state.wrench.force[2])))

        found.tape.record(seconds, measure)
    held = np.array([force for t, force in forces if t > settled])
    if not len(held):
        raise found.error or RuntimeError(f"no message later than {settled:g} s: nothing is held yet")
    if found.error is None:
        arm.move(ha.lin_rel(z=0.1, frame="base"), speed=0.3)
        arm.move(ha.ptp(BENT))
    return Press(
        found.session,
        float(found.tape.t[-1]) - settled,
        float(held.min()),
        float(held.max()),
        float(held.mean()),
    )


def _report(session: Fri) -> dict[str, Any]:
    stats = session.stats
    return {
        "received": stats.received,
        "lost": stats.lost,
        "missed": stats.missed,
        "filled": stats.filled,
        "limited": session.limited,
        "latency_us": [round(value * 1e6, 1) for value in stats.latency],
        "jitter_us": [round(value * 1e6, 1) for value in stats.jitter],
        "quality": stats.quality,
        "refused": session.refused,
    }


@contextlib.contextmanager
def _arm() -> Iterator[ha.Arm]:
    """The arm of a cabinet whose plant stays on the loop's processor."""
    with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=5.0) as arm:
        cabinet.pin(CPU)
        yield arm


def _lasted(name: str, session: Session, seconds: float) -> Figure:
    """Duration of a session; its end decides nothing if the machine stalled."""
    return Figure(
        f"{name}_time",
        session.lasted,
        "s",
        limit=round(0.99 * seconds, 2),
        at_least=True,
        disturbed=session.stalls > 0,
        detail=session.facts,
    )


@benchmark("fri_hold")
def fri_hold() -> Iterator[Figure]:
    """A position overlay on a sine at 1 kHz through the whole stack for 10 minutes: lost messages, error."""
    with _arm() as arm:
        sine = track(arm, SECONDS)
    session = sine.session
    yield _lasted("fri_hold", session, SECONDS)
    yield Figure(
        "fri_hold_lost",
        float(session.lost),
        "count",
        limit=0,
        disturbed=session.lost > 0 and session.lost_calm == 0,
        detail={"lost_while_calm": session.lost_calm, "stalls": session.stalls},
    )
    yield Figure("fri_hold_late", float(session.late), "count")
    yield Figure(
        "fri_hold_error",
        sine.error * 1e3,
        "mrad",
        limit=1.0,
        disturbed=sine.error > 1e-3 >= sine.calm,
        detail={
            "beyond": sine.beyond,
            "moments_s": sine.moments,
            "calm_mrad": sine.calm * 1e3,
            "left_out": sine.left_out,
            "delay_messages": sine.delay,
            "delayed_mrad": sine.delayed * 1e3,
        },
    )


@benchmark("fri_balance")
def fri_balance() -> Iterator[Figure]:
    """A torque law alone moves and holds the arm for 60 s at 1 kHz."""
    with _arm() as arm:
        found = balance(arm, SHORT)
    yield _lasted("fri_balance", found.session, SHORT)
    yield Figure(
        "fri_balance_error",
        found.error * 1e3,
        "mrad",
        limit=1.0,
        disturbed=found.session.stalls > 0,
        detail={"seconds": found.held_for, "fraction_of_offset": found.reached},
    )


@benchmark("fri_press")
def fri_press() -> Iterator[Figure]:
    """A wrench law alone holds 10 N on a table for 60 s at 1 kHz."""
    with _arm() as arm:
        found = press(arm, SHORT)
    yield _lasted("fri_press", found.session, SHORT)
    yield Figure(
        "fri_press_error",
        max(found.most - FORCE, FORCE - found.least),
        "N",
        limit=0.5,
        disturbed=found.session.stalls > 0,
        detail={"seconds": found.held_for, "least": found.least, "most": found.most, "mean": found.mean},
    )
