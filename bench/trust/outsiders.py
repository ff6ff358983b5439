"""What outsiders do to the port: thousands of connections, thousands of forged hellos."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from bench.trust.flood import Flood
from heptarm.wire import messages
from heptarm.wire.codes import Code
from heptarm.wire.frames import FrameReader, pack

KEY = "k7fh-9tqa-x2mn-p4cw-8r3e-vd6y-s5gj"
HELD, RATE, STOPS = 1000, 200.0, 10
FORGED = int(os.environ.get("BENCH_HELLOS", "10000"))


@benchmark("stop_under_flood")
def stop_under_flood() -> Iterator[Figure]:
    """`heptarm stop`, the start of Python included, while 1,000 sockets are held and 200 connects a second come."""
    for name, greets in (("silent", False), ("greeting", True)):
        times, rests = [], 0
        with (
            Noise() as noise,
            Cabinet() as cabinet,
            ha.connect(cabinet.target) as arm,
            Flood(cabinet.port, held=HELD, rate=RATE, greets=greets),
        ):
            for index in range(STOPS):
                motion = arm.start(ha.ptp([1.5 if index % 2 else -1.5, 0.5, 0, -1.2, 0, 0.9, 0]), speed=0.2)
                times.append(_stop(cabinet.port))
                try:
                    motion.wait(timeout=10)
                except ha.MotionAborted as error:
                    rests += error.cause is ha.Cause.STOPPED
        detail = {
            "held": HELD,
            "per_second": RATE,
            "stops": STOPS,
            "median": round(sorted(times)[STOPS // 2], 3),
        }
        yield Figure(
            f"stop_under_flood_{name}", max(times), "s", limit=1.0, disturbed=noise.is_noisy, detail=detail
        )
        yield Figure(f"stopped_under_flood_{name}", rests, "count", limit=STOPS, at_least=True)


def _stop(port: int) -> float:
    """Seconds from the start of `heptarm stop` until it reports that the cabinet stops the arm."""
    began = time.monotonic()
    command = [sys.executable, "-m", "heptarm.cli.main", "stop", "--target", f"127.0.0.1:{port}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        seconds = time.monotonic() - began
        process.kill()
    if line.strip() != "the arm stops":
        raise RuntimeError(f"heptarm stop printed {line!r}")
    return seconds


@benchmark("forged_hellos")
def forged_hellos() -> Iterator[Figure]:
    """Hellos with a forged proof, one connection each; meanwhile a client with the key moves the arm."""
    refused, moved = 0, 0
    with Cabinet("--data", f"heptarm.key={KEY}") as cabinet, ha.connect(cabinet.target, key=KEY) as arm:
        began = time.monotonic()
        motion = arm.start(ha.ptp([0.3, 0.5, 0, -1.2, 0, 0.9, 0]), speed=0.2)
        for _ in range(FORGED):
            refused += _forge(cabinet.port)
        rate = FORGED / (time.monotonic() - began)
        moved = int(motion.wait(timeout=60).cause is ha.Cause.FINISHED)
        moved += int(arm.move(ha.lin_rel(z=-0.01)).cause is ha.Cause.FINISHED)
    yield Figure("forged_hellos_refused", refused, "count", limit=FORGED, at_least=True)
    yield Figure("forged_hellos_motions", moved, "count", limit=2, at_least=True)
    yield Figure("forged_hellos_rate", rate, "Hz")


def _forge(port: int) -> bool:
    """Send a Hello and a proof of another key; returns whether it was refused."""
    hello = messages.Hello(major=messages.MAJOR, minor=0, name="forger", nonce=os.urandom(messages.NONCE))
    reader = FrameReader()
    with socket.create_connection(("127.0.0.1", port), timeout=10) as peer:
        peer.sendall(pack(messages.Hello.TYPE, hello.encode(), seq=0))
        while data := peer.recv(4096):
            reader.feed(data)
            frame = reader.read()
            if frame is None:
                continue
            if frame.type == messages.Challenge.TYPE:
                proof = messages.Proof(mac=os.urandom(messages.NONCE))
                peer.sendall(pack(messages.Proof.TYPE, proof.encode(), seq=1))
            else:
                return (
                    frame.type == messages.Refusal.TYPE
                    and messages.Refusal.decode(frame.body).code == Code.WRONG_KEY
                )
    return False
