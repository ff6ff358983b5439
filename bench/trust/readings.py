"""Pushed states beside the plant's own record of the same instants, while the machine is overloaded."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from heptarm.model.kinematics import forward
from heptarm.planning.seam import TICK_NS, SafetyFlags, StateWords
from heptarm.sim.plant.shared_state import Trace
from heptarm.values.pose import Pose
from heptarm.values.robot import ROBOTS
from heptarm.values.state import Joints

#: States of the whole benchmark, and of one cabinet: its record has half a kilobyte for each tick.
STATES = int(os.environ.get("BENCH_STATES", "1000000" if os.environ.get("LONG") else "100000"))
ROUND = 100_000
#: Time constant of the cabinet's filter of the velocity [s].
FILTER = 0.01
#: Poses are converted to millimetres and rotation matrices, and back.
ROUNDING = 1e-9

_BURNER = """
import sys, time
end = time.monotonic() + float(sys.argv[1])
while time.monotonic() < end:
    pause = time.monotonic() + 0.25
    while time.monotonic() < pause:
        pass
    time.sleep(0.05)
"""


@contextlib.contextmanager
def burners(count: int, *, at_most: float) -> Iterator[None]:
    """Keep processors busy, for so many seconds at the most: five sixths of the time each."""
    busy = [subprocess.Popen([sys.executable, "-I", "-S", "-c", _BURNER, str(at_most)]) for _ in range(count)]
    try:
        yield
    finally:
        for one in busy:
            one.kill()
            one.wait()


def hamper(process: int) -> int:
    """Let the thread that samples the states wait for all others; returns how many threads that are."""
    found = 0
    for task in Path(f"/proc/{process}/task").iterdir():
        with contextlib.suppress(OSError):
            if (task / "comm").read_text().startswith("ha-sampler"):
                os.sched_setscheduler(int(task.name), os.SCHED_BATCH, os.sched_param(0))
                os.setpriority(os.PRIO_PROCESS, int(task.name), 19)
                found += 1
    return found


@dataclass
class Comparison:
    """What came of a comparison.

    Attributes:
        states: states compared.
        contradictions: by what contradicts the record, how many states.
        steps: pairs of successive states that are one tick apart, whose velocity has to follow from the filter.
        gaps: times between two states above 5 ms, when the sampler was late.
        oldest: largest time between the stamp of a group and the newest stamp of its state [ms].
    """

    states: int = 0
    contradictions: Counter[str] = field(default_factory=Counter)
    steps: int = 0
    gaps: int = 0
    oldest: float = 0.0

    def add(self, states: list[ha.State], record: np.ndarray) -> None:
        """Compare states in their order with the record of their plant."""
        times = record[:, StateWords.TIME].view(np.int64)
        first = int(times[0])
        assert (np.diff(times) == TICK_NS).all(), "the record has gaps"
        speeds = record[:, StateWords.DQ]
        before: Joints | None = None
        for state in states:
            groups = state.groups
            assert groups.motion is not None
            for name in ("joints", "torques", "pose", "wrench", "motion", "safety"):
                group = getattr(groups, name)
                row, odd = divmod(group.stamp - first, TICK_NS)
                if odd or not 0 <= row < len(record):
                    self.contradictions[f"{name} stamp"] += 1
                    continue
                for what in getattr(self, f"_{name}")(group, record[row]):
                    self.contradictions[what] += 1
                self.oldest = max(self.oldest, 1e-6 * (groups.motion.stamp - group.stamp))
            joints = groups.joints
            assert joints is not None
            if before is not None:
                self.gaps += joints.stamp - before.stamp > 5 * TICK_NS
                self.contradictions["dq"] += not self._is_velocity(before, joints, speeds, first)
            before = joints
        self.states += len(states)
        self.contradictions += Counter()  # without zeros

    def _is_velocity(self, before: Joints, now: Joints, speeds: np.ndarray, origin: int) -> bool:
        """One tick after another state it follows from the filter; otherwise it is between speeds that there were."""
        row, ticks = (now.stamp - origin) // TICK_NS, (now.stamp - before.stamp) // TICK_NS
        if ticks == 1:
            self.steps += 1
            gain = 1.0 - np.exp(-1e-9 * TICK_NS / FILTER)
            filtered = before.dq + gain * ((now.q - before.q) / (1e-9 * TICK_NS) - before.dq)
            return bool(np.abs(now.dq - filtered).max() < 1e-6)
        if ticks <= 0:
            return ticks == 0 and np.array_equal(now.dq, before.dq)
        since = speeds[max(0, row - ticks) : row + 1]
        first = np.zeros(7) if ticks > 1000 else before.dq  # the filter begins again after a second
        low, high = np.minimum(since.min(axis=0), first), np.maximum(since.max(axis=0), first)
        return bool(((now.dq >= low - 1e-6) & (now.dq <= high + 1e-6)).all())

    @staticmethod
    def _joints(group: ha.State, row: np.ndarray) -> Iterator[str]:
        if not np.array_equal(group.q, row[StateWords.Q]):
            yield "q"
        if not np.array_equal(group.q_cmd, row[StateWords.Q_CMD]):
            yield "q_cmd"

    @staticmethod
    def _torques(group, row: np.ndarray) -> Iterator[str]:  # type: ignore[no-untyped-def]
        for name in ("tau", "tau_ext", "tau_cmd"):
            if not np.array_equal(getattr(group, name), row[getattr(StateWords, name.upper())]):
                yield name

    @staticmethod
    def _pose(group, row: np.ndarray) -> Iterator[str]:  # type: ignore[no-untyped-def]
        place, commanded = row[StateWords.POSE], forward(ROBOTS["iiwa14"], row[StateWords.Q_CMD])
        if not _same(group.pose, Pose.of(place[:3], place[3:])):
            yield "pose"
        if not _same(group.pose_cmd, Pose.from_matrix(commanded)):
            yield "pose_cmd"
        words = row.view(np.int64)
        seen = (group.redundancy.status, group.redundancy.turn)
        if group.redundancy.e1 != row[StateWords.E1] or seen != (
            words[StateWords.STATUS],
            words[StateWords.TURN],
        ):
            yield "redundancy"

    @staticmethod
    def _wrench(group, row: np.ndarray) -> Iterator[str]:  # type: ignore[no-untyped-def]
        if np.abs(group.array - row[StateWords.WRENCH]).max() > ROUNDING * (1 + np.abs(group.array).max()):
            yield "wrench"

    @staticmethod
    def _motion(group, row: np.ndarray) -> Iterator[str]:  # type: ignore[no-untyped-def]
        if not np.array_equal([group.progress], row[[StateWords.PROGRESS]], equal_nan=True):
            yield "progress"

    @staticmethod
    def _safety(group, row: np.ndarray) -> Iterator[str]:  # type: ignore[no-untyped-def]
        if group.moving != bool(row.view(np.int64)[StateWords.FLAGS] & SafetyFlags.MOVING):
            yield "moving"


def _same(one: Pose, other: Pose) -> bool:
    return bool(np.abs(one.xyz - other.xyz).max() < ROUNDING and one.angle_to(other) < 1e-7)


def compare(states: int, *, busy: int, seconds: float, hampered: bool = True) -> Comparison:
    """Compare pushed states of a moving arm with the record of its plant.

    Args:
        states: how many.
        busy: processes that keep the machine busy meanwhile.
        seconds: after so long it ends with fewer states.
        hampered: the thread that samples the states waits for all others.
    """
    result, end = Comparison(), time.monotonic() + seconds
    while result.states < states and (left := end - time.monotonic()) > 0.0:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "trace"
            with Cabinet("--trace", str(path)) as cabinet:
                kept = _states(cabinet, min(ROUND, states - result.states), busy, left, hampered)
            result.add(kept, Trace.read(path))
    return result


def _states(cabinet: Cabinet, count: int, busy: int, seconds: float, hampered: bool) -> list[ha.State]:
    with ha.connect(cabinet.target, state_rate=1000, watchdog=10.0, timeout=60.0) as arm:
        there = ha.ptp(ha.deg(60, 40, 10, -70, 20, 60, 30), speed=0.6)
        back = ha.ptp(ha.deg(-60, 20, -10, -100, -20, 50, -30), speed=0.6)
        arm.move(back)
        arm.start([there, back] * 400)
        arm.wait_until(lambda state: float(np.abs(state.dq).max()) > 0.1)
        if hampered:
            hamper(cabinet.process.pid)
        kept: list[ha.State] = []
        # a machine that is too busy for the watchdog of the link ends the round, not the comparison
        with contextlib.suppress(ha.ConnectionLost), burners(busy, at_most=seconds):
            for state in arm.states(duration=seconds, size=100_000):
                kept.append(state)
                if len(kept) >= count:
                    break
            arm.stop("fast")
    return kept


@benchmark("readings")
def readings() -> Iterator[Figure]:
    """States that contradict the plant's record of their stamps, under overload; LONG=1: a million of them."""
    found = compare(STATES, busy=2 * len(os.sched_getaffinity(0)), seconds=4e-3 * STATES)
    detail = {
        "states": found.states,
        "steps": found.steps,
        "late": found.gaps,
        "oldest_group_ms": round(found.oldest, 1),
        "by": dict(found.contradictions),
    }
    yield Figure(
        "readings_contradictions", sum(found.contradictions.values()), "count", limit=0, detail=detail
    )
    yield Figure("readings_compared", found.states, "count", limit=STATES, at_least=True, detail=detail)
