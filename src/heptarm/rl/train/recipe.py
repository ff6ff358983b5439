"""Settings of a training: task, simulated robots, parameters of the algorithm, seed."""

from __future__ import annotations

from dataclasses import KW_ONLY, asdict, dataclass, field
from typing import Any

from heptarm.errors import LimitError
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.sim.randomisation import MILD, STRONG, Randomisation
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import Task, task_from_dict
from heptarm.rl.train import ppo

#: Environment steps of a training by its task's feature; enough for some millimetres.
STEPS = {"": 2_200_000, "kinematic": 1_300_000}
#: Likewise of a task with contacts.
_CONTACT_STEPS = 1_500_000
#: Names of settings in checkpoints that were made before the settings had the names of the literature.
_OLDER = {
    "rate": "learning_rate",
    "rate_end": "learning_rate_end",
    "discount": "gamma",
    "trace": "gae_lambda",
    "clip": "clip_range",
    "value": "value_coef",
    "gradient": "max_grad_norm",
    "entropy": "entropy_coef",
}
#: Robots, environment steps with the teacher, and algorithm of tasks with contacts. The noise is small from the
#: beginning: the teacher has shown what to try.
LATE = Randomisation(latency=(0, 1), bandwidth=(15.0, 40.0))
TAUGHT = 100_000
CONTACT_SETTINGS = ppo.PpoSettings(
    envs=256,
    horizon=16,
    gamma=0.97,
    hidden=(128, 128),
    learning_rate=1e-3,
    reward_scale=0.3,
    spread=-1.4,
    spread_end=-2.0,
)


@dataclass(frozen=True, slots=True)
class Recipe:
    """All settings of a training; saved with its checkpoints.

    The defaults train policies that tolerate late commands and a compliant arm; `exact` is that of the paper.

    Attributes:
        task: the task.
        steps: environment steps, of all workers; rounded up to whole updates; 0: `STEPS`.
        taught: of these steps so many, at the beginning, imitate the task's teacher; then rewards take over. Only tasks
            with a teacher, see `ContactTask.teach`.
        seed: of networks, simulation and shuffling.
        randomisation: what differs between the simulated robots.
        settings: numbers of the algorithm.
    """

    task: Task = field(default_factory=ReachTask)
    _: KW_ONLY
    steps: int = 0
    taught: int = 0
    seed: int = 0
    randomisation: Randomisation = STRONG
    settings: ppo.PpoSettings = field(default_factory=ppo.PpoSettings)

    def __post_init__(self) -> None:
        if self.steps == 0:
            enough = _CONTACT_STEPS if isinstance(self.task, ContactTask) else STEPS[self.task.feature]
            object.__setattr__(self, "steps", enough)
        if self.steps < 1:
            raise LimitError(f"steps must be at least 1, got {self.steps}", code=2, parameter="steps")
        if self.taught and not self.task.has_teacher:
            raise LimitError(
                f"taught must be 0 for a task without a teacher, got {self.taught}",
                code=2,
                parameter="taught",
            )
        if self.seed < 0:
            raise LimitError(f"seed must be 0 or more, got {self.seed}", code=2, parameter="seed")

    @classmethod
    def exact(cls, task: ReachTask | None = None, *, seed: int = 0) -> Recipe:
        """Exactly the paper's reward, without action costs; robots with roughly known data."""
        settings = ppo.PpoSettings(action_cost=0.0)
        return cls(task or ReachTask(), seed=seed, randomisation=MILD, settings=settings)

    @classmethod
    def of(cls, task: Task, *, seed: int = 0) -> Recipe:
        """The settings that suit a task."""
        if isinstance(task, ContactTask):
            taught = TAUGHT if task.has_teacher else 0
            return cls(task, taught=taught, seed=seed, randomisation=LATE, settings=CONTACT_SETTINGS)
        return cls(task, seed=seed)

    def as_dict(self) -> dict[str, Any]:
        """For a file."""
        return {**asdict(self), "task": self.task.as_dict()}

    @classmethod
    def from_dict(cls, entries: dict[str, Any]) -> Recipe:
        """Of `as_dict`, also of an older version."""
        given = dict(entries)
        given["task"] = task_from_dict(given["task"])
        given["randomisation"] = Randomisation(**{k: _tuple(v) for k, v in given["randomisation"].items()})
        given["settings"] = ppo.PpoSettings(
            **{_OLDER.get(k, k): _tuple(v) for k, v in given["settings"].items()}
        )
        return cls(**given)


def _tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
