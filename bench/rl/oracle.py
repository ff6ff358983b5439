"""Oracle: the joint positions that reach a target in the fewest full-speed steps, and an arm that moves straight there.

The fewest steps bound every policy. The arm that is driven there does not: it lags, and knows nothing of it.
"""

from __future__ import annotations

import numpy as np

from heptarm.model.batch import jacobian_batch
from heptarm.rl.task import ReachTask
from heptarm.values.checks import Array

_STARTS, _ROUNDS, _STEP, _DAMPED = 120, 120, 0.6, 1e-3
_AIM = 0.8  # of the radius: an oracle that aims at the boundary itself would narrowly miss it


class Oracle:
    """A policy that knows the solution of every target: each joint moves to it at full speed.

    Args:
        task: with joint actions.
    """

    def __init__(self, task: ReachTask) -> None:
        self.task = task
        self._solved: dict[bytes, tuple[Array, int]] = {}

    def __call__(self, observation: Array, /) -> Array:
        """The action of an observation."""
        model = self.task.model
        q = (observation[:7] + 1.0) * (model.q_max - model.q_min) / 2.0 + model.q_min
        goal, _ = self.solve(observation[14:17])
        return np.clip((goal - q) / self.task.joint_step, -1.0, 1.0)

    def solve(self, target: Array) -> tuple[Array, int]:
        """Joints that reach a target in the fewest steps from home, and how many they are."""
        key = target.tobytes()
        if key not in self._solved:
            low, high = 5, 70
            found = self._nearest(target, high)[0]
            while low < high:
                middle = (low + high) // 2
                q, distance = self._nearest(target, middle)
                if distance <= _AIM * self.task.radius:
                    found, high = q, middle
                else:
                    low = middle + 1
            self._solved[key] = found, low
        return self._solved[key]

    def _nearest(self, target: Array, steps: int) -> tuple[Array, float]:
        """The joints within so many steps from home that bring the flange nearest, from many starts."""
        task, model, random = self.task, self.task.model, np.random.default_rng(steps)
        reach = task.joint_step * steps
        low = np.maximum(np.asarray(task.home) - reach, model.q_min)
        high = np.minimum(np.asarray(task.home) + reach, model.q_max)
        q = random.uniform(low, high, (_STARTS, 7))
        q[::2] = np.where(random.random((_STARTS // 2, 7)) < 0.5, low, high)
        for _ in range(_ROUNDS):
            jacobian, error = jacobian_batch(model, q)[:, :3], target - task.tip(q)
            pull = np.einsum("sji,sj->si", jacobian, error)
            free = ~(((q <= low + 1e-12) & (pull < 0)) | ((q >= high - 1e-12) & (pull > 0)))
            jacobian = jacobian * free[:, None, :]
            square = jacobian @ np.swapaxes(jacobian, -1, -2) + _DAMPED * np.eye(3)
            step = np.linalg.solve(square, error[..., None])[..., 0]
            q = np.clip(q + _STEP * np.einsum("sji,sj->si", jacobian, step), low, high)
        distance = np.linalg.norm(task.tip(q) - target, axis=1)
        best = int(distance.argmin())
        return q[best], float(distance[best])
