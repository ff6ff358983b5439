"""`heptarm rl train` and `eval`: trains a policy, and evaluates it in simulation."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from heptarm.cli.options import Json, Model, Overwrite
from heptarm.cli.output import emit
from heptarm.cli.rl.jobs import HERE, JobOptions, Seeds, Sweeps, cases_of, name_of
from heptarm.cli.rl.options import LARGEST_SEED, POLICY, Seed
from heptarm.cli.rl.reports import refuse_reports, write_report
from heptarm.errors import CommandRejected, require
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.policy import Policy, policy_named
from heptarm.rl.pool import Job
from heptarm.rl.report import EpisodeReport
from heptarm.rl.sweep import with_setting, with_settings
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import task_named
from heptarm.values.checks import integer
from heptarm.values.files import refuse_existing, writable_file
from heptarm.values.fitted_arm import load_fitted

if TYPE_CHECKING:
    from heptarm.rl.jobs import EvaluateJob
    from heptarm.rl.tasks import Task
    from heptarm.rl.train.recipe import Recipe
    from heptarm.rl.train.train import Row

Randomisation = Annotated[
    Literal["none", "mild", "strong"],
    Parameter(help="How much simulated robots differ; with contacts: latency and bandwidth."),
]
Engine = Annotated[
    Literal["mujoco", "warp", "plant"],
    Parameter(
        help="Simulation: MuJoCo on the CPU, MuJoCo Warp on a GPU, or the virtual cabinet's own plant."
    ),
]
#: Most episodes.
_EPISODES = 1_000_000


def train(
    task: Annotated[
        str, Parameter(help="What is learned: reach, or a task with contacts such as peg-in-hole.")
    ] = "reach",
    /,
    *,
    out: Annotated[Path | None, Parameter(help="File of the policy, .npz. Default: TASK.npz.")] = None,
    robot: Model = "iiwa14",
    action: Annotated[Literal["joint", "cartesian"], Parameter(help="What the policy decides.")] = "joint",
    feature: Annotated[
        bool, Parameter(negative="", help="Let the policy also observe the direction to the target.")
    ] = False,
    exact: Annotated[
        bool, Parameter(negative="", help="Exactly the paper's reward: no costs for robustness.")
    ] = False,
    steps: Annotated[
        int,
        Parameter(help="Environment steps; 0: 2.2 million, 1.3 with the feature, 1.5 with contacts."),
    ] = 0,
    seed: Seed = 0,
    fitted: Annotated[
        Path | None,
        Parameter(
            help="File of heptarm calibrate arm: delay and load vary about those of your arm. Default: assumed ones."
        ),
    ] = None,
    resume: Annotated[bool, Parameter(negative="", help="Resume the training of --out.")] = False,
    device: Annotated[Literal["cpu", "cuda"], Parameter(help="Where the networks learn.")] = "cpu",
    engine: Engine = "mujoco",
    seeds: Seeds = "",
    sweep: Sweeps = (),
    jobs: JobOptions = HERE,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Train a policy; under torchrun, several workers train one.

    With several seeds or settings each is a job of its own, and evaluated on 200 targets that it has not seen:

        heptarm rl train --seeds 0..4

        heptarm rl train peg-in-hole --seeds 0..9 --sweep clearance=1e-3,5e-4 --ray auto
    """
    require("torch", extra="rl")
    from heptarm.rl.train.train import train as work

    if resume and fitted is not None:
        raise CommandRejected(
            "a resumed training keeps its ranges, so fitted has no effect",
            parameter="fitted",
            hint="leave it out",
        )
    chosen: Task
    if task == ReachTask.name:
        chosen = ReachTask(robot, action=action, feature="kinematic" if feature else "")
    else:
        if (action, feature, exact, engine) != ("joint", False, False, "mujoco"):
            raise CommandRejected(
                f"--action, --feature, --exact and --engine are of the reach task, not of {task}",
                parameter="task",
                value=task,
                hint="leave them out",
            )
        chosen = replace(task_named(task), robot=robot)
    out = out or Path(f"{task}.npz")
    if seeds or sweep or jobs != HERE:
        if resume:
            raise CommandRejected(
                "--resume is of one training", parameter="resume", hint="leave out --seeds, --sweep and --ray"
            )
        cases: list[tuple[dict[str, object], Recipe]] = []
        for number, settings in cases_of(seeds, seed, sweep):
            made = recipe_of(chosen, seed=number, steps=steps, fitted=fitted, is_exact=exact)
            cases.append(({"seed": number, **settings}, with_settings(made, settings)))
        return _train_jobs(
            cases, out, jobs, device=device, engine=engine, overwrite=overwrite, as_json=as_json
        )
    recipe = recipe_of(chosen, seed=seed, steps=steps, fitted=fitted, is_exact=exact)
    budget, left = recipe.steps, "away" if task == ReachTask.name else "missing"

    def show(row: Row) -> None:
        if as_json:
            emit(
                {"steps": row.steps, "seconds": row.seconds, "distance": row.distance, "success": row.success}
            )
            return
        done = min(1.0, row.steps / budget)
        bar = "#" * round(30 * done)
        print(
            f"\r[{bar:<30}] {row.steps / 1e6:5.2f} M steps  {row.seconds:5.0f} s  "
            f"{1e3 * row.distance:6.1f} mm {left} at the end of noisy episodes",
            end="",
            file=sys.stderr,
            flush=True,
        )

    curve_file = out.with_suffix(".png")
    refuse_existing(curve_file, overwrite=overwrite or resume, name="out")
    trained = work(
        None if resume else recipe,
        out=out,
        progress=show,
        resume=out if resume else None,
        steps=steps if resume and steps else None,
        device=device,
        engine=_engine(engine),
        overwrite=overwrite,
    )
    curve = trained.plot(curve_file, overwrite=True)  # refused above; each worker draws the same
    report = {"policy": str(out), "curve": str(curve), "steps": trained.steps, "seconds": trained.seconds}
    if as_json:
        emit(report)
    else:
        print(f"\n{trained.steps} steps in {trained.seconds:.0f} s; policy {out}, learning curve {curve}")
    return 0


def _train_jobs(
    cases: list[tuple[dict[str, object], Recipe]],
    out: Path,
    jobs: JobOptions,
    *,
    device: str,
    engine: str,
    overwrite: bool,
    as_json: bool,
) -> int:
    """Train several policies; each gets a file of its own, and all of them one table."""
    from heptarm.rl.jobs import TrainJob

    made = [
        (case, TrainJob(name_of(case), recipe, device=device, engine=_engine(engine)))
        for case, recipe in cases
    ]
    files = {
        job.name: out.with_name(f"{out.stem}-{job.name.replace('=', '').replace(' ', '-')}.npz")
        for _, job in made
    }
    table = writable_file(out.with_suffix(".csv"), overwrite=overwrite, name="out")
    for file in (*files.values(), *(path.with_suffix(".png") for path in files.values())):
        refuse_existing(file, overwrite=overwrite, name="out")

    def figures(job: Job[Any], value: Any) -> dict[str, object]:
        (trained, report), file = value, files[job.name]
        trained.policy.save(file, overwrite=overwrite)
        trained.plot(file.with_suffix(".png"), overwrite=overwrite)
        return {"file": str(file), "steps": trained.steps, **_figures(report)}

    return jobs.run(made, figures, table=table, as_json=as_json)


def _figures(report: EpisodeReport) -> dict[str, object]:
    """What a row of a table has of a report."""
    names = ["success_rate", "mean", "p95", "time_to_reach"]
    if report.peak_force.any():
        names.append("peak_force")
    entries = report.as_dict()
    return {name: entries[name] for name in names}


def recipe_of(task: Task, *, seed: int, steps: int, fitted: Path | None, is_exact: bool = False) -> Recipe:
    """The recipe of a training; `fitted`: its arms vary about this one.

    Raises:
        CommandRejected: the file of the fitted arm cannot be read.
    """
    from heptarm.rl.sim.randomisation import Randomisation
    from heptarm.rl.train.recipe import Recipe

    recipe = (
        Recipe.exact(task, seed=seed)
        if is_exact and isinstance(task, ReachTask)
        else Recipe.of(task, seed=seed)
    )
    if fitted is not None:
        ranges = Randomisation.of_arm(load_fitted(fitted), period=1.0 / task.rate, base=recipe.randomisation)
        recipe = replace(recipe, randomisation=ranges)
    return replace(recipe, steps=steps) if steps else recipe


def _engine(name: str) -> Any:
    """The class of a simulation's engine by its name."""
    if name == "mujoco":
        from heptarm.rl.sim.batch import Engine

        return Engine
    if name == "warp":
        from heptarm.rl.sim.warp_engine import WarpEngine

        return WarpEngine
    from heptarm.rl.sim.plant_engine import PlantEngine

    return PlantEngine


def evaluate(
    *policies: Annotated[Path, Parameter(help=POLICY + " Default: reach.")],
    episodes: Annotated[int, Parameter(help="Targets, none of them seen in training.")] = 1000,
    seed: Seed = 0,
    randomisation: Randomisation = "none",
    engine: Engine = "mujoco",
    out: Annotated[
        Path | None,
        Parameter(
            help="Write report, recording and plot under this name; of several evaluations their table."
        ),
    ] = None,
    seeds: Seeds = "",
    sweep: Sweeps = (),
    jobs: JobOptions = HERE,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> int:
    """Evaluate a policy in simulation.

    With several policies, seeds or settings each evaluation is a job of its own:

        heptarm rl eval peg-in-hole mine.npz --seeds 0..9 --episodes 200 --sweep clearance=5e-4,2e-4
    """
    integer(episodes, "--episodes", 1, _EPISODES)
    integer(seed, "--seed", 0, LARGEST_SEED)
    if len(policies) > 1 or seeds or sweep or jobs != HERE:
        table = (
            None if out is None else writable_file(out.with_suffix(".csv"), overwrite=overwrite, name="out")
        )
        cases = [
            _evaluation(
                str(policy), {"seed": number, "randomisation": randomisation, **settings}, episodes, engine
            )
            for policy in policies or (ReachTask.name,)
            for number, settings in cases_of(seeds, seed, sweep)
        ]
        return jobs.run(cases, lambda _, report: _figures(report), table=table, as_json=as_json)
    from heptarm.rl.evaluate import evaluate as work

    refuse_reports(out, overwrite=overwrite, film=False)
    network = policy_named(policies[0] if policies else ReachTask.name)
    known = _randomisation(network, randomisation)
    report = work(network, episodes, randomisation=known, seed=seed, engine=_engine(engine))
    return write_report(report, out, film=False, overwrite=overwrite, as_json=as_json)


def _evaluation(
    policy: str, settings: dict[str, Any], episodes: int, engine: str
) -> tuple[dict[str, object], EvaluateJob]:
    """An evaluation as a job, and what distinguishes it."""
    from heptarm.rl.jobs import EvaluateJob

    network = policy_named(policy)
    task = network.task
    for name, value in settings.items():
        if name not in ("seed", "randomisation"):
            task = with_setting(task, name, value)
    case = {"policy": policy, **settings}
    return case, EvaluateJob(
        name_of(case),
        network,
        episodes,
        task=task,
        seed=settings["seed"],
        randomisation=_randomisation(network, settings["randomisation"]),
        engine=_engine(engine),
    )


def _randomisation(network: Policy[Any], name: str) -> Any:
    """A level of randomisation as far as it concerns the task of a policy."""
    from heptarm.rl.sim.randomisation import level

    return level(name).of_servo() if isinstance(network.task, ContactTask) else level(name)
