"""Duration of a tick of the simulated arm beside MuJoCo's step of the same model, both in the same realtime loop."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator

from bench.measure.blocks import Placement, by_turns, pin
from bench.measure.figure import Figure, benchmark

#: Ticks of a block.
TICKS = 2000
#: Largest ratio to a bare step, of the median and of the 99th percentile.
LIMIT = 4.0


@benchmark("tick")
def tick() -> Iterator[Figure]:
    """A tick of the plant during a motion, beside a bare mj_step: both at 1 kHz in the same realtime loop."""
    with subprocess.Popen(
        [sys.executable, "-m", "bench.simulator.tick_peer"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as peer:

        def place(placement: Placement) -> None:
            pin(peer.pid, placement.near | placement.far)

        def costs(side: str) -> list[float]:
            assert peer.stdin is not None and peer.stdout is not None
            peer.stdin.write(f"{side} {TICKS}\n")
            peer.stdin.flush()
            line = peer.stdout.readline()
            if not line:
                raise RuntimeError("bench.simulator.tick_peer has ended; its error is above")
            return list(json.loads(line))

        try:
            for found in by_turns(lambda: costs("plant"), lambda: costs("bare"), place):
                yield found.figure("tick", 50, "us", limit=LIMIT)
                yield found.figure("tick_p99", 99, "us", limit=LIMIT)
        finally:
            peer.kill()
