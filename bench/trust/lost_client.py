"""The controlling client is killed, or stopped as by a debugger, in every kind of motion."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import nan

import numpy as np

import heptarm as ha
from bench.measure.figure import LATE, Figure, benchmark
from bench.measure.noise import Noise
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import Target
from heptarm.values.robot import ACCELERATION, JERK

#: Losses of each kind; `LONG=1` measures what the documentation promises.
TIMES = int(os.environ.get("BENCH_TIMES", "50" if os.environ.get("LONG") else "3"))
#: Attempts for each loss that has to count: those that something else on the machine disturbed are repeated.
ATTEMPTS = 2
#: Longest time until the arm rests; later than this it has not stopped [s].
_NEVER = 10.0
#: Later than the watchdog and the braking time [s].
SLACK = 0.05
_REST = 5e-3  # [rad/s]
_HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
_START = """
import sys, time, numpy as np, heptarm as ha
arm = ha.connect(sys.argv[1], timeout=20.0)
home, side = ha.deg(0, 30, 0, -90, 0, 60, 0), float(sys.argv[2])
print("ready", flush=True)
"""


@dataclass(frozen=True)
class Loss:
    """A kind of motion in which the client is lost.

    Attributes:
        name: of its figures.
        program: of the client; it moves until it is lost.
        silence: after which the cabinet stops the arm [s].
        guided: a person guides the arm meanwhile.
    """

    name: str
    program: str
    silence: float
    guided: bool = False


#: A servo stream starves before the connection counts as lost; the others end with the connection.
LOSSES = (
    Loss("ptp", "arm.start(ha.ptp(home + side * np.eye(7)[0], speed=0.3))\ntime.sleep(60)", 0.5),
    Loss(
        "servo",
        """
with arm.servo(rate=100, watchdog=0.2, speed=1.0, acceleration=1.0) as servo:
    while servo.tick():
        servo.set(home + side * min(1.0, 0.5 * servo.t) * np.eye(7)[0])
""",
        0.2,
    ),
    Loss("hand_guiding", "arm.start(ha.hand_guide())\ntime.sleep(60)", 0.5, guided=True),
    Loss(
        "fri",
        """
while True:  # a busy machine may lose the quality of a session
    try:
        with arm.fri(period_ms=10) as fri:
            start, began = fri.state.q_ipo.copy(), time.monotonic()
            while fri.next() is not None:
                turned = side * min(1.0, 0.5 * (time.monotonic() - began))
                fri.command(q=start + turned * np.eye(7)[0])
    except ha.HeptarmError:
        arm.recover()
""",
        0.5,
    ),
)


@dataclass(frozen=True)
class LossOutcome:
    """What came of one loss.

    Attributes:
        late: time from the end of the silence and of the braking until the arm rested [s]; NaN: unknown.
        retaken: the next client got control and moved the arm home.
        error: what prevented that; empty: nothing.
        is_noisy: something else on the machine took processor time meanwhile.
    """

    late: float = nan
    retaken: bool = False
    error: str = ""
    is_noisy: bool = False


@benchmark("lost_clients")
def lost_clients() -> Iterator[Figure]:
    """SIGKILL and SIGSTOP of the client in PTP, servo, hand guiding and FRI: rest in time, and the next in control."""
    cabinet = PrivateCabinet.start(Target(model="iiwa14"))
    try:
        target = f"sim://{cabinet.host}:{cabinet.port}"
        with ha.connect(target, control=False, state_rate=500, timeout=20.0) as observer:
            for loss in LOSSES:
                for number in (signal.SIGKILL, signal.SIGSTOP):
                    name = f"lost_{loss.name}_{'killed' if number is signal.SIGKILL else 'stopped'}"
                    yield from figures(name, list(_losses(cabinet, observer, target, loss, number)), TIMES)
    finally:
        cabinet.close()


def figures(name: str, outcomes: Sequence[LossOutcome], times: int) -> Iterator[Figure]:
    """The figures of one kind of loss: the undisturbed ones count, all if there are not enough of them.

    Args:
        name: of the first figure.
        outcomes: in their order.
        times: so many have to count.
    """
    quiet = [one for one in outcomes if not one.is_noisy]
    is_disturbed = len(quiet) < times
    counted = list(outcomes[-times:] if is_disturbed else quiet)
    late = [one.late for one in counted if not np.isnan(one.late)]
    detail = {
        "times": len(counted),
        "median": round(float(np.median(late)), 3) if late else None,
        "disturbed": len(outcomes) - len(quiet),
        "errors": [one.error for one in outcomes if one.error][:10],
    }
    yield Figure(name, max(late, default=nan), "s", limit=SLACK, disturbed=is_disturbed, detail=detail)
    yield Figure(
        f"{name}_next_client",
        sum(one.retaken for one in counted),
        "count",
        limit=times,
        at_least=True,
        disturbed=is_disturbed,
    )


def _losses(
    cabinet: PrivateCabinet, observer: ha.Arm, target: str, loss: Loss, number: signal.Signals
) -> Iterator[LossOutcome]:
    """Losses until enough of them were undisturbed, or until there were too many."""
    quiet = 0
    for index in range(ATTEMPTS * TIMES):
        with Noise() as noise:
            outcome = _lose(cabinet, observer, target, loss, number, index)
        yield replace(outcome, is_noisy=noise.is_noisy)
        quiet += not noise.is_noisy
        if quiet == TIMES:
            return


def _lose(
    cabinet: PrivateCabinet, observer: ha.Arm, target: str, loss: Loss, number: signal.Signals, index: int
) -> LossOutcome:
    """Lose a client once; an error that a busy machine can cause is part of the outcome."""
    late, side = nan, 1.0 if index % 2 else -1.0
    command = [sys.executable, "-c", _START + loss.program, target, str(side)]
    try:
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as client:
            try:
                _until_it_moves(cabinet, observer, client, loss)
                time.sleep(0.1 + 0.3 * (index % TIMES) / TIMES)
                os.kill(client.pid, number)
                rest, braking = _time_to_rest(observer)
                late = rest - loss.silence - braking
            finally:
                client.kill()
        return LossOutcome(late, _retaken(cabinet, target, loss))
    except LATE as error:
        with suppress(*LATE):  # the next loss begins as this one did
            _retaken(cabinet, target, loss)
        return LossOutcome(late, error=f"{type(error).__name__}: {error}"[:200])


def _until_it_moves(
    cabinet: PrivateCabinet, observer: ha.Arm, client: subprocess.Popen[str], loss: Loss
) -> None:
    """Wait until the client's arm moves.

    Raises:
        Timeout: it does not.
    """
    assert client.stdout is not None
    client.stdout.readline()  # empty if it has ended: then nothing moves
    if loss.guided:
        observer.wait_until(lambda state: state.motion is not None and state.motion.active, timeout=30.0)
        cabinet.operate("guide")
        cabinet.operate("push 0 15 15 60")
    observer.wait_until(lambda state: float(np.abs(state.dq).max()) > 0.05, timeout=60.0)


def _time_to_rest(observer: ha.Arm) -> tuple[float, float]:
    """Time until the arm rests, on this computer's clock, and the time in which it could brake from its speed [s]."""
    lost = time.monotonic_ns()
    fastest, last = 0.0, 0.0
    for state in observer.states(duration=_NEVER):
        after = (state.sampled - lost) * 1e-9
        speed = float(np.abs(state.dq).max())
        if speed > _REST:
            last, fastest = after, max(fastest, speed)
        elif after > last + 0.2 and state.motion is not None and not state.motion.active:
            return max(last, 0.0), fastest / ACCELERATION + ACCELERATION / JERK
    return _NEVER, 0.0


def _retaken(cabinet: PrivateCabinet, target: str, loss: Loss) -> bool:
    """Whether the next client gets control and moves the arm home."""
    if loss.guided:
        cabinet.operate("push 0 0 0 0")
        cabinet.operate("let_go")
    with ha.connect(target, timeout=20.0) as arm:
        arm.recover(timeout=5.0)
        return arm.move(ha.ptp(_HOME), speed=0.5).arrived
