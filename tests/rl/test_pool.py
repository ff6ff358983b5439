"""Jobs in other processes: one whose worker is killed, one that fails, and the end of all by Ctrl-C."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import gettempdir
from typing import Any

import pytest

pytest.importorskip("torch", reason="torch is not installed")

from heptarm.errors import CommandRejected, LimitError
from heptarm.rl.evaluate import evaluate
from heptarm.rl.jobs import EPISODES, TrainJob
from heptarm.rl.policy import Policy
from heptarm.rl.pool import ATTEMPTS, Job, run_jobs
from heptarm.rl.task import ReachTask
from heptarm.rl.train.ppo import PpoSettings
from heptarm.rl.train.recipe import Recipe
from heptarm.rl.train.train import CHECKPOINT, Training, train
from tests.cli.running import HEPTARM
from tests.interrupts import ctrl_c_interrupts


@dataclass(frozen=True, slots=True)
class Square(Job[int]):
    """The square of a number; the workers of some are killed, as often as stated, and one is refused."""

    number: int
    folder: Path
    kills: int = 0

    def run(self) -> int:
        killed = len(list(self.folder.glob(f"{self.number}-*")))
        if killed < self.kills:
            (self.folder / f"{self.number}-{killed}").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if self.number == 3:
            raise ValueError("three is not squared")
        return self.number**2


def test_a_lost_job_is_run_again_and_one_that_fails_carries_its_error(tmp_path: Path) -> None:
    jobs = [Square(f"square {n}", n, tmp_path, kills=int(n == 2)) for n in range(2, 5)]
    seen = []
    results = run_jobs(jobs, workers=1, progress=lambda result: seen.append(result.job.name))
    assert [result.value for result in results] == [4, None, 16]
    assert [result.attempts for result in results] == [2, 1, 1]
    assert [result.error for result in results] == ["", "ValueError: three is not squared", ""]
    assert "three is not squared" in results[1].trace and [o.job for o in results] == jobs
    assert sorted(seen) == ["square 2", "square 3", "square 4"]


@dataclass(frozen=True, slots=True)
class Interrupted(TrainJob):
    """A training whose worker is killed as soon as there is a checkpoint; and the number of its updates after that."""

    def run(self) -> Any:
        folder = Path(gettempdir()) / f"heptarm-training-{self.key}"
        was_killed, updates = folder.exists(), []
        update, save = Training.update, Training.save

        def counted(training: Training) -> Any:
            updates.append(training.steps)
            return update(training)

        def killed(training: Training, path: Path) -> None:
            save(training, path)
            if not was_killed:
                os.kill(os.getpid(), signal.SIGKILL)

        # in a worker of its own
        Training.update = counted  # type: ignore[method-assign, assignment]
        Training.save = killed  # type: ignore[method-assign, assignment]
        trained, _ = TrainJob.run(self)
        assert not folder.exists()
        return trained, len(updates)


@pytest.mark.long  # starts and imports two workers
def test_a_training_whose_worker_is_lost_goes_on_from_its_checkpoint() -> None:
    settings = PpoSettings(envs=8, horizon=4)
    recipe = Recipe(ReachTask(feature="kinematic"), steps=(CHECKPOINT + 5) * 32, seed=2, settings=settings)
    (result,) = run_jobs([Interrupted("seed 2", recipe)], workers=1)
    assert result.value is not None, result.trace
    trained, updates = result.value
    assert (result.attempts, updates, len(trained.history)) == (2, 5, CHECKPOINT + 5)
    alone = train(recipe).policy
    assert all((a == b).all() for (a, _), (b, _) in zip(alone.layers, trained.policy.layers, strict=True))


def test_what_cannot_run_is_refused_before_anything_starts(tmp_path: Path) -> None:
    job = Square("square 2", 2, tmp_path)
    with pytest.raises(LimitError, match="workers"):
        run_jobs([job], workers=0)
    with pytest.raises(CommandRejected, match="of this machine"):
        run_jobs([job], workers=1, ray="auto")
    with pytest.raises(CommandRejected, match="'with a lock' cannot be sent"):
        run_jobs([job, Square("with a lock", threading.Lock(), tmp_path)])  # type: ignore[arg-type]
    with pytest.raises(CommandRejected, match=r"jobs\[0\]"):
        run_jobs([lambda: 2])  # type: ignore[arg-type]
    assert run_jobs([]) == ()


PROGRAM = """
import os, time
from dataclasses import dataclass
from heptarm.rl.pool import Job, run_jobs

@dataclass(frozen=True, slots=True)
class Sleep(Job[int]):
    def run(self):
        try:
            print(os.getpid(), flush=True)
            time.sleep(600)
        finally:
            print("left in order", flush=True)

run_jobs([Sleep("one"), Sleep("two"), Sleep("three")], workers=2)
"""


@pytest.mark.long
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_all_jobs_end_with_the_program(how: signal.Signals) -> None:
    """Their blocks are left, also if the program has no time for it."""
    with ctrl_c_interrupts():
        program = subprocess.Popen([sys.executable, "-c", PROGRAM], stderr=subprocess.PIPE, text=True)
    with program:
        assert program.stderr is not None
        workers = [int(program.stderr.readline()) for _ in range(2)]
        program.send_signal(how)
        rest = program.stderr.read()  # the workers have it, too: it ends with the last of them
        assert program.wait(timeout=20) == -how
    assert rest.count("left in order") == 2 and len(set(workers)) == 2


@pytest.mark.long
def test_a_job_whose_workers_are_always_lost_is_given_up(tmp_path: Path) -> None:
    lost, kept = run_jobs(
        [Square("lost", 2, tmp_path, kills=ATTEMPTS), Square("kept", 4, tmp_path)], workers=2
    )
    assert lost.error.startswith(f"its worker was lost {ATTEMPTS} times: it was killed by SIGKILL")
    assert (lost.value, kept.value) == (None, 16)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A Ray cluster of two workers, each a node of its own with one processor."""
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'heptarm[ray]'")
    from ray.cluster_utils import Cluster

    found = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    try:
        for _ in range(2):
            found.add_node(num_cpus=1)
        yield found
    finally:
        found.shutdown()


@pytest.mark.long
@pytest.mark.filterwarnings("default")  # of Ray
def test_jobs_on_a_ray_cluster(cluster: Any, tmp_path: Path) -> None:
    jobs = [Square(f"square {n}", n, tmp_path, kills=int(n == 2)) for n in range(2, 6)]
    results = run_jobs(jobs, ray=cluster.address)
    assert [result.value for result in results] == [4, None, 16, 25]
    assert [result.attempts for result in results] == [2, 1, 1, 1]
    assert results[1].error == "ValueError: three is not squared"


@pytest.mark.long
@pytest.mark.filterwarnings("default")
def test_a_node_that_is_lost_during_a_training_costs_nothing(cluster: Any, tmp_path: Path) -> None:
    """Four seeds, and after the first one a machine is gone: one table with all four, as of one machine."""
    arguments = ["rl", "train", "--seeds", "0..3", "--steps", "30000", "--feature", "--json"]
    out = tmp_path / "reach.npz"
    with subprocess.Popen(
        [*HEPTARM, *arguments, "--out", str(out), "--ray", cluster.address], stdout=subprocess.PIPE, text=True
    ) as command:
        assert command.stdout is not None
        rows = [json.loads(command.stdout.readline())]
        trains = next(iter(cluster.worker_nodes))  # as the other one
        cluster.remove_node(trains, allow_graceful=False)
        rows += [json.loads(line) for line in command.stdout]
    assert command.returncode == 0
    assert sorted(row["seed"] for row in rows) == [0, 1, 2, 3] and not any(row["error"] for row in rows)
    assert sorted(row["attempts"] for row in rows) == [1, 1, 1, 2]
    with out.with_suffix(".csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [int(row["seed"]) for row in table] == [0, 1, 2, 3]
    policy = Policy.load(tmp_path / "reach-seed2.npz")
    assert float(table[2]["mean"]) == evaluate(policy, EPISODES).mean
    alone = train(Recipe(ReachTask(feature="kinematic"), steps=30_000, seed=2)).policy
    assert all((a == b).all() for (a, _), (b, _) in zip(alone.layers, policy.layers, strict=True))
