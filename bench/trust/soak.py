"""A controller that never rests, observers that come and go, faults at random: nothing may grow or get lost."""

from __future__ import annotations

import gc
import json
import math
import os
import random
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

import heptarm as ha
from bench.fri import laws
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from heptarm.modes import JointImpedance
from heptarm.when import force

HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
FAULTS = (
    "emergency_stop",
    "external_emergency_stop",
    "operator_safety",
    "protective_stop",
    "drive_error 3",
    "joint_limit 2",
    "singularity",
)
COMPLIANT = JointImpedance(stiffness=(1000.0,) * 7)
WEIGHT = ha.Tool("weight", mass=1.0, com=(0.0, 0.0, 0.05))
#: Bound of a slope after the warm-up [MB/min], and the fraction of a run that is its warm-up.
SLOPE = 0.05
WARM_UP = 1 / 3
#: Counts that may not grow, and by how much one may vary: Java loads some classes late, and its compiler threads come
#: and go.
COUNTS = {"types": 20, "cabinet_threads": 1, "client_threads": 0, "cabinet_files": 0, "client_files": 0}
#: Time for threads and descriptors to be given back, and for a person's steps after a fault [s].
PATIENCE = 30.0


@dataclass(frozen=True)
class Sample:
    """What one round has left.

    Attributes:
        t: time since the start [s].
        cabinet_mb: resident memory of the cabinet, [MB].
        client_mb: of this process, which has the controller and the observers [MB].
        heap_mb: used heap of the cabinet's JVM, garbage included [MB].
        objects: objects of Python that the cabinet's garbage collector tracks.
        types: types among them.
        cabinet_threads: threads of the cabinet.
        client_threads: of this process.
        cabinet_files: descriptors of the cabinet.
        client_files: of this process.
        age_ms: median age of the states during the round [ms].
        oldest_ms: age of the oldest [ms].
        load: load average of the machine.
    """

    t: float
    cabinet_mb: float
    client_mb: float
    heap_mb: float
    objects: int
    types: int
    cabinet_threads: int
    client_threads: int
    cabinet_files: int
    client_files: int
    age_ms: float
    oldest_ms: float
    load: float


@dataclass
class Verdict:
    """What came of a run.

    Attributes:
        seconds: how long it took.
        done: what happened, and how often.
        lost: what was lost or did not end as it should.
        late: the same while more processes wanted to run than there are processors: that may be their fault.
        slopes: of the memory after the warm-up [MB/min].
        grown: counts that are larger after the last round than during the warm-up.
        samples: one for each round.
    """

    seconds: float = 0.0
    done: Counter[str] = field(default_factory=Counter)
    lost: list[str] = field(default_factory=list)
    late: list[str] = field(default_factory=list)
    slopes: dict[str, float] = field(default_factory=dict)
    grown: dict[str, tuple[int, int]] = field(default_factory=dict)
    samples: list[Sample] = field(default_factory=list)

    @property
    def good(self) -> bool:
        """Whether nothing was lost and nothing grew."""
        return not self.lost and not self.grown and max(self.slopes.values(), default=0.0) < SLOPE

    def judge(self) -> None:
        """Compute slopes and growth from the samples."""
        warm = [one for one in self.samples if one.t >= WARM_UP * self.samples[-1].t]
        minutes = np.array([one.t / 60.0 for one in warm])
        for name in ("cabinet_mb", "client_mb"):
            self.slopes[name] = round(slope(minutes, np.array([getattr(one, name) for one in warm])), 4)
        early = self.samples[: len(self.samples) - len(warm) + 1]
        for name, margin in COUNTS.items():
            first, last = max(getattr(one, name) for one in early), getattr(warm[-1], name)
            if last > first + margin:
                self.grown[name] = (first, last)


def slope(x: np.ndarray, y: np.ndarray) -> float:
    """The median of the slopes of all pairs of points (Theil 1950, Sen 1968); 0 for fewer than two."""
    i, j = np.triu_indices(len(x), 1)
    return float(np.median((y[j] - y[i]) / (x[j] - x[i]))) if len(i) else 0.0


class Soak:
    """One run.

    Args:
        cabinet: what is soaked.
        seed: of every choice.
        write: receives each sample.
    """

    def __init__(self, cabinet: Cabinet, *, seed: int, write: Callable[[Sample], None]) -> None:
        self._cabinet, self._random, self._write = cabinet, random.Random(seed), write
        self._ages: list[float] = []
        self.verdict = Verdict()

    def run(self, seconds: float) -> Verdict:
        """Run rounds for so long; the last one is completed."""
        began, verdict = time.monotonic(), self.verdict
        with ha.connect(self._cabinet.target, watchdog=10.0, timeout=60.0) as arm:
            while not verdict.samples or time.monotonic() - began < seconds:
                self._round(arm)
                verdict.samples.append(self._settled(time.monotonic() - began))
                self._write(verdict.samples[-1])
                if not arm.connected:
                    verdict.lost.append("the connection")
                    break
        verdict.seconds = round(time.monotonic() - began, 1)
        verdict.judge()
        return verdict

    # ------------------------------------------------------------------------------------------------ a round

    def _round(self, arm: ha.Arm) -> None:
        """Everything once, in random order."""
        acts: list[Callable[[ha.Arm], None]] = [
            self.motions,
            self.compliance,
            self.refusals,
            self.servo,
            self.straight_servo,
            self.tool,
            self.fri,
            self.fault,
            self.stranger,
            self.reconnection,
        ]
        self._random.shuffle(acts)
        observers = [threading.Thread(target=self._observe) for _ in range(self._random.randint(1, 3))]
        for act in acts:
            if observers and self._random.random() < 0.5:
                observers.pop().start()
            self._carry_out(act.__name__, act, arm)

    def _carry_out(self, name: str, act: Callable[[ha.Arm], None], arm: ha.Arm) -> None:
        try:
            act(arm)
            self._look(arm)
            self.verdict.done[name] += 1
        except (ha.HeptarmError, RuntimeError, AssertionError) as error:
            self._fail(f"{name}: {type(error).__name__}: {error}")
            if name != "recovery":
                self._carry_out("recovery", self._recover, arm)

    def _fail(self, text: str) -> None:
        is_busy = os.getloadavg()[0] > len(os.sched_getaffinity(0))
        (self.verdict.late if is_busy else self.verdict.lost).append(text[:300])

    def _look(self, arm: ha.Arm) -> None:
        """Note the age of the newest state."""
        try:
            self._ages.append(1e3 * arm.state.age)
        except ha.StaleState:
            self._fail("state: older than a second")

    def motions(self, arm: ha.Arm) -> None:
        """Single and blended motions, and one with a condition."""
        goal = HOME + np.array([self._random.uniform(-0.15, 0.15) for _ in range(7)])
        arm.move(ha.ptp(goal, speed=1.0))
        down = ha.lin_rel(z=-0.02, frame="base", speed_mps=0.25, blend_m=0.005)
        up = ha.lin_rel(z=0.02, frame="base", speed_mps=0.25)
        arm.move([down, up, down, up])
        result = arm.move(down, until=force > 500.0)
        assert result.cause is ha.Cause.FINISHED, result

    def compliance(self, arm: ha.Arm) -> None:
        """A motion in impedance control."""
        arm.wait_for_rest()
        with arm.using(COMPLIANT):
            arm.move(ha.ptp(HOME, speed=0.5))
        arm.move(ha.ptp(HOME, speed=0.5))

    def refusals(self, arm: ha.Arm) -> None:
        """Requests that are refused, here and in the cabinet."""
        for _ in range(5):
            for motion in (ha.ptp([9.0] * 7), ha.lin_rel(z=5.0, frame="base")):
                try:
                    arm.move(motion)
                except ha.HeptarmError:
                    continue
                raise AssertionError(f"{motion!r} was carried out")

    def servo(self, arm: ha.Arm) -> None:
        """A stream of joint positions."""
        engines: tuple[Literal["smart", "direct"], ...] = ("smart", "direct")
        engine = self._random.choice(engines)
        with arm.servo("joint", rate=100, engine=engine, watchdog=2.0) as stream:
            while stream.tick() and stream.t < 1.5:
                stream.set(stream.start.q + 0.1 * np.sin(2 * np.pi * stream.t / 1.5) * np.eye(7)[6])
                self._look(arm)

    def straight_servo(self, arm: ha.Arm) -> None:
        """Streams of poses, by the joints and on straight lines."""
        kinds: tuple[Literal["pose", "lin"], ...] = ("pose", "lin")
        for kind in kinds:
            with arm.servo(kind, rate=100, watchdog=2.0) as stream:
                start = stream.start.pose
                while stream.tick() and stream.t < 1.0:
                    z = 0.01 * np.sin(np.pi * stream.t)
                    stream.set(ha.Pose.of(start.xyz + [0.0, 0.0, z], start.quat))

    def tool(self, arm: ha.Arm) -> None:
        """A tool is attached and detached."""
        for _ in range(5):
            with arm.tool(WEIGHT):
                pass

    def fri(self, arm: ha.Arm) -> None:
        """An FRI session that commands positions, and one that monitors."""
        with arm.fri(
            "position", period_ms=10, law=laws.sine, params={"amplitude": 0.02, "frequency": 0.5}
        ) as s:
            if not s.wait(1.0):
                raise RuntimeError(f"FRI ended early: {s.report}")
        with arm.fri("monitor", period_ms=10) as s:
            s.wait(0.5)

    def fault(self, arm: ha.Arm) -> None:
        """A fault at a random moment of a motion; the robot recovers."""
        name = self._random.choice(FAULTS)
        handle = arm.start([ha.ptp(HOME + 0.3, speed=0.1), ha.ptp(HOME, speed=0.1)])
        arm.wait_until(
            lambda state: float(np.abs(state.dq).max()) > 0.02
        )  # some faults concern the running motion
        time.sleep(self._random.uniform(0.0, 0.8))
        self._cabinet.operate(name)
        try:
            handle.wait(timeout=PATIENCE)
            raise RuntimeError(f"{name} did not stop the motion")
        except (ha.MotionAborted, ha.NotReady):
            self.verdict.done[name] += 1
        finally:
            self._cabinet.operate("clear")
        self._recover(arm)

    def _recover(self, arm: ha.Arm) -> None:
        left = arm.recover(timeout=PATIENCE)
        if not left.done:
            raise RuntimeError(str(left))
        arm.wait_for_rest(timeout=PATIENCE)
        arm.move(ha.ptp(HOME, speed=0.5))

    def stranger(self, arm: ha.Arm) -> None:
        """Connections that say nothing, or nothing that is understood."""
        for words in (b"", b"GET / HTTP/1.1\r\n\r\n", os.urandom(200)):
            with socket.create_connection(("127.0.0.1", self._cabinet.port), timeout=5.0) as one:
                one.sendall(words)

    def reconnection(self, arm: ha.Arm) -> None:
        """The controller leaves and comes back."""
        arm.reconnect()
        if not arm.in_control:
            arm.take_control()

    def _observe(self) -> None:
        """An observer comes, looks for a while, and leaves."""
        try:
            with ha.connect(self._cabinet.target, control=False, state_rate=200, timeout=60.0) as arm:
                seen = sum(1 for _ in arm.states(duration=1.0))
                if not seen:
                    raise RuntimeError("no state arrived")
            self.verdict.done["observer"] += 1
        except (ha.HeptarmError, RuntimeError) as error:
            self._fail(f"observer: {type(error).__name__}: {error}")

    # ----------------------------------------------------------------------------------------------- measuring

    def _settled(self, now: float) -> Sample:
        """A sample, once threads and descriptors of the round are given back, or after a while."""
        before = self.verdict.samples[-1] if self.verdict.samples else None
        deadline = time.monotonic() + PATIENCE
        ages, self._ages = np.array(self._ages), []
        while True:
            gc.collect()
            sample = self._sample(now, ages)
            names = ("cabinet_threads", "client_threads", "cabinet_files", "client_files")
            is_more = before is not None and any(getattr(sample, n) > getattr(before, n) for n in names)
            if time.monotonic() > deadline or (threading.active_count() < 20 and not is_more):
                return sample
            time.sleep(0.2)

    def _sample(self, now: float, ages: np.ndarray) -> Sample:
        pid, memory = self._cabinet.process.pid, self._cabinet.stats()["memory"]
        return Sample(
            round(now, 2),
            _resident(pid),
            _resident(os.getpid()),
            round(memory["java_heap"] / 2**20, 2),
            memory["objects"],
            memory["types"],
            _count(pid, "task"),
            _count(os.getpid(), "task"),
            _count(pid, "fd"),
            _count(os.getpid(), "fd"),
            round(float(np.median(ages)), 2) if len(ages) else math.nan,
            round(float(ages.max()), 2) if len(ages) else math.nan,
            os.getloadavg()[0],
        )


def _resident(pid: int) -> float:
    """Resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return round(pages * os.sysconf("SC_PAGE_SIZE") / 2**20, 3)


def _count(pid: int, what: str) -> int:
    return len(os.listdir(f"/proc/{pid}/{what}"))


def soak(seconds: float, *, seed: int = 1, folder: Path | None = None) -> Verdict:
    """Soak a virtual cabinet; its samples go to a file in a folder as well, and a plot."""
    lines = None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        lines = (folder / "soak.jsonl").open("w", encoding="utf-8")

    def write(sample: Sample) -> None:
        if lines is not None:
            lines.write(json.dumps(asdict(sample)) + "\n")
            lines.flush()

    # as `heptarm sim` starts it: with "on" Java compiles for some minutes, and its memory grows meanwhile
    with Cabinet(real_time="fri") as cabinet:
        verdict = Soak(cabinet, seed=seed, write=write).run(seconds)
    if folder is not None and lines is not None:
        lines.close()
        plot(verdict.samples, folder / "soak.png")
    return verdict


def plot(samples: list[Sample], path: Path) -> None:
    """Draw memory, counts and ages over time."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    minutes = [one.t / 60.0 for one in samples]
    groups = (
        ("memory [MB]", ("cabinet_mb", "client_mb", "heap_mb")),
        ("count", ("cabinet_threads", "client_threads", "cabinet_files", "client_files")),
        ("age of states [ms]", ("age_ms", "oldest_ms")),
    )
    figure, axes = pyplot.subplots(len(groups), sharex=True, figsize=(9, 9), constrained_layout=True)
    for axis, (label, names) in zip(axes, groups):
        for name in names:
            axis.plot(minutes, [getattr(one, name) for one in samples], label=name)
        axis.set_ylabel(label)
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes[-1].set_yscale("log")
    axes[-1].set_xlabel("time [min]")
    figure.savefig(path)
    pyplot.close(figure)


def summary(verdict: Verdict) -> dict[str, Any]:
    """The verdict without its samples."""
    first, last = verdict.samples[0], verdict.samples[-1]
    ends = {
        name: [getattr(first, name), getattr(last, name)]
        for name in (
            "cabinet_mb",
            "client_mb",
            "heap_mb",
            "objects",
            "types",
            "cabinet_threads",
            "cabinet_files",
        )
    }
    return {
        "good": verdict.good,
        "seconds": verdict.seconds,
        "rounds": len(verdict.samples),
        "slopes_mb_per_min": verdict.slopes,
        "grown": verdict.grown,
        "lost": verdict.lost[:20],
        "late": [len(verdict.late), *verdict.late[:20]],
        "done": dict(verdict.done),
        "first_last": ends,
    }


@benchmark("soak")
def run() -> Iterator[Figure]:
    """Growth of the memory, and what is lost, in three minutes of everything at once; LONG=1: in an hour."""
    verdict = soak(3600.0 if os.environ.get("LONG") else 180.0)
    detail = summary(verdict)
    for name, value in verdict.slopes.items():
        yield Figure(f"soak_{name}", value, "MB/min", limit=SLOPE, detail=detail)
    yield Figure("soak_lost", len(verdict.lost), "count", limit=0, detail=detail)
    yield Figure("soak_grown", len(verdict.grown), "count", limit=0, detail=detail)
