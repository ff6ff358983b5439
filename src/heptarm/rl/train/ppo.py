"""Proximal policy optimisation (Schulman et al. 2017) in torch, in a minimal form.

Two separate networks give the mean action and the value; the action's spread does not depend on the state. The
learning rate follows the distance that an update moves the policy (Kullback-Leibler divergence), and its
ceiling falls towards the end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import KW_ONLY, asdict, dataclass
from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn

from heptarm.errors import LimitError
from heptarm.rl.policy import CLIP


@dataclass(frozen=True, slots=True)
class PpoSettings:
    """Parameters of the algorithm.

    Attributes:
        envs: arms simulated at once.
        horizon: decisions of each between two updates.
        epochs: passes over the samples of an update.
        minibatches: parts that a pass is cut into.
        learning_rate: ceiling of the learning rate at the beginning.
        learning_rate_end: fraction of that ceiling at the end.
        gamma: discount of a reward one decision later.
        gae_lambda: lambda of the generalised advantage estimate (Schulman et al. 2016).
        clip_range: largest change of an action's likelihood that is rewarded.
        kl: the learning rate falls above the second, rises below the first.
        spread: logarithm of the action's deviation at the beginning.
        spread_end: its ceiling at the end, to which it falls during the second half: a policy is no more precise
            than the noise it learned in, but without noise it finds nothing.
        hidden: widths of the hidden layers of both networks.
        value_coef: weight of the value's loss.
        max_grad_norm: largest norm of the gradient.
        entropy_coef: weight of the entropy bonus.
        action_cost: costs of an action's square, per decision; part of training, not of the task.
        reward_scale: factor on the rewards, for the value network's sake.

    Raises:
        LimitError: a number outside its range.
    """

    _: KW_ONLY
    envs: int = 512
    horizon: int = 16
    epochs: int = 5
    minibatches: int = 4
    learning_rate: float = 1e-3
    learning_rate_end: float = 0.1
    gamma: float = 0.95
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    kl: tuple[float, float] = (0.004, 0.016)
    spread: float = -0.5
    spread_end: float = -2.3
    hidden: tuple[int, ...] = (64, 64)
    value_coef: float = 1.0
    max_grad_norm: float = 1.0
    entropy_coef: float = 0.0
    action_cost: float = 4e-3
    reward_scale: float = 5.0

    def __post_init__(self) -> None:
        positive = (
            "envs",
            "horizon",
            "epochs",
            "minibatches",
            "learning_rate",
            "clip_range",
            "value_coef",
            "max_grad_norm",
        )
        for name in (*positive, "reward_scale"):
            self._want(name, getattr(self, name) > 0, "a positive number")
        for name in ("gamma", "gae_lambda", "learning_rate_end"):
            self._want(name, 0 <= getattr(self, name) <= 1, "0 to 1")
        for name in ("entropy_coef", "action_cost"):
            self._want(name, getattr(self, name) >= 0, "no negative number")
        object.__setattr__(self, "hidden", tuple(self.hidden))
        object.__setattr__(self, "kl", tuple(self.kl))
        self._want("hidden", len(self.hidden) > 0 and min(self.hidden) > 0, "widths of one layer or more")
        fits = self.envs * self.horizon % self.minibatches == 0
        self._want("minibatches", fits, f"a divisor of {self.envs} x {self.horizon}")

    def _want(self, name: str, fine: bool, wanted: str) -> None:
        if not fine:
            raise LimitError(
                f"{name} must be {wanted}, got {getattr(self, name)}",
                code=2,
                parameter=name,
                value=getattr(self, name),
                allowed=wanted,
            )

    def ceiling(self, progress: float) -> float:
        """Upper limit of `spread` after a fraction of the training, 0 to 1."""
        left = min(1.0, 2.0 * (1.0 - min(1.0, progress)))
        return self.spread_end + (self.spread - self.spread_end) * left

    def as_dict(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self)


class Scaler(nn.Module):  # type: ignore[misc]  # torch is not looked into
    """Running mean and deviation of the observations (Chan et al. 1979)."""

    def __init__(self, size: int) -> None:
        super().__init__()
        self.register_buffer("count", torch.tensor(1e-4, dtype=torch.float64))
        self.register_buffer("mean", torch.zeros(size, dtype=torch.float64))
        # sum of squared deviations
        self.register_buffer("square", torch.full((size,), 1e-4, dtype=torch.float64))
        self.count: Tensor
        self.mean: Tensor
        self.square: Tensor

    @property
    def std(self) -> Tensor:
        """Deviation, shape (n,)."""
        return (self.square / self.count).sqrt().clamp_min(1e-3)

    def add(self, count: Tensor, mean: Tensor, square: Tensor) -> None:
        """Add samples by their number, mean and sum of squared deviations."""
        total = self.count + count
        away = mean - self.mean
        self.mean += away * (count / total)
        self.square += square + away**2 * (self.count * count / total)
        self.count.copy_(total)

    def forward(self, x: Tensor) -> Tensor:
        """Scaled observations."""
        scaled: Tensor = ((x - self.mean.float()) / self.std.float()).clamp(-CLIP, CLIP)
        return scaled


class _Elu(torch.autograd.Function):  # type: ignore[misc]
    """ELU from one exponential, which is its derivative as well: half the time of torch's own on a processor."""

    @staticmethod
    def forward(ctx: Any, x: Tensor) -> Tensor:
        slope = x.clamp(max=0.0).exp_()
        ctx.save_for_backward(slope)
        result: Tensor = slope.sub(1.0).add_(x.relu())
        return result

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        (slope,) = ctx.saved_tensors
        result: Tensor = gradient * slope
        return result


class Elu(nn.Module):  # type: ignore[misc]
    """The activation between two layers: x above 0, exp(x) - 1 below (Clevert et al. 2016)."""

    def forward(self, x: Tensor) -> Tensor:
        """Activated values, of the same shape."""
        result: Tensor = _Elu.apply(x)
        return result


def network(inputs: int, hidden: tuple[int, ...], outputs: int, last: float) -> nn.Sequential:
    """Layers with ELU between them, with orthogonal initialisation."""
    parts: list[nn.Module] = []
    widths = (inputs, *hidden, outputs)
    for index, (one, other) in enumerate(pairwise(widths)):
        layer = nn.Linear(one, other)
        nn.init.orthogonal_(layer.weight, last if index == len(hidden) else 2**0.5)
        nn.init.zeros_(layer.bias)
        parts += [layer, Elu()]
    return nn.Sequential(*parts[:-1])


class Agent(nn.Module):  # type: ignore[misc]
    """Scaler, policy network, value network.

    Args:
        observations: size of an observation.
        actions: size of an action.
        settings: the numbers.
        hidden: how many numbers at the end of what is seen only the value network sees.
    """

    def __init__(self, observations: int, actions: int, settings: PpoSettings, *, hidden: int = 0) -> None:
        super().__init__()
        self.observations = observations
        self.scaler = Scaler(observations + hidden)
        self.policy = network(observations, settings.hidden, actions, 0.01)
        self.value = network(observations + hidden, settings.hidden, 1, 1.0)
        self.spread = nn.Parameter(torch.full((actions,), settings.spread))

    def act(self, seen: Tensor) -> Tensor:
        """Mean actions for what is seen, scaled."""
        mean: Tensor = self.policy(seen[..., : self.observations])
        return mean

    def likelihood(self, mean: Tensor, action: Tensor) -> Tensor:
        """Log-likelihood of actions, up to a constant."""
        return (-0.5 * ((action - mean) * torch.exp(-self.spread)) ** 2 - self.spread).sum(-1)


@dataclass(slots=True)
class Samples:
    """Of one update; leading axes (horizon, envs)."""

    seen: Tensor  # scaled observations
    action: Tensor
    mean: Tensor
    likelihood: Tensor
    value: Tensor
    advantage: Tensor


def advantages(reward: Tensor, value: Tensor, after: Tensor, done: Tensor, settings: PpoSettings) -> Tensor:
    """Generalised advantage estimates (Schulman et al. 2016), shape (horizon, envs).

    Episodes end by their length only, so the value of the last observation continues: `after` holds it where an
    episode ended, and the value of the next decision elsewhere.
    """
    surprise = reward + settings.gamma * after - value
    result = torch.empty_like(surprise)
    running = torch.zeros_like(surprise[0])
    fade = settings.gamma * settings.gae_lambda * (1.0 - done)
    for index in range(len(surprise) - 1, -1, -1):
        running = surprise[index] + fade[index] * running
        result[index] = running
    return result


class Learner:
    """Updates an agent.

    The two networks are independent of each other but for the norm of their gradient, so that two threads can
    work on them at once, with the same result as one.

    Args:
        agent: what learns.
        settings: the numbers.
        mean: averages a tensor over all workers; None: there is only this one.
        threads: from 2 the networks have a thread each.
    """

    def __init__(
        self,
        agent: Agent,
        settings: PpoSettings,
        mean: Callable[[Tensor], Tensor] | None = None,
        *,
        threads: int = 1,
    ) -> None:
        self.agent, self.settings = agent, settings
        self._mean, self._threads = mean, threads
        self._acts = [*agent.policy.parameters(), agent.spread]
        self._values = list(agent.value.parameters())
        self.rate = settings.learning_rate
        self._trained = [*agent.policy.parameters(), *agent.value.parameters(), agent.spread]
        self.optimiser = torch.optim.Adam(self._trained, lr=settings.learning_rate, eps=1e-5, fused=True)

    def update(self, samples: Samples, shuffle: torch.Generator, progress: float) -> dict[str, float]:
        """One update.

        Args:
            samples: what was experienced since the last.
            shuffle: draws the order of the samples.
            progress: fraction of the training that is done, 0 to 1.

        Returns:
            Mean "kl" and "loss" of the value, the learning "rate", the mean "spread" of the actions.
        """
        s, agent = self.settings, self.agent
        ceiling = s.learning_rate * (1.0 - (1.0 - s.learning_rate_end) * min(1.0, progress))
        seen, action = samples.seen.flatten(0, 1), samples.action.flatten(0, 1)
        before, mean = samples.likelihood.flatten(), samples.mean.flatten(0, 1)
        gain = samples.advantage.flatten()
        goal = gain + samples.value.flatten()
        centre = self._shared(gain.mean())
        deviation = self._shared(((gain - centre) ** 2).mean()).sqrt()
        gain = (gain - centre) / (deviation + 1e-8)
        spread = agent.spread.detach().clone()
        kls, losses = [], []
        size = len(gain) // s.minibatches
        with self._beside() as beside:
            for _ in range(s.epochs):
                order = torch.randperm(len(gain), generator=shuffle).to(gain.device)
                shuffled = (rows.index_select(0, order) for rows in (seen, action, before, gain, mean, goal))
                for x, a, b, g, m, aim in zip(*(rows.split(size) for rows in shuffled), strict=True):
                    loss_later = beside(self._value_gradients, x, aim)
                    kl = self._policy_gradients(x, a, b, g, m, spread)
                    losses.append(loss_later())
                    self._average_gradients()
                    nn.utils.clip_grad_norm_(self._trained, s.max_grad_norm)
                    kls.append(float(self._shared(kl)))
                    if kls[-1] > s.kl[1]:
                        self.rate = max(self.rate / 1.5, 1e-5)
                    elif kls[-1] < s.kl[0]:
                        self.rate = self.rate * 1.5
                    self.rate = min(self.rate, ceiling)
                    self.optimiser.param_groups[0]["lr"] = self.rate
                    self.optimiser.step()
        with torch.no_grad():
            agent.spread.clamp_(max=s.ceiling(progress))
        count = len(kls)
        return {
            "kl": sum(kls) / count,
            "loss": sum(losses) / count,
            "rate": self.rate,
            "spread": float(agent.spread.detach().exp().mean()),
        }

    def imitate(self, samples: Samples, taught: Tensor, shuffle: torch.Generator) -> dict[str, float]:
        """One update towards a teacher's actions where the policy itself came to (DAgger, Ross et al. 2011).

        The value learns what the policy earned, so that it is ready when rewards take over.

        Args:
            samples: what was experienced since the last update.
            taught: what the teacher would have done there, shape (horizon, envs, actions).
            shuffle: draws the order of the samples.

        Returns:
            As of `update`; "loss" is the mean square from the teacher's actions.
        """
        s, agent = self.settings, self.agent
        seen, goal = samples.seen.flatten(0, 1), (samples.advantage + samples.value).flatten()
        aim = taught.flatten(0, 1)
        losses = []
        agent.spread.grad = None
        self.optimiser.param_groups[0]["lr"] = s.learning_rate
        for _ in range(s.epochs):
            for rows in torch.randperm(len(goal), generator=shuffle).split(len(goal) // s.minibatches):
                x = seen[rows.to(seen.device)]
                self._value_gradients(x, goal[rows])
                loss = ((agent.act(x) - aim[rows]) ** 2).mean()
                _differentiate(loss, list(agent.policy.parameters()))
                losses.append(float(self._shared(loss.detach())))
                self._average_gradients()
                nn.utils.clip_grad_norm_(self._trained, s.max_grad_norm)
                self.optimiser.step()
        self.rate = (
            0.1 * s.learning_rate
        )  # the optimiser's moments are of smaller gradients than those of rewards
        return {
            "kl": 0.0,
            "loss": sum(losses) / len(losses),
            "rate": s.learning_rate,
            "spread": float(agent.spread.detach().exp().mean()),
        }

    @contextmanager
    def _beside(self) -> Iterator[Callable[..., Callable[[], float]]]:
        """What begins a function, in a second thread if there is one; the function returned waits for its result."""
        if self._threads == 1:
            yield _at_once
            return
        # torch limits its own threads for each thread
        with ThreadPoolExecutor(1, initializer=torch.set_num_threads, initargs=(1,)) as pool:
            yield lambda function, *given: pool.submit(function, *given).result

    def _policy_gradients(
        self, seen: Tensor, action: Tensor, before: Tensor, gain: Tensor, mean: Tensor, spread: Tensor
    ) -> Tensor:
        """Set the gradients of policy and spread; return the divergence."""
        s, agent = self.settings, self.agent
        now = agent.act(seen)
        ratio = torch.exp(agent.likelihood(now, action) - before)
        better = torch.minimum(gain * ratio, gain * ratio.clamp(1.0 - s.clip_range, 1.0 + s.clip_range))
        _differentiate(-better.mean() - s.entropy_coef * agent.spread.sum(), self._acts)
        with torch.no_grad():
            return divergence(mean, spread, now, agent.spread)

    def _value_gradients(self, seen: Tensor, goal: Tensor) -> float:
        """Set the gradients of the value network; return its loss."""
        loss = ((self.agent.value(seen).squeeze(-1) - goal) ** 2).mean()
        _differentiate(self.settings.value_coef * loss, self._values)
        return float(loss.detach())

    def _shared(self, value: Tensor) -> Tensor:
        return value if self._mean is None else self._mean(value)

    def _average_gradients(self) -> None:
        if self._mean is None:
            return
        flat = self._mean(torch.cat([p.grad.flatten() for p in self._trained if p.grad is not None]))
        for p in self._trained:
            if p.grad is not None:
                p.grad.copy_(flat[: p.numel()].view_as(p))
                flat = flat[p.numel() :]


def _at_once(function: Callable[..., float], *given: Tensor) -> Callable[[], float]:
    result = function(*given)
    return lambda: result


def _differentiate(loss: Tensor, parameters: list[nn.Parameter]) -> None:
    for parameter, gradient in zip(parameters, torch.autograd.grad(loss, parameters), strict=True):
        parameter.grad = gradient


def divergence(mean: Tensor, spread: Tensor, now: Tensor, spread_now: Tensor) -> Tensor:
    """Mean Kullback-Leibler divergence of the old from the new action distribution."""
    ratio = torch.exp(2.0 * (spread - spread_now))
    away = ((mean - now) * torch.exp(-spread_now)) ** 2
    return (spread_now - spread + 0.5 * (ratio + away - 1.0)).sum(-1).mean()
