"""What `heptarm rl` does many times: train a policy, evaluate one, record episodes of a script."""

from __future__ import annotations

import runpy
import shutil
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.connect import connect
from heptarm.arm.link.target import parse_target
from heptarm.errors import CommandRejected, HeptarmError, require
from heptarm.record.episodes import Episode, Label
from heptarm.rl.evaluate import evaluate
from heptarm.rl.policy import Policy
from heptarm.rl.pool import Job
from heptarm.rl.report import EpisodeReport
from heptarm.rl.sim.batch import Engine
from heptarm.rl.sim.randomisation import NONE, Randomisation
from heptarm.rl.tasks import Task
from heptarm.values.camera import Camera
from heptarm.values.files import unreadable

if TYPE_CHECKING:
    from heptarm.rl.train.recipe import Recipe
    from heptarm.rl.train.train import Trained

#: Unseen targets on which a trained policy is evaluated.
EPISODES = 200
#: Silence after which the cabinet counts a worker as lost: all processors are busy [s].
_WATCHDOG = 5.0


# ---------------------------------------------------------------------------------------- trainings and evaluations


@dataclass(frozen=True, slots=True)
class TrainJob(Job["tuple[Trained, EpisodeReport]"]):
    """Train a policy, and evaluate it on `EPISODES` unseen targets; returns the training and the report. Needs torch.

    A job whose worker is lost goes on from its last checkpoint, if it is run again on the same machine.

    Attributes:
        recipe: what to train.
        device: where the networks learn.
        engine: class of the simulation's engine.
        key: names the folder of its checkpoints, in the worker's folder of temporary files.
    """

    recipe: Recipe
    _: KW_ONLY
    device: str = "cpu"
    engine: Any = Engine
    key: str = field(default_factory=lambda: uuid4().hex, compare=False)

    @property
    def gpus(self) -> int:
        """One for networks that learn on it."""
        return int(self.device != "cpu")

    def run(self) -> tuple[Trained, EpisodeReport]:
        """Train and evaluate."""
        training = require("heptarm.rl.train.train", extra="rl")
        folder = Path(gettempdir()) / f"heptarm-training-{self.key}"
        out = folder / "policy.npz"
        try:
            folder.mkdir(mode=0o700, exist_ok=True)
            trained = training.train(
                self.recipe,
                out=out,
                resume=out if training.beside(out).exists() else None,
                device=self.device,
                engine=self.engine,
                threads=1,
                overwrite=True,
            )
        finally:  # a worker that is killed leaves it
            shutil.rmtree(folder, ignore_errors=True)
        return trained, evaluate(trained.policy, EPISODES, threads=1)


@dataclass(frozen=True, slots=True)
class EvaluateJob(Job[EpisodeReport]):
    """Evaluate a policy, see `heptarm.rl.evaluate.evaluate`.

    Attributes:
        policy: the policy.
        episodes: number of unseen targets.
        task: the task; None: the policy's.
        seed: of targets and starts.
        randomisation: of the simulated robots.
        engine: class of the simulation's engine.
    """

    policy: Policy[Any]
    episodes: int
    _: KW_ONLY
    task: Task | None = None
    seed: int = 0
    randomisation: Randomisation = NONE
    engine: Any = Engine

    def run(self) -> EpisodeReport:
        """Evaluate."""
        return evaluate(
            self.policy,
            self.episodes,
            task=self.task,
            randomisation=self.randomisation,
            seed=self.seed,
            threads=1,
            engine=self.engine,
        )


# ---------------------------------------------------------------------------------------- episodes of a script


@dataclass(frozen=True, slots=True)
class Script:
    """A scripted task on a virtual arm.

    Attributes:
        demonstrate: does it once, with random numbers of the episode; returns whether it succeeded, None: unknown.
        reset: brings arm and scene to the start, before the recording; None: nothing is to be done.
    """

    demonstrate: Callable[[Arm, np.random.Generator], bool | None]
    reset: Callable[[Arm, np.random.Generator], object] | None = None

    @classmethod
    def load(cls, path: Path) -> Script:
        """Read the functions `demonstrate(arm, random)` and, if it has one, `reset(arm, random)` of a Python file.

        Raises:
            CommandRejected: it cannot be read, or has no such function.
        """
        try:
            names = runpy.run_path(str(path))
        except (Exception, SystemExit) as error:  # of anybody's file
            raise unreadable(
                path, f"{type(error).__name__}: {error}", what="a script", name="script"
            ) from error
        if not callable(names.get("demonstrate")):
            raise unreadable(
                path,
                "it has no function `demonstrate`",
                what="a script",
                name="script",
                hint="define `def demonstrate(arm, random): ...`, which returns whether it succeeded",
            )
        return cls(names["demonstrate"], names.get("reset"))


@dataclass(frozen=True, slots=True)
class RecordedEpisode:
    """An episode of a script.

    Attributes:
        number: in its set.
        label: as in its file.
        content: the file, MCAP.
    """

    number: int
    label: Label
    content: bytes = field(repr=False)


@dataclass(frozen=True, slots=True)
class RecordedEpisodes:
    """What a job has recorded.

    Attributes:
        episodes: all that were finished.
        error: why the others of the job were not recorded; "": there are no others.
    """

    episodes: tuple[RecordedEpisode, ...]
    error: str = ""


@dataclass(frozen=True, slots=True)
class RecordJob(Job[RecordedEpisodes]):
    """Record episodes of a script on a virtual arm of their own; returns their files.

    The random numbers of an episode depend on seed and number alone, not on the job that records it.

    Attributes:
        script: the task.
        target: a private simulator, such as "sim://iiwa14?scene=bins".
        numbers: of the episodes.
        seed: of the random numbers.
        rate: steps per second of an episode [Hz].
        task: what is done, in words.
        cameras: simulated ones by their names.

    Raises:
        CommandRejected: the target is no private simulator.
    """

    script: Script
    target: str
    numbers: tuple[int, ...]
    _: KW_ONLY
    seed: int = 0
    rate: float = 20.0
    task: str = ""
    cameras: Mapping[str, Camera] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not parse_target(self.target).is_private:
            raise CommandRejected(
                f"target must be a private simulator, got {self.target}",
                parameter="target",
                value=self.target,
                hint="each worker starts its own: sim://iiwa14, or sim://iiwa14?scene=bins",
            )

    def run(self) -> RecordedEpisodes:
        """Record them, one after the other; an error leaves those before it."""
        recorded: list[RecordedEpisode] = []
        try:
            self._record(recorded)
        except Exception as error:  # the script's own may be any
            if not recorded:
                raise
            return RecordedEpisodes(tuple(recorded), f"{type(error).__name__}: {error}")
        return RecordedEpisodes(tuple(recorded))

    def _record(self, recorded: list[RecordedEpisode]) -> None:
        script, random = self.script, np.random.default_rng()

        def reset() -> None:
            if script.reset is not None:
                script.reset(arm, random)

        with (
            TemporaryDirectory(prefix="heptarm-episodes-") as folder,
            connect(self.target, watchdog=_WATCHDOG) as arm,
            arm.episodes(
                folder, rate=self.rate, task=self.task, cameras=self.cameras, reset=reset
            ) as episodes,
        ):
            for number in self.numbers:
                random = np.random.default_rng([self.seed, number])
                episode = episodes.episode(number=number)
                self._demonstrate(arm, episode, random)
                recorded.append(RecordedEpisode(number, episode.label, episode.path.read_bytes()))

    def _demonstrate(self, arm: Arm, episode: Episode, random: np.random.Generator) -> None:
        """Record an episode; an error of the task makes it a failure, as its label has it, and no more."""
        try:
            with episode:
                succeeded = self.script.demonstrate(arm, random)
                if succeeded is not None:
                    episode.succeed() if succeeded else episode.fail("the script reports a failure")
        except HeptarmError:
            if not episode.path.is_file():  # the reset failed, or nothing could be recorded
                raise
