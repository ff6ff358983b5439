"""Servo streams over a network that loses, delays and reorders packets: by datagram, and over TCP alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import nan

import numpy as np

from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.network import ADDRESSES, BAD, BadNetwork, why_not
from bench.measure.noise import Noise

#: Streams of each kind, and how long each has to live [s]; `LONG=1` measures what the documentation promises.
STREAMS = 6
SECONDS = float(os.environ.get("BENCH_SECONDS", "60" if os.environ.get("LONG") else "10"))
RATE = 200.0
#: Longest time for connecting, stopping and closing [s].
PATIENCE = 240.0
_CLIENT = """
import json, sys, threading, time
import numpy as np
import heptarm as ha
from heptarm.errors import HeptarmError

target, datagrams, seconds, rate = sys.argv[1], sys.argv[2] == "udp", float(sys.argv[3]), float(sys.argv[4])
found = {"outcome": "not connected", "lived": 0.0, "received": 0, "gap": None, "stop": None, "age": None, "pause": 0.0}
arm = None
try:
    arm = ha.connect(target, datagrams=datagrams, timeout=30.0, watchdog=0.5, groups=("joints", "motion"))
    arrivals = []

    def listen():
        try:
            for state in arm.states():
                arrivals.append((time.monotonic(), state.motion.active))
        except HeptarmError:
            pass

    threading.Thread(target=listen, daemon=True).start()
    servo = arm.servo(rate=rate, speed=0.5, acceleration=0.5)
    found["outcome"] = "not begun"
    try:
        with servo:
            found["outcome"] = "ended"
            while servo.tick() and servo.t < seconds:
                found["pause"], found["lived"] = max(found["pause"], servo.t - found["lived"]), servo.t
                servo.set(servo.start.q + 0.1 * np.sin(servo.t) * np.eye(7)[5])
            if servo.active:
                found["outcome"], began = "alive", time.monotonic()
                arm.stop()
    except ha.MotionAborted as error:
        if found["outcome"] != "alive" or error.cause is not ha.Cause.STOPPED:
            found["outcome"] = f"{type(error).__name__}: {error}"
    if found["outcome"] == "alive":
        time.sleep(0.5)
        rests = [when for when, active in arrivals if when > began and not active]
        found["stop"] = rests[0] - began if rests else None
    times = [when for when, _ in arrivals]
    found["gap"] = float(np.diff(times).max()) if len(times) > 2 else None
    found["received"], found["age"] = servo.stats.received, servo.stats.age_p99
    if datagrams:
        report = arm.connection.datagrams
        found["copies"], found["targets"] = report.targets_over_tcp, report.targets
except HeptarmError as error:
    found["outcome"] += f" ({type(error).__name__}: {error})"
finally:
    print(json.dumps(found), flush=True)
    if arm is not None:
        try:
            arm.close()
        except HeptarmError:
            pass
"""


@dataclass(frozen=True)
class Outcome:
    """How one stream fared.

    Attributes:
        outcome: "alive" or why not.
        lived: for how long [s].
        received: targets that the cabinet received.
        gap: longest time without a state [s].
        stop: from the call of `arm.stop()` until a state shows that the motion has ended [s].
        age: 99th percentile of the targets' ages [s].
        pause: longest time between two targets of the client [s]: how long this machine held it up.
        copies: targets that went over TCP as well.
        targets: sent by datagram.
    """

    outcome: str
    lived: float
    received: int
    gap: float | None
    stop: float | None
    age: float | None
    pause: float
    copies: int = 0
    targets: int = 0

    @property
    def is_alive(self) -> bool:
        """Whether it lived as long as it had to."""
        return self.outcome == "alive"


def stream(network: BadNetwork, port: int, kind: str, seconds: float) -> Outcome:
    """Run one servo stream of a client program on the other side of the network.

    Args:
        network: to the cabinet.
        port: of the cabinet.
        kind: "udp" or "tcp".
        seconds: for how long it has to live.
    """
    command = [sys.executable, "-c", _CLIENT, f"{ADDRESSES['cabinet']}:{port}", kind, str(seconds), str(RATE)]
    client = network.on("client", lambda: subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
    with client:
        try:
            lines = client.communicate(timeout=seconds + PATIENCE)[0].splitlines()
        except subprocess.TimeoutExpired:
            return _without_report(f"the client did not end within {seconds + PATIENCE:g} s")
        finally:
            client.kill()
    return Outcome(**json.loads(lines[-1])) if lines else _without_report("the client ended without a report")


def _without_report(why: str) -> Outcome:
    """The outcome of a stream whose client sent no report: the other streams still count."""
    return Outcome(why, lived=0.0, received=0, gap=None, stop=None, age=None, pause=0.0)


@benchmark("bad_network")
def bad_network() -> Iterator[Figure]:
    """Servo streams at 200 Hz with 10 % loss in each direction and 20 ± 5 ms: by datagram, and over TCP alone."""
    reason = why_not()
    if reason:
        yield Figure("bad_network_alive", nan, "count", disturbed=True, detail={"error": reason})
        return
    with (
        Noise() as noise,
        BadNetwork(BAD) as network,
        network.on("cabinet", lambda: Cabinet("--host", ADDRESSES["cabinet"])) as cabinet,
    ):
        found = {
            kind: [stream(network, cabinet.port, kind, SECONDS) for _ in range(STREAMS)]
            for kind in ("udp", "tcp")
        }
        detail: dict[str, object] = {
            "seconds": SECONDS,
            "passed": network.passed,
            "lost": network.lost,
            "stall": round(network.stall, 3),
        }
    noisy, udp, tcp = noise.is_noisy, found["udp"], found["tcp"]
    detail["ended"] = [one.outcome for one in udp if not one.is_alive]
    detail["pauses"] = [round(one.pause, 3) for one in udp]
    detail["copies"] = sum(one.copies for one in udp) / max(1, sum(one.targets for one in udp))
    yield Figure(
        "bad_network_alive",
        sum(one.is_alive for one in udp),
        "count",
        limit=STREAMS,
        at_least=True,
        disturbed=noisy,
        detail=detail,
    )
    lived = {"lived": [round(one.lived, 1) for one in tcp]}
    yield Figure("bad_network_alive_over_tcp", sum(one.is_alive for one in tcp), "count", detail=lived)
    for name, values in (
        ("bad_network_target_age", [one.age for one in udp]),
        ("bad_network_state_gap", [one.gap for one in udp]),
        ("bad_network_stop", [one.stop for one in udp]),
    ):
        known = [value for value in values if value is not None]
        if known:
            yield Figure(
                name, max(known), "s", disturbed=noisy, detail={"median": round(float(np.median(known)), 4)}
            )
