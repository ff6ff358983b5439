"""The controlling client is killed, or stopped as by a debugger, in every kind of motion."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import heptarm as ha
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.arm.link.target import Target
from heptarm.values.robot import ACCELERATION, JERK

#: Losses of each kind; `LONG=1` measures what the documentation promises.
TIMES = 50 if os.environ.get("LONG") else 3
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


@benchmark("lost_clients")
def lost_clients() -> Iterator[Figure]:
    """SIGKILL and SIGSTOP of the client in PTP, servo, hand guiding and FRI: rest in time, and the next in control."""
    cabinet = PrivateCabinet.start(Target(model="iiwa14"))
    try:
        target = f"sim://{cabinet.host}:{cabinet.port}"
        with ha.connect(target, control=False, state_rate=500, timeout=20.0) as observer:
            for loss in LOSSES:
                for number in (signal.SIGKILL, signal.SIGSTOP):
                    yield from _figures(cabinet, observer, target, loss, number)
    finally:
        cabinet.close()


def _figures(
    cabinet: PrivateCabinet, observer: ha.Arm, target: str, loss: Loss, number: signal.Signals
) -> Iterator[Figure]:
    late, retaken = [], 0
    name = f"lost_{loss.name}_{'killed' if number is signal.SIGKILL else 'stopped'}"
    with Noise() as noise:
        for index in range(TIMES):
            client = _moving(cabinet, observer, target, loss, 1.0 if index % 2 else -1.0)
            time.sleep(0.1 + 0.3 * index / TIMES)
            os.kill(client.pid, number)
            rest, braking = _time_to_rest(observer)
            late.append(rest - loss.silence - braking)
            client.kill()
            client.wait()
            if loss.guided:
                cabinet.operate("push 0 0 0 0")
                cabinet.operate("let_go")
            retaken += _retaken(target)
    detail = {"times": TIMES, "median": round(float(np.median(late)), 3)}
    yield Figure(name, max(late), "s", limit=SLACK, disturbed=noise.is_noisy, detail=detail)
    yield Figure(
        f"{name}_next_client", retaken, "count", limit=TIMES, at_least=True, disturbed=noise.is_noisy
    )


def _moving(
    cabinet: PrivateCabinet, observer: ha.Arm, target: str, loss: Loss, side: float
) -> subprocess.Popen[str]:
    """A client whose arm moves."""
    client = subprocess.Popen(
        [sys.executable, "-c", _START + loss.program, target, str(side)], stdout=subprocess.PIPE, text=True
    )
    assert client.stdout is not None
    client.stdout.readline()
    if loss.guided:
        observer.wait_until(lambda state: state.motion.active, timeout=30.0)
        cabinet.operate("guide")
        cabinet.operate("push 0 15 15 60")
    observer.wait_until(lambda state: float(np.abs(state.dq).max()) > 0.05, timeout=60.0)
    return client


def _time_to_rest(observer: ha.Arm) -> tuple[float, float]:
    """Time until the arm rests, on this computer's clock, and the time in which it could brake from its speed [s]."""
    lost = time.monotonic_ns()
    fastest, last = 0.0, 0.0
    for state in observer.states(duration=10.0):
        after = (state.sampled - lost) * 1e-9
        speed = float(np.abs(state.dq).max())
        if speed > _REST:
            last, fastest = after, max(fastest, speed)
        elif after > last + 0.2 and not state.motion.active:
            return max(last, 0.0), fastest / ACCELERATION + ACCELERATION / JERK
    return 10.0, 0.0


def _retaken(target: str) -> bool:
    """Whether the next client gets control and moves the arm home."""
    with ha.connect(target, timeout=20.0) as arm:
        arm.recover(timeout=5.0)
        return arm.move(ha.ptp(_HOME), speed=0.5).arrived
