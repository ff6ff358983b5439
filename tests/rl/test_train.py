"""Training: arithmetic, interruptions, several workers, and learning progress."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed")

import torch

from heptarm.errors import CommandRejected, HeptarmError, LimitError
from heptarm.rl.evaluate import evaluate
from heptarm.rl.policy import Policy
from heptarm.rl.sim.randomisation import LEVELS, MILD
from heptarm.rl.task import ReachTask
from heptarm.rl.train import ppo
from heptarm.rl.train.recipe import Recipe
from heptarm.rl.train.train import Row, Trained, beside, train

SMALL = ppo.PpoSettings(envs=16, horizon=8, minibatches=2, epochs=2, hidden=(16,))
UPDATE = 16 * 8


def recipe(updates: int = 6, **changes: object) -> Recipe:
    given: dict[str, Any] = {"steps": updates * UPDATE, "settings": SMALL, "seed": 3, **changes}
    return Recipe(ReachTask(steps=20, feature="kinematic"), **given)


def curve(trained: Trained) -> list[tuple[float | None, ...]]:
    """The learning curve without wall times; NaN as None."""
    rows = [{k: v for k, v in asdict(row).items() if k != "seconds"} for row in trained.history]
    return [tuple(None if v != v else v for v in row.values()) for row in rows]


def same(one: Policy[Any], other: Policy[Any]) -> bool:
    pairs = zip(one.layers, other.layers, strict=True)
    return all((a == b).all() for layer in pairs for a, b in zip(*layer, strict=True)) and bool(
        (one.mean == other.mean).all() and (one.std == other.std).all()
    )


# ---------------------------------------------------------------------------------- arithmetic


def test_advantages_are_those_of_the_definition() -> None:
    settings = ppo.PpoSettings(gamma=0.9, gae_lambda=0.8)
    random = torch.Generator().manual_seed(0)
    reward, value, after = (torch.rand((5, 1), generator=random) for _ in range(3))
    done = torch.tensor([0.0, 0.0, 1.0, 0.0, 0.0])[:, None]
    got = ppo.advantages(reward, value, after, done, settings).squeeze(-1)
    surprise = (reward + 0.9 * after - value).squeeze(-1)
    # the episode of the first three ends with the third
    for t, end in ((0, 3), (1, 3), (2, 3), (3, 5), (4, 5)):
        wanted = sum((0.9 * 0.8) ** (k - t) * surprise[k] for k in range(t, end))
        assert float(got[t]) == pytest.approx(float(wanted), abs=1e-6)


def test_the_scaler_knows_mean_and_deviation_of_all_it_saw() -> None:
    data = np.random.default_rng(0).normal(3.0, 5.0, (1000, 4))
    scaler = ppo.Scaler(4)
    for part in np.split(data, [10, 500]):
        moments = (len(part), part.mean(0), len(part) * part.var(0))
        scaler.add(*(torch.tensor(m, dtype=torch.float64) for m in moments))
    assert scaler.mean.numpy() == pytest.approx(data.mean(0), rel=1e-5)
    assert scaler.std.numpy() == pytest.approx(data.std(0), rel=1e-5)


def test_the_divergence_is_that_of_torch() -> None:
    from torch.distributions import Normal, kl_divergence

    mean, now = torch.randn(6, 3), torch.randn(6, 3)
    spread, spread_now = torch.tensor([0.1, -0.5, 0.0]), torch.tensor([0.0, -0.2, 0.3])
    wanted = kl_divergence(Normal(mean, spread.exp()), Normal(now, spread_now.exp())).sum(-1).mean()
    assert float(ppo.divergence(mean, spread, now, spread_now)) == pytest.approx(float(wanted), rel=1e-5)


def test_the_activation_and_its_slope_are_those_of_torch() -> None:
    x = torch.linspace(-20.0, 20.0, 401, requires_grad=True)
    rows = torch.stack([function(x) for function in (ppo.Elu(), torch.nn.functional.elu)])
    slopes = [torch.autograd.grad((row * row).sum(), x, retain_graph=True)[0] for row in rows]
    assert rows[0].detach().numpy() == pytest.approx(rows[1].detach().numpy(), abs=2e-7)
    assert slopes[0].numpy() == pytest.approx(slopes[1].numpy(), abs=1e-5)


# ---------------------------------------------------------------------------------- a training


@pytest.mark.long
def test_the_same_seed_gives_the_same_policy_with_any_threads() -> None:
    one, other, third = train(recipe(2)), train(recipe(2), threads=1), train(recipe(2, seed=4))
    assert curve(one) == curve(other)
    assert same(one.policy, other.policy)
    assert not same(one.policy, third.policy)


@pytest.mark.parametrize("randomisation", ["none", "strong"])
def test_an_interrupted_training_goes_on_as_if_it_had_not_been(tmp_path: Path, randomisation: str) -> None:
    whole = train(recipe(randomisation=LEVELS[randomisation]))
    path = tmp_path / "runs" / "reach.npz"
    rows: list[Row] = []

    def three(row: Row) -> bool:
        rows.append(row)
        return len(rows) < 3

    part = train(recipe(randomisation=LEVELS[randomisation]), out=path, progress=three)
    assert not part.done
    assert part.steps == 3 * UPDATE
    assert Policy.load(path).facts["steps"] == 3 * UPDATE
    rest = train(resume=path)
    assert rest.done
    assert curve(rest) == curve(whole)
    assert same(rest.policy, whole.policy)
    assert same(Policy.load(path), whole.policy)


def test_a_finished_training_goes_on_for_longer(tmp_path: Path) -> None:
    path = tmp_path / "reach.npz"
    train(recipe(2), out=path)
    longer = train(resume=path, steps=4 * UPDATE)
    assert longer.steps == 4 * UPDATE
    assert len(longer.history) == 4
    assert longer.plot(tmp_path / "curve.png").stat().st_size > 1000


def test_checkpoints_are_written_under_way(tmp_path: Path) -> None:
    path = tmp_path / "reach.npz"
    seen = []
    train(recipe(4), out=path, checkpoint=2, progress=lambda row: seen.append(path.exists()))
    assert seen == [False, False, True, True]


def test_what_cannot_go_on_reports_why(tmp_path: Path) -> None:
    path = tmp_path / "reach.npz"
    with pytest.raises(HeptarmError, match="does not exist"):
        train(resume=path)
    train(recipe(1), out=path)
    with pytest.raises(CommandRejected, match="differs"):
        train(recipe(1, seed=9), resume=path)
    beside(path).write_bytes(b"nonsense")
    with pytest.raises(HeptarmError, match="cannot be read"):
        train(resume=path)


def test_a_recipe_of_an_older_checkpoint_is_read_under_the_names_of_the_literature() -> None:
    entries = Recipe().as_dict()
    assert Recipe.from_dict(entries) == Recipe()
    older = {
        "rate": 5e-4,
        "discount": 0.9,
        "trace": 0.8,
        "clip": 0.1,
        "value": 0.5,
        "gradient": 2.0,
        "entropy": 0.01,
    }
    names = {
        "learning_rate",
        "gamma",
        "gae_lambda",
        "clip_range",
        "value_coef",
        "max_grad_norm",
        "entropy_coef",
    }
    kept = {name: value for name, value in entries["settings"].items() if name not in names}
    read = Recipe.from_dict({**entries, "settings": kept | older}).settings
    assert (read.learning_rate, read.gamma, read.gae_lambda, read.clip_range) == (5e-4, 0.9, 0.8, 0.1)
    assert (read.value_coef, read.max_grad_norm, read.entropy_coef) == (0.5, 2.0, 0.01)


def test_bad_arguments_are_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CommandRejected, match=r"\.npz"):
        train(recipe(1), out="policy.pt")
    with pytest.raises(CommandRejected, match="device"):
        train(recipe(1), device="tpu")
    with pytest.raises(LimitError, match="steps"):
        Recipe(steps=-5)
    with pytest.raises(LimitError, match="seed"):
        Recipe(seed=-1)
    with pytest.raises(LimitError, match="minibatches"):
        ppo.PpoSettings(envs=3, horizon=5, minibatches=4)
    with pytest.raises(LimitError, match="rate"):
        ppo.PpoSettings(learning_rate=0.0)
    monkeypatch.setenv("WORLD_SIZE", "2")
    monkeypatch.setenv("RANK", "2")
    with pytest.raises(LimitError, match="RANK"):
        train(recipe(1))
    monkeypatch.setenv("RANK", "first")
    with pytest.raises(LimitError, match="first"):
        train(recipe(1))


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_without_a_gpu_cuda_is_refused() -> None:
    with pytest.raises(CommandRejected, match="no GPU"):
        train(recipe(1), device="cuda")


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
def test_a_gpu_trains_too() -> None:
    one, other = train(recipe(3), device="cuda"), train(recipe(3))
    for (a, _), (b, _) in zip(one.policy.layers, other.policy.layers, strict=True):
        assert a == pytest.approx(b, abs=1e-3)


# ---------------------------------------------------------------------------------- several workers

WORKER = """
import sys
from heptarm.rl.task import ReachTask
from heptarm.rl.train.train import Recipe, train
from heptarm.rl.train.ppo import PpoSettings
small = PpoSettings(envs=16, horizon=8, minibatches=2, epochs=2, hidden=(16,))
out, rank, resume = sys.argv[1], sys.argv[2], sys.argv[3]
recipe = Recipe(ReachTask(steps=20, feature="kinematic"), steps=6 * 2 * 16 * 8, settings=small, seed=3)
rows = []
progress = None if resume else lambda row: rows.append(row) or len(rows) < 3
trained = train(None if resume else recipe, out=out, resume=resume or None, progress=progress)
print(trained.steps)
trained.policy.save(f"{out}.{rank}.npz")
"""


def workers(out: Path, resume: str = "") -> list[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    surroundings = {**os.environ, "WORLD_SIZE": "2", "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
    team = [
        subprocess.Popen(
            [sys.executable, "-c", WORKER, str(out), str(rank), resume],
            env={**surroundings, "RANK": str(rank), "LOCAL_RANK": str(rank)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for rank in range(2)
    ]
    said = [one.communicate(timeout=200) for one in team]
    assert [one.returncode for one in team] == [0, 0], said
    return [out_text.strip() for out_text, _ in said]


@pytest.mark.long
def test_two_workers_learn_one_policy_and_go_on_after_an_interruption(tmp_path: Path) -> None:
    path = tmp_path / "reach.npz"
    assert workers(path) == ["768", "768"]  # three updates of two workers
    one, other = (Policy.load(f"{path}.{rank}.npz") for rank in range(2))
    assert same(one, other)
    assert same(one, Policy.load(path))
    assert one.facts["workers"] == 2
    alone = train(recipe(3))
    assert not same(one, alone.policy)
    assert workers(path, resume=str(path)) == ["1536", "1536"]
    assert same(*(Policy.load(f"{path}.{rank}.npz") for rank in range(2)))
    with pytest.raises(CommandRejected, match="2 workers"):
        train(resume=path)


# ---------------------------------------------------------------------------------- that it learns


#: The usual ones are for a longer training.
QUICK = ppo.PpoSettings(action_cost=0.0, spread_end=-1.0)


@pytest.mark.slow
def test_a_few_seconds_of_training_halve_the_distance_to_the_target() -> None:
    task, distances = ReachTask(feature="kinematic"), []
    for steps in (8_192, 122_880):
        trained = train(Recipe(task, steps=steps, seed=1, randomisation=MILD, settings=QUICK), threads=1)
        distances.append(evaluate(trained.policy, 60).mean)
    assert distances[1] < 0.5 * distances[0]


@pytest.mark.slow
@pytest.mark.long
def test_it_learns_in_half_a_minute() -> None:
    task = ReachTask(feature="kinematic")
    trained = train(Recipe(task, steps=350_000, seed=1, randomisation=MILD, settings=QUICK))
    report = evaluate(trained.policy, 200)
    assert report.mean < 0.03
    assert report.success_rate > 0.9
