"""Training: simulate and update repeatedly, with a learning curve, and checkpoints to resume from."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import KW_ONLY, asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from heptarm.errors import CommandRejected, HeptarmError, LimitError, require
from heptarm.rl.policy import Policy
from heptarm.rl.sim.batch import Engine
from heptarm.rl.sim.episodes import BatchSettings
from heptarm.rl.sim.simulate import simulate
from heptarm.values.checks import flag
from heptarm.values.files import refuse_existing

torch = require("torch", extra="rl")

from heptarm.rl.train import ppo  # noqa: E402  needs torch
from heptarm.rl.train.recipe import Recipe  # noqa: E402

__all__ = ["Recipe", "Row", "Trained", "Training", "beside", "train"]

#: Updates between two checkpoints.
CHECKPOINT = 25


@dataclass(frozen=True, slots=True)
class Row:
    """One update in the learning curve.

    Attributes:
        steps: environment steps so far, of all workers.
        seconds: wall time so far, simulation and learning.
        reward: mean of a decision.
        distance: mean at the end of the episodes that ended, actions still noisy [m]; NaN: none ended.
        success: fraction of those that ended within the task's radius; NaN: none ended.
        kl: how far the update moved the policy.
        loss: of the value.
        rate: learning rate.
        spread: mean deviation of the actions.
    """

    steps: int
    seconds: float
    reward: float
    distance: float
    success: float
    kl: float
    loss: float
    rate: float
    spread: float


@dataclass(frozen=True, slots=True)
class Trained:
    """Result of a training.

    Attributes:
        policy: the policy, as numpy.
        history: the learning curve.
        done: all steps were taken; False where `progress` ended it.
    """

    policy: Policy[Any]
    history: tuple[Row, ...]
    _: KW_ONLY
    done: bool = True

    @property
    def steps(self) -> int:
        """Environment steps."""
        return self.history[-1].steps if self.history else 0

    @property
    def seconds(self) -> float:
        """Wall time without imports [s]."""
        return self.history[-1].seconds if self.history else 0.0

    def plot(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
        """Plot the learning curve; return the path of the picture.

        Args:
            path: file to write, `.png`, `.svg` or `.pdf`.
            overwrite: replace a file that exists.

        Raises:
            MissingExtra: matplotlib is not installed.
            CommandRejected: the file exists.
        """
        target = refuse_existing(Path(path), overwrite=flag(overwrite, "overwrite"))
        figures = require("matplotlib.figure", extra="rl")
        figure = figures.Figure(figsize=(7, 4), layout="constrained")
        axes = figure.subplots()
        rows = [row for row in self.history if np.isfinite(row.distance)]
        axes.plot([row.steps / 1e6 for row in rows], [1e3 * row.distance for row in rows])
        axes.set_yscale("log")
        axes.set_xlabel("environment steps [million]")
        axes.set_ylabel("distance at the end of an episode, noisy actions [mm]")
        axes.set_title(f"seed {self.policy.facts.get('seed')}, {self.seconds:.0f} s")
        axes.grid(which="both", alpha=0.3)
        figure.savefig(target, dpi=120)
        return target


class Training:
    """A running training.

    Args:
        recipe: what to do.
        team: the workers.
        threads: of the simulation and of learning.
        engine: class of the simulation's engine.
    """

    def __init__(self, recipe: Recipe, *, team: Any, threads: int = 2, engine: Any = Engine) -> None:
        self.recipe, self.team = recipe, team
        seeds = np.random.SeedSequence([recipe.seed, team.rank])
        settings = recipe.settings
        self.random = torch.Generator().manual_seed(int(seeds.generate_state(1)[0]))
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(recipe.seed)  # the same networks everywhere
            task = recipe.task
            self.agent = ppo.Agent(
                task.observation_size, task.action_size, settings, hidden=task.hidden_size
            ).to(team.device)
        team.align(self.agent)
        self.learner = ppo.Learner(
            self.agent,
            settings,
            team.mean if team.size > 1 else None,
            threads=threads if team.device.type == "cpu" else 1,
        )
        self.arms = simulate(
            task,
            BatchSettings(
                envs=settings.envs, randomisation=recipe.randomisation, seed=seeds, threads=threads
            ),
            engine=engine,
            reveal=True,
        )
        self.history: list[Row] = []
        self.steps = 0
        self.seconds = 0.0

    @property
    def done(self) -> bool:
        """Whether all steps are done."""
        return self.steps >= self.recipe.steps

    def update(self) -> Row:
        """Simulate a horizon and learn from it."""
        begun = time.perf_counter()
        recipe, settings = self.recipe, self.recipe.settings
        is_taught = self.steps < recipe.taught
        samples, facts, taught = self._experience(is_taught=is_taught)
        self.steps += settings.horizon * settings.envs * self.team.size
        if is_taught:
            facts |= self.learner.imitate(samples, taught, self.random)
        else:
            progress = (self.steps - recipe.taught) / max(1, recipe.steps - recipe.taught)
            facts |= self.learner.update(samples, self.random, progress)
        self.seconds += time.perf_counter() - begun
        row = Row(steps=self.steps, seconds=self.seconds, **facts)
        self.history.append(row)
        return row

    def _experience(self, *, is_taught: bool) -> tuple[ppo.Samples, dict[str, float], Any]:
        arms, agent, s, device = self.arms, self.agent, self.recipe.settings, self.team.device
        task = self.recipe.task
        shape = (s.horizon, s.envs)
        noise = torch.randn((*shape, task.action_size), generator=self.random).to(device)
        action, mean, taught = torch.empty_like(noise), torch.empty_like(noise), torch.zeros_like(noise)
        raw = np.empty((s.horizon + 1, s.envs, task.observation_size + task.hidden_size), dtype=np.float32)
        reward, done = np.empty(shape, dtype=np.float32), np.empty(shape, dtype=np.bool_)
        finals, ended = [], []
        with torch.no_grad():
            noise *= agent.spread.exp()
            raw[0] = arms.observe()
            for t in range(s.horizon):
                mean[t] = agent.act(agent.scaler(torch.from_numpy(raw[t]).to(device)))
                torch.add(mean[t], noise[t], out=action[t])
                decided = action[t].cpu().numpy()
                if is_taught:
                    taught[t] = torch.from_numpy(arms.teach())
                step = arms.step(decided)
                reward[t], done[t], raw[t + 1] = step.reward, step.done, step.observation
                if s.action_cost:
                    reward[t] -= s.action_cost * (np.clip(decided, -1.0, 1.0) ** 2).sum(-1)
                if step.done.any():
                    finals.append(step.final)
                    ended.append(step.distance[step.done])
            # what does not affect the next decision is computed for all decisions at once
            seen = agent.scaler(torch.from_numpy(raw).to(device))
            worth = agent.value(seen).squeeze(-1)
            value, after = worth[:-1], worth[1:].clone()
            if finals:
                last = torch.from_numpy(np.concatenate(finals).astype(np.float32)).to(device)
                after[torch.from_numpy(done).to(device)] = agent.value(agent.scaler(last)).squeeze(-1)
            gains = torch.from_numpy(s.reward_scale * reward).to(device)
            over = torch.from_numpy(done.astype(np.float32)).to(device)
            advantage = ppo.advantages(gains, value, after, over, s)
            likelihood = agent.likelihood(mean, action)
            self._look(raw[:-1])
        samples = ppo.Samples(seen[:-1], action, mean, likelihood, value, advantage)
        return samples, self._facts(float(reward.mean()), ended), taught

    def _look(self, raw: Any) -> None:
        """Let the scaler see the observations of all workers."""
        team, flat = self.team, raw.reshape(-1, raw.shape[-1]).astype(np.float64)
        moments = torch.from_numpy(np.stack([flat.sum(0), (flat**2).sum(0)])).to(team.device)
        total, squares = team.total(moments)
        count = torch.tensor(float(len(flat) * team.size), dtype=torch.float64, device=team.device)
        mean = total / count
        self.agent.scaler.add(count, mean, (squares - count * mean**2).clamp_min(0.0))

    def _facts(self, reward: float, ended: list[Any]) -> dict[str, float]:
        distances = np.concatenate(ended) if ended else np.zeros(0)
        close = float((distances <= self.recipe.task.radius).sum())
        sums = torch.tensor(
            [reward, float(distances.sum()), close, float(len(distances))], dtype=torch.float64
        ).to(self.team.device)
        reward, total, close, count = self.team.total(sums).tolist()
        missing = float("nan")
        return {
            "reward": reward / self.team.size,
            "distance": total / count if count else missing,
            "success": close / count if count else missing,
        }

    def policy(self) -> Policy[Any]:
        """The current policy."""
        agent, recipe = self.agent, self.recipe
        layers = [
            (layer.weight.detach().cpu().numpy().T, layer.bias.detach().cpu().numpy())
            for layer in agent.policy
            if isinstance(layer, torch.nn.Linear)
        ]
        facts = {
            "seed": recipe.seed,
            "steps": self.steps,
            "seconds": round(self.seconds, 2),
            "workers": self.team.size,
            "randomisation": recipe.randomisation.as_dict(),
            "settings": recipe.settings.as_dict(),
        }
        scaler, seen = agent.scaler, agent.observations
        return Policy(
            recipe.task,
            layers=layers,
            mean=scaler.mean[:seen].cpu().numpy(),
            std=scaler.std[:seen].cpu().numpy(),
            facts=facts,
        )

    # ------------------------------------------------------------------------------ checkpoints

    def save(self, path: Path) -> None:
        """Write the policy, and a checkpoint beside it."""
        if self.team.is_first:
            path.parent.mkdir(parents=True, exist_ok=True)
            self.policy().save(path, overwrite=True)
        state = {
            "recipe": self.recipe.as_dict(),
            "workers": self.team.size,
            "agent": self.agent.state_dict(),
            "optimiser": self.learner.optimiser.state_dict(),
            "rate": self.learner.rate,
            "random": self.random.get_state(),
            "arms": {
                k: torch.from_numpy(v) if isinstance(v, np.ndarray) else v
                for k, v in self.arms.save().items()
            },
            "history": [asdict(row) for row in self.history],
        }
        target = beside(path, self.team.rank)
        target.parent.mkdir(parents=True, exist_ok=True)
        half = target.with_name(f".{target.name}.{os.getpid()}.part")
        torch.save(state, half)
        half.replace(target)

    def load(self, state: dict[str, Any]) -> None:
        """Resume from the files of `save`."""
        self.agent.load_state_dict(state["agent"])
        self.learner.optimiser.load_state_dict(state["optimiser"])
        self.learner.rate = state["rate"]
        self.random.set_state(state["random"])
        self.arms.load({k: v.numpy() if isinstance(v, torch.Tensor) else v for k, v in state["arms"].items()})
        self.history = [Row(**row) for row in state["history"]]
        self.steps = self.history[-1].steps if self.history else 0
        self.seconds = self.history[-1].seconds if self.history else 0.0


def beside(path: Path, rank: int = 0) -> Path:
    """Path of the checkpoint of a training, beside the `.npz` of its policy."""
    return path.with_name(f"{path.stem}.train{rank or ''}.pt")


def train(
    recipe: Recipe | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    progress: Callable[[Row], object] | None = None,
    resume: str | os.PathLike[str] | None = None,
    steps: int | None = None,
    device: str = "cpu",
    threads: int = 2,
    checkpoint: int = CHECKPOINT,
    engine: Any = Engine,
    overwrite: bool = False,
) -> Trained:
    """Train a policy.

    Started by `torchrun`, every worker simulates `settings.envs` arms and all learn one policy; see
    `heptarm.rl.train.distributed`.

    Args:
        recipe: what to train; None: the defaults, or with `resume` what was begun.
        out: `.npz` file for the policy; what is needed to go on lies beside it.
        progress: called after each update; returning False ends the training there.
        resume: policy file of an earlier `out` to go on from; it goes on exactly as if never interrupted.
        steps: environment steps instead of the recipe's, as to train longer after a `resume`.
        device: "cpu" or "cuda": where the networks live; the simulation stays on the CPU.
        threads: of the simulation and of learning; the result does not depend on them.
        checkpoint: updates between two checkpoints.
        engine: class of the simulation's engine.
        overwrite: replace an `out` that exists and is not resumed.

    Raises:
        CommandRejected: arguments that contradict each other, or `out` exists and is not resumed.
        HeptarmError: no checkpoint to resume from, or no such file.
        MissingExtra: torch or `mujoco.batch` is not installed.
    """
    path = Path(out) if out is not None else Path(resume) if resume is not None else None
    if path is not None and path.suffix != ".npz":
        raise CommandRejected(f"out must end in .npz, got {path.name!r}", parameter="out", value=str(path))
    if path is not None and (resume is None or Path(resume) != path):
        refuse_existing(path, overwrite=flag(overwrite, "overwrite"), name="out")
    if checkpoint < 1:
        raise LimitError(f"checkpoint must be at least 1, got {checkpoint}", code=2, parameter="checkpoint")
    torch.set_num_threads(1)  # for tensors this small, more would wait for each other most of the time
    from heptarm.rl.train import distributed

    with distributed.team(device) as team:
        state = _state(Path(resume), team) if resume is not None else None
        if state is not None:
            begun = Recipe.from_dict(state["recipe"])
            if recipe is not None and replace(recipe, steps=begun.steps) != begun:
                raise CommandRejected(
                    "the recipe differs from that of the checkpoint", hint="leave it out, or start again"
                )
            recipe = recipe or begun
        recipe = recipe or Recipe()
        if steps is not None:
            recipe = replace(recipe, steps=steps)
        training = Training(recipe, team=team, threads=threads, engine=engine)
        if state is not None:
            training.load(state)
        stopped = False
        while not training.done and not stopped:
            row = training.update()
            answer = progress(row) if progress is not None and team.is_first else None
            stopped = team.any(answer is False)
            if path is not None and (training.done or stopped or len(training.history) % checkpoint == 0):
                training.save(path)
        return Trained(training.policy(), tuple(training.history), done=training.done)


def _state(path: Path, team: Any) -> dict[str, Any]:
    file = beside(path, team.rank)
    try:
        state: dict[str, Any] = torch.load(file, weights_only=True, map_location="cpu")
    except FileNotFoundError:
        raise HeptarmError(
            f"checkpoint {file} does not exist", hint="give the .npz file of an earlier training"
        ) from None
    except Exception as error:
        raise HeptarmError(f"{file} cannot be read ({error})") from error
    if state["workers"] != team.size:
        raise CommandRejected(
            f"the checkpoint is of {state['workers']} workers, these are {team.size}",
            hint=f"start {state['workers']} workers",
        )
    return state
