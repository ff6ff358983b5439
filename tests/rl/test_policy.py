"""Policies: a file of numbers that needs no torch."""

from __future__ import annotations

import json
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from heptarm.errors import CommandRejected, HeptarmError, ShapeError
from heptarm.rl.policy import Policy
from heptarm.rl.task import ReachTask

Layers = list[tuple[npt.ArrayLike, npt.ArrayLike]]


def policy(task: ReachTask | None = None) -> Policy[Any]:
    task = task or ReachTask(feature="kinematic")
    random = np.random.default_rng(0)
    widths = (task.observation_size, 32, 16, task.action_size)
    layers: Layers = [(random.normal(size=(a, b)), random.normal(size=b)) for a, b in pairwise(widths)]
    size = task.observation_size
    return Policy(
        task, layers=layers, mean=random.normal(size=size), std=random.uniform(1, 2, size), facts={"seed": 7}
    )


def test_a_policy_is_the_same_after_its_file(tmp_path: Path) -> None:
    first = policy(ReachTask("iiwa7", feature="kinematic", radius=0.02))
    second = Policy.load(first.save(tmp_path / "reach.npz"))
    assert second.task == first.task
    assert second.facts == {"seed": 7}
    seen = np.random.default_rng(1).normal(size=(9, 23))
    assert (first(seen) == second(seen)).all()
    assert [path.name for path in tmp_path.iterdir()] == ["reach.npz"]


def test_one_arm_and_many_get_the_same_actions_within_bounds() -> None:
    p = policy()
    seen = np.random.default_rng(2).normal(scale=3, size=(50, 23))
    actions = p(seen)
    assert actions.shape == (50, 7)
    assert np.abs(actions).max() == 1.0
    for row, action in zip(seen, actions, strict=True):
        assert p(row) == pytest.approx(action, abs=1e-3)


def test_it_decides_what_the_torch_network_does() -> None:
    torch = pytest.importorskip("torch")
    from heptarm.rl.train import ppo

    agent = ppo.Agent(17, 7, ppo.PpoSettings())
    seen = np.random.default_rng(3).normal(size=(40, 17)).astype(np.float32)
    agent.scaler.add(*(torch.tensor(v, dtype=torch.float64) for v in (40.0, seen.mean(0), 40 * seen.var(0))))
    with torch.no_grad():
        agent.policy[-1].weight.mul_(50.0)
        wanted = agent.policy(agent.scaler(torch.from_numpy(seen))).clamp(-1, 1).numpy()
    layers = [
        (m.weight.detach().numpy().T, m.bias.detach().numpy()) for m in agent.policy if hasattr(m, "weight")
    ]
    p = Policy(ReachTask(), layers=layers, mean=agent.scaler.mean.numpy(), std=agent.scaler.std.numpy())
    assert p(seen) == pytest.approx(wanted, abs=1e-5)


def test_a_policy_runs_without_torch(tmp_path: Path) -> None:
    path = policy().save(tmp_path / "reach.npz")
    code = (
        "import sys; sys.modules['torch'] = None\n"
        "from heptarm.rl.policy import Policy\n"
        "from heptarm.rl.evaluate import evaluate\n"
        f"print(evaluate(Policy.load({str(path)!r}), 3).final.shape)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "(3,)"


def test_files_that_are_no_policies_are_refused(tmp_path: Path) -> None:
    with pytest.raises(HeptarmError, match=r"gone\.npz cannot be read: no such file"):
        Policy.load(tmp_path / "gone.npz")
    (tmp_path / "text.npz").write_text("hello")
    with pytest.raises(HeptarmError, match="is not a policy"):
        Policy.load(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(HeptarmError, match="is not a policy"):
        Policy.load(tmp_path / "other.npz")
    np.savez(tmp_path / "pickle.npz", about=np.array([{"format": 1}], dtype=object))
    with pytest.raises(HeptarmError, match="is not a policy"):
        Policy.load(tmp_path / "pickle.npz")
    np.savez(tmp_path / "later.npz", about=np.array(json.dumps({"format": 99})))
    with pytest.raises(HeptarmError, match="format 99"):
        Policy.load(tmp_path / "later.npz")
    with pytest.raises(CommandRejected, match=r"\.npz"):
        policy().save(tmp_path / "policy.txt")


def test_layers_that_do_not_fit_are_refused() -> None:
    task = ReachTask()
    fine: Layers = [(np.zeros((17, 7)), np.zeros(7))]
    ones = np.ones(17)
    with pytest.raises(ShapeError, match="outputs"):
        Policy(task, layers=[(np.zeros((17, 3)), np.zeros(3))], mean=ones, std=ones)
    with pytest.raises(ShapeError, match="layer 0"):
        Policy(task, layers=[(np.zeros((5, 7)), np.zeros(7))], mean=ones, std=ones)
    with pytest.raises(ShapeError, match="mean and std"):
        Policy(task, layers=fine, mean=np.ones(4), std=ones)
    with pytest.raises(ShapeError, match="mean and std"):
        Policy(task, layers=fine, mean=ones, std=0 * ones)
