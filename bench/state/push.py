"""A thousand states per second while the arm moves, beside the bare path of a state: shared memory and TCP.

The client connects for each block: while the floor is measured the cabinet rests, or its ticks would delay the floor by
a third of a millisecond wherever the two happen to meet.
"""

from __future__ import annotations

import contextlib
import gc
import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.blocks import BLOCKS, Placement, by_turns, pin
from bench.measure.cabinet import WARM_UP, Cabinet
from bench.measure.compiler import compiled
from bench.measure.figure import Figure, benchmark
from bench.measure.stalls import stalled
from heptarm.model.kinematics import forward
from heptarm.values.pose import Pose
from heptarm.values.robot import ROBOTS

#: Of states over all blocks of a placement, and of their floor; fewer are for a quick check.
SECONDS = float(os.environ.get("BENCH_SECONDS", "60"))
#: One late state in a hundred is what a machine's other work decides as well, so many blocks have to settle it.
MANY = max(15, BLOCKS)
#: From a client's connection to its first state that counts, and from its end until the cabinet rests: the arm brakes,
#: and half a second later nothing is simulated [s].
SETTLING, RESTING = 1.0, 1.5
#: Largest ratio of a state's age to the bare path's, of the median and of the 99th percentile.
LIMIT = 1.6
#: Bytes of a state's frame, header included.
FRAME = 690


class States:
    """Records blocks of states and checks every state.

    Args:
        seconds: of a block.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._robot = ROBOTS["iiwa14"]
        self.count = self.distinct = self.expected = self.disordered = self.dropped = 0
        self.checked = self.torn = 0

    def block(self, arm: ha.Arm) -> list[float]:
        """Ages of the states of one block of an arm that moves [s]."""
        stamps: list[int] = []
        ages: list[float] = []
        kept: list[tuple[np.ndarray, Pose]] = []
        stream = arm.states(duration=self._seconds, size=20_000)
        for state in stream:
            ages.append(state.age)
            stamps.append(state.stamp)
            if len(stamps) % 10 == 0:
                kept.append((state.q, state.pose))
        times = np.array(stamps)
        self.count += len(times)
        self.distinct += len(np.unique(times))
        self.expected += round((times[-1] - times[0]) / 1e6) + 1
        self.disordered += int((np.diff(times) <= 0).sum())
        self.dropped += stream.lost
        self.checked += len(kept)
        self.torn += sum(
            float(np.abs(forward(self._robot, q)[:3, 3] - pose.xyz).max()) > 1e-9 for q, pose in kept
        )
        return ages


@contextlib.contextmanager
def moving(target: str, seconds: float) -> Iterator[ha.Arm]:
    """An arm that moves for a time [s] and longer; its first second has passed."""
    with ha.connect(target, state_rate=1000) as arm:
        arm.speed = 0.3
        there, back = (
            ha.ptp(ha.deg(30, 40, 10, -70, 20, 60, 30)),
            ha.ptp(ha.deg(-30, 20, -10, -100, -20, 50, -30)),
        )
        arm.start([there, back] * int(2 * seconds + 10))  # closing stops it
        gc.collect()  # what other connections have left: in the midst of a block that would take 50 ms
        for _ in arm.states(duration=SETTLING):
            pass
        yield arm
    time.sleep(RESTING)


@benchmark("state_push")
def state_push() -> Iterator[Figure]:
    """States at 1 kHz while the arm moves: delivery, order, consistency, and their age beside the bare path's."""
    seconds = SECONDS / MANY
    with tempfile.TemporaryDirectory() as folder, Cabinet() as cabinet:
        program = compiled(Path(__file__).with_name("path.c"), Path(folder))
        states, current = States(seconds), [frozenset({0})]

        def block() -> list[float]:
            with moving(cabinet.target, SETTLING + seconds) as arm:
                return states.block(arm)

        def place(placement: Placement) -> None:
            pin(cabinet.process.pid, placement.far)
            current[0] = placement.far

        with moving(cabinet.target, WARM_UP) as arm:
            for _ in arm.states(duration=WARM_UP):
                pass
        found = by_turns(
            block,
            lambda: bare(program, round(seconds * 1000), current[0]),
            place,
            blocks=MANY,
            stalled=stalled,
        )
        stats = cabinet.stats()
    noisy = any(one.is_noisy for comparison in found for one in comparison.noise)
    delivered = states.distinct / states.expected
    detail = {"states": states.count, "expected": states.expected, "dropped_by_client": states.dropped}
    yield Figure(
        "push_delivered", delivered, "fraction", limit=0.999, at_least=True, disturbed=noisy, detail=detail
    )
    yield Figure("push_out_of_order", states.disordered, "count", limit=0)
    yield Figure("push_torn", states.torn, "count", limit=0, detail={"checked": states.checked})
    for comparison in found:
        yield comparison.figure("push_age", 50, "us", limit=LIMIT, scale=1e6)
        yield comparison.figure("push_age_p99", 99, "us", limit=LIMIT, scale=1e6)
    lateness = {"lateness_us": stats["lateness_us"], "rebased": stats["rebased"], "refused": stats["refused"]}
    yield Figure("push_tick", stats["tick_us"]["p50"], "us", detail={**stats["tick_us"], **lateness})


def bare(program: Path, frames: int, processors: frozenset[int]) -> list[float]:
    """Ages of stamps that went through shared memory and TCP, read in a loop that does nothing else [s]."""
    ages = []
    with subprocess.Popen(
        [str(program), str(frames), str(FRAME)], stdout=subprocess.PIPE, text=True
    ) as sender:
        assert sender.stdout is not None
        port = int(sender.stdout.readline())
        pin(sender.pid, processors)
        with socket.create_connection(("127.0.0.1", port)) as raw:
            buffer = bytearray(FRAME)
            view = memoryview(buffer)
            while _filled(raw, view):
                ages.append((time.monotonic_ns() - int.from_bytes(buffer[:8], "little")) * 1e-9)
    return ages


def _filled(raw: socket.socket, view: memoryview) -> bool:
    """Read a whole frame; False at the end."""
    filled = 0
    while filled < len(view):
        count = raw.recv_into(view[filled:])
        if count == 0:
            return False
        filled += count
    return True
