"""C8: FRI overlays through the whole stack at 1 kHz: a sine in position, an arm on torques, a force on a table.

API, TCP, Java application, doubles and plant on one side, the loop's process on the other, UDP between them.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import heptarm as ha
from bench import fri_laws as laws
from bench.process import Cabinet
from bench.registry import Figure, benchmark
from bench.stalls import Stalls
from heptarm.arm.fri import Fri
from heptarm.modes import CartesianImpedance, JointImpedance

#: A shorter run for a first look; the promise is for 10 minutes of position, one of torque and one of wrench.
SECONDS = float(os.environ.get("BENCH_SECONDS", "600"))

BENT = ha.deg(0, 30, 0, -90, 0, 60, 0)
#: Of the sine [rad], [Hz]: at most 0.19 rad/s, so that a message's delay alone is 0.2 mrad.
AMPLITUDE, FREQUENCY = 0.15, 0.2
#: How far the torque law leads the joints from where they began [rad].
WAY = np.array([0.05, 0.05, -0.05, 0.05, -0.05, 0.05, 0.1])
FORCE = 10.0
#: Height from which the flange is let down on the table [m].
GAP = 0.005
#: Force and torque laws have led the arm to where it stays after this time [s].
SETTLED = 4.0
#: A message is not held against anybody if a bare real-time thread missed a period as lately as this [s].
BEFORE, AFTER, STALL = 0.002, 0.05, 1e-3
#: Free along z, stiff across it.
YIELDING = CartesianImpedance(stiffness=(3000, 3000, 0, 200, 200, 200))

#: Plant and client share a processor: where the host gives each of them only a share of the time, it takes it from both
#: at once, and an answer is not missed because one of them went on alone.
CPU = max(os.sched_getaffinity(0))

Floats = npt.NDArray[np.float64]


class Tape:
    """All messages of a session in which commands were effective, taken from the loop's history now and then.

    Attributes:
        lost: messages that never came to the client, or that it did not answer.
        late: those that it answered more than a period after the kernel had them.
    """

    def __init__(self, session: Fri) -> None:
        self._session = session
        self._last = -1
        self._times: list[float] = []
        self._received: list[int] = []
        self._positions: list[Floats] = []
        self.lost = self.late = 0

    def take(self) -> None:
        """What is new."""
        for s in self._session.history():
            if s.sequence > self._last and s.is_commanding:
                self.lost += s.sequence - self._last - 1 if self._last >= 0 else 0
                self.lost += not s.is_answered
                self.late += s.latency > s.period
                self._last = s.sequence
                self._times.append(s.t)
                self._received.append(s.received)
                self._positions.append(s.q.copy())

    def record(self, seconds: float, look: Callable[[], object] = lambda: None) -> bool:
        """Take everything for a while of its time, and look at something besides; whether the session still stands."""
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
        """When they came, shape (n,) [ns of the monotonic clock]."""
        return np.array(self._received)

    @property
    def q(self) -> Floats:
        """Measured positions, shape (n, 7) [rad]."""
        return np.array(self._positions)


@dataclass(frozen=True)
class Tracking:
    """How the plant followed a sine.

    Attributes:
        messages: in which commands were effective.
        lost: messages that the client never had or did not answer.
        late: messages that it answered more than a period late.
        error: largest distance between plant and law at the same time [rad].
        calm: the same but for what came when the machine stood still [rad].
        beyond: messages at which it was more than a milliradian.
        moments: when it came to be more than that [s].
        stalls: how often a bare real-time thread missed a period meanwhile.
        longest: for how long at most [s].
        left_out: share of the messages that came then.
        delayed: largest distance between plant and the law `delay` messages before [rad].
        delay: that makes it least.
        report: counts and latencies.
    """

    messages: int
    lost: int
    late: int
    error: float
    calm: float
    beyond: int
    moments: list[float]
    stalls: int
    longest: float
    left_out: float
    delayed: float
    delay: int
    report: dict[str, Any]


@dataclass(frozen=True)
class Balance:
    """How torques alone held the arm.

    Attributes:
        stood: for how long [s].
        error: largest distance of a joint from its goal after the way there [rad].
        way: how far the torques had led the joints, the least of them as a share of what was asked for.
        report: counts and latencies.
    """

    stood: float
    error: float
    way: float
    report: dict[str, Any]


@dataclass(frozen=True)
class Press:
    """How a force stood on the table.

    Attributes:
        stood: for how long there was contact [s].
        least: force [N].
        most: force [N].
        mean: force [N].
        report: counts and latencies.
    """

    stood: float
    least: float
    most: float
    mean: float
    report: dict[str, Any]


def track(arm: ha.Arm, seconds: float, *, period_ms: int = 1) -> Tracking:
    """Let all joints follow a sine by a position overlay."""
    arm.move(ha.ptp(BENT))
    params = {"amplitude": AMPLITUDE, "frequency": FREQUENCY}
    stalls = Stalls()
    with (
        stalls,
        arm.fri(
            "position", period_ms=period_ms, law=laws.sine, params=params, history=8192, cpu=CPU
        ) as session,
    ):
        center, tape = session.start.q_ipo.copy(), Tape(session)
        tape.record(seconds)
    t, q = tape.t, tape.q - center

    def error(delay: int) -> Floats:
        wish = [laws.swing(now, AMPLITUDE, FREQUENCY) for now in t - delay * period_ms * 1e-3]
        found: Floats = np.abs(q - np.array(wish)[:, None]).max(axis=1)
        return found

    errors = [error(delay) for delay in range(4)]
    best = min(range(4), key=lambda delay: float(np.sum(errors[delay] ** 2)))
    beyond = errors[0] > 1e-3
    calm = ~stalls.during(tape.received, before=BEFORE, after=AFTER, longer=STALL)
    missed = stalls.lengths[stalls.lengths >= STALL]
    return Tracking(
        len(t),
        tape.lost,
        tape.late,
        float(errors[0].max()),
        float(errors[0][calm].max()),
        int(beyond.sum()),
        t[1:][beyond[1:] & ~beyond[:-1]].round(2).tolist(),
        len(missed),
        float(missed.max(initial=0.0)),
        1.0 - float(calm.mean()),
        float(errors[best].max()),
        best,
        _report(session),
    )


def balance(arm: ha.Arm, seconds: float, *, settled: float = SETTLED, period_ms: int = 1) -> Balance:
    """Lead floating joints somewhere by torques alone and hold them there."""
    arm.move(ha.ptp(BENT))
    params = {"start": BENT, "goal": BENT + WAY}
    mode = JointImpedance(stiffness=0.0)
    with arm.fri(
        "torque", period_ms=period_ms, mode=mode, law=laws.balance, params=params, history=8192, cpu=CPU
    ) as session:
        tape = Tape(session)
        tape.record(seconds)
    held = tape.q[tape.t > settled]
    return Balance(
        float(tape.t[-1]) - settled,
        float(np.abs(held - BENT - WAY).max()),
        float(((held - BENT) / WAY).min()),
        _report(session),
    )


def press(arm: ha.Arm, seconds: float, *, settled: float = SETTLED, period_ms: int = 1) -> Press:
    """Push on the table that the arm stands on, free along z, by a wrench alone."""
    arm.move(ha.ptp(BENT))
    height = float(arm.wait_for_rest().pose.xyz[2])
    arm.move(ha.lin_rel(z=GAP - height, frame="base"), speed=0.3)
    forces: list[tuple[float, float]] = []
    params = {"force": FORCE}
    with arm.fri(
        "wrench", period_ms=period_ms, mode=YIELDING, law=laws.press, params=params, cpu=CPU
    ) as session:
        tape = Tape(session)

        def feel() -> None:
            forces.append((session.state.t, float(arm.state.wrench.force[2])))

        tape.record(seconds, feel)
    arm.move(ha.lin_rel(z=0.1, frame="base"), speed=0.3)
    arm.move(ha.ptp(BENT))
    held = np.array([force for t, force in forces if t > settled])
    return Press(
        float(tape.t[-1]) - settled,
        float(held.min()),
        float(held.max()),
        float(held.mean()),
        _report(session),
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


@benchmark("fri_hold", "C8")
def fri_hold() -> Iterator[Figure]:
    """1 kHz through the whole stack: 10 min on a sine, 60 s balanced by torques, 60 s with 10 N on a table."""
    short = min(SECONDS, 60.0) + SETTLED
    with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=5.0) as arm:
        cabinet.pin(CPU)
        sine = track(arm, SECONDS)
        floating = balance(arm, short)
        force = press(arm, short)
    detail = {"seconds": SECONDS, "messages": sine.messages, **sine.report}
    yield Figure("fri_hold_lost", "C8", float(sine.lost), "count", limit=0.0, detail=detail)
    yield Figure("fri_hold_late", "C8", float(sine.late), "count")
    yield Figure(
        "fri_hold_error",
        "C8",
        sine.error * 1e3,
        "mrad",
        limit=1.0,
        detail={
            "beyond": sine.beyond,
            "moments_s": sine.moments,
            "calm_mrad": sine.calm * 1e3,
            "stalls": sine.stalls,
            "longest_stall_ms": sine.longest * 1e3,
            "left_out": sine.left_out,
            "delay_messages": sine.delay,
            "delayed_mrad": sine.delayed * 1e3,
        },
    )
    yield Figure(
        "fri_balance_error",
        "C8",
        floating.error * 1e3,
        "mrad",
        limit=1.0,
        detail={"seconds": floating.stood, "share_of_way": floating.way, **floating.report},
    )
    yield Figure(
        "fri_press_error",
        "C8",
        max(force.most - FORCE, FORCE - force.least),
        "N",
        limit=0.5,
        detail={
            "seconds": force.stood,
            "least": force.least,
            "most": force.most,
            "mean": force.mean,
            **force.report,
        },
    )
