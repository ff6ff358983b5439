"""Several virtual cabinets on one machine: what their clients lose."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from bench.measure.noise import Noise
from bench.speed.idle import processor_time

#: Time during which the arms move [s].
SECONDS = float(os.environ.get("BENCH_SECONDS", "60")) / 3


@benchmark("fleet")
def fleet() -> Iterator[Figure]:
    """Motions of eight cabinets with states at 100 Hz, and of four with states at 1 kHz, each with its own client."""
    for count, rate in ((8, 100), (4, 1000)):
        found, usage, noisy = _together(count, rate)
        name = f"fleet_{count}"
        expected = sum(one["expected"] for one in found)
        delivered = sum(one["states"] for one in found) / expected
        detail = {
            "clients": [{key: one[key] for key in ("states", "lost", "moves", "error")} for one in found],
            "processors": round(usage, 2),
            "plant_time_per_time": round(min(one["pace"] for one in found), 3),
        }
        trips = sum(bool(one["error"]) for one in found)
        yield Figure(f"{name}_trips", trips, "count", limit=0, disturbed=noisy, detail=detail)
        yield Figure(f"{name}_delivered", delivered, "fraction", limit=0.999, at_least=True, disturbed=noisy)


def _together(count: int, rate: int) -> tuple[list[dict[str, Any]], float, bool]:
    """What each client reports, the processors that the cabinets used, and whether others disturbed."""
    with contextlib.ExitStack() as stack:
        cabinets = [stack.enter_context(Cabinet(real_time="fri")) for _ in range(count)]
        clients = [
            stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-m", "bench.speed.fleet_peer", cabinet.target, str(rate), str(SECONDS)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            for cabinet in cabinets
        ]
        for client in clients:
            assert client.stdout is not None
            if client.stdout.readline() != "ready\n":
                raise RuntimeError("bench.speed.fleet_peer has ended; its error is above")
        before = sum(processor_time(cabinet.process.pid) for cabinet in cabinets)
        with Noise() as noise:
            for client in clients:
                assert client.stdin is not None
                client.stdin.write("go\n")
                client.stdin.flush()
            found = [json.loads(client.stdout.readline()) for client in clients if client.stdout is not None]
        usage = (sum(processor_time(cabinet.process.pid) for cabinet in cabinets) - before) / SECONDS
    return found, usage, noise.is_noisy
