"""`heptarm rl record`: episodes of a scripted task, on many virtual arms at once."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from heptarm.cli.options import Json
from heptarm.cli.rl.jobs import HERE, JobOptions
from heptarm.errors import CommandRejected
from heptarm.record.episodes import next_number
from heptarm.rl.jobs import RecordedEpisode, RecordJob, Script
from heptarm.rl.pool import Job
from heptarm.values.camera import Camera
from heptarm.values.checks import integer
from heptarm.values.files import make_folder
from heptarm.values.text import counted

#: Most episodes of a job: it starts a virtual cabinet, and is run again as a whole if its worker is lost.
_BATCH = 5


def record(
    script: Annotated[
        Path,
        Parameter(
            help="Python file with a function demonstrate(arm, random), and perhaps reset(arm, random)."
        ),
    ],
    folder: Annotated[
        Path, Parameter(help="Folder of the episodes, see heptarm episodes; it may have some.")
    ],
    /,
    *,
    episodes: Annotated[int, Parameter(help="Episodes to record.")] = 20,
    seed: Annotated[int, Parameter(help="Seed of all random numbers.")] = 0,
    rate: Annotated[float, Parameter(help="Steps per second of an episode [Hz].")] = 20.0,
    task: Annotated[str, Parameter(help="What is done, in words, for the episodes.")] = "",
    camera: Annotated[
        bool,
        Parameter(negative="", help="Record pictures of a simulated camera, 96 x 96, with each episode."),
    ] = False,
    target: Annotated[
        str,
        Parameter(
            help="Virtual arm that each worker starts: sim://iiwa14, or sim://iiwa14?scene=bins&speed=2."
        ),
    ] = "sim://iiwa14",
    jobs: JobOptions = HERE,
    as_json: Json = False,
) -> int:
    """Record episodes of a scripted task on virtual arms, many at once.

    The function demonstrate does the task once, with random numbers of the episode, and returns whether it succeeded.
    An episode is the same whichever worker records it. For example:

        heptarm rl record examples/learning/pick_place.py picked --episodes 40 --workers 2
    """
    found, first = Script.load(script), next_number(folder)
    last = first + integer(episodes, "episodes", 1, 100_000)
    cameras = {"scene": Camera(size=(96, 96), rate=min(60.0, rate))} if camera else {}
    numbers = [tuple(range(begin, min(begin + _BATCH, last))) for begin in range(first, last, _BATCH)]
    cases: list[tuple[Mapping[str, object], Job[Any]]] = []
    for part in numbers:
        case = {"episodes": f"{part[0]}..{part[-1]}"}
        job = RecordJob(
            f"episodes {part[0]}..{part[-1]}",
            found,
            target,
            part,
            seed=seed,
            rate=rate,
            task=task,
            cameras=cameras,
        )
        cases.append((case, job))
    make_folder(folder, name="folder")

    def figures(_: Job[Any], recorded: Any) -> dict[str, object]:
        for episode in recorded.episodes:
            _keep(folder, episode)
        if recorded.error:
            raise CommandRejected(
                f"recorded {counted(len(recorded.episodes), 'episode')}, then: {recorded.error}"
            )
        counts = Counter(episode.label for episode in recorded.episodes)
        return {label: counts[label] for label in ("success", "failure", "unlabelled")}

    return jobs.run(cases, figures, as_json=as_json)


def _keep(folder: Path, episode: RecordedEpisode) -> None:
    """Write an episode; one that another program has recorded under its number meanwhile stays."""
    number = episode.number
    half = folder / f"episode-{number:05d}-{os.getpid()}.part"
    try:
        half.write_bytes(episode.content)
        while True:
            file = folder / f"episode-{number:05d}.mcap"
            try:
                file.open("xb").close()  # takes the name
                break
            except FileExistsError:
                number = next_number(folder)
        half.replace(file)
    except OSError:  # a full disk leaves no half of an episode
        half.unlink(missing_ok=True)
        raise
