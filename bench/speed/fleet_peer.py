"""A client of one cabinet: moves its arm and counts its states; `bench.speed.fleet` starts it.

Arguments: target, rate [Hz], seconds. Prints "ready", reads a line, and prints a JSON object in the end.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

import heptarm as ha
from heptarm.errors import HeptarmError


def main(target: str, rate: float, seconds: float) -> None:
    """Move for a time."""
    moves, error = 0, ""
    stamps: list[int] = []
    lost = 0
    with ha.connect(target, state_rate=rate) as arm:
        there, back = (
            ha.ptp(ha.deg(30, 40, 10, -70, 20, 60, 30)),
            ha.ptp(ha.deg(-30, 20, -10, -100, -20, 50, -30)),
        )
        arm.speed = 0.5
        print("ready", flush=True)
        sys.stdin.readline()
        begin, handle = time.monotonic(), arm.start([there, back])
        try:
            stream = arm.states(duration=seconds, size=20_000)
            for state in stream:
                stamps.append(state.stamp)
                if handle.done:
                    handle.wait()
                    moves += 2
                    handle = arm.start([there, back])
            lost = stream.lost
        except HeptarmError as problem:
            error = f"{type(problem).__name__}: {problem}"
        passed = time.monotonic() - begin
    times = np.unique(np.array(stamps))
    span = int(times[-1] - times[0]) if len(times) > 1 else 0
    expected = round(span * 1e-9 * rate) + 1
    print(
        json.dumps(
            {
                "states": len(times),
                "expected": expected,
                "lost": lost,
                "moves": moves,
                "error": error,
                "pace": span * 1e-9 / passed,
            }
        ),
        flush=True,
    )


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), float(sys.argv[3]))
