"""`heptarm rl`: trains a policy, evaluates it in simulation, and deploys it on an arm."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from cyclopts import Parameter

from heptarm.cli.options import (
    NO_TARGET,
    CommandTarget,
    Json,
    Model,
    Overwrite,
    Speed,
    Yes,
)
from heptarm.cli.output import confirm, emit
from heptarm.cli.rl.jobs import HERE, JobOptions, Seeds, Sweeps, cases_of, name_of
from heptarm.errors import CommandRejected, HeptarmError, NotReady, require
from heptarm.rl import deploy as deployment
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.deploy import DeploySettings, circle
from heptarm.rl.deploy_contact import ContactSettings, check_contact, deploy_contact
from heptarm.rl.policy import Policy, policy_named
from heptarm.rl.pool import Job
from heptarm.rl.report import EpisodeReport
from heptarm.rl.station import held_peg
from heptarm.rl.sweep import with_setting, with_settings
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import deployed_task, task_named
from heptarm.values.checks import array, integer, within
from heptarm.values.files import refuse_existing
from heptarm.values.fitted_arm import load_fitted
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.pose import Pose
from heptarm.values.tool import HEAVIEST, Tool

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm
    from heptarm.rl.jobs import EvaluateJob
    from heptarm.rl.tasks import Task
    from heptarm.rl.train.recipe import Recipe
    from heptarm.rl.train.train import Row

Seed = Annotated[int, Parameter(help="Seed of all random numbers.")]
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
_POLICY = "File of the policy, .npz, or a task whose policy comes with heptarm, such as reach or peg-in-hole."
#: Largest seed, most episodes, longest of what the flange holds [m].
_SEEDS, _EPISODES, _LONGEST = 2**63 - 1, 1_000_000, 2.0
#: The scene in which the peg is fetched.
_SCENE = "peg-in-hole"
AnyPolicy = Annotated[Path | None, Parameter(help=_POLICY)]


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
    table = out.with_suffix(".csv")
    for file in (table, *files.values(), *(path.with_suffix(".png") for path in files.values())):
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
    *policies: Annotated[Path, Parameter(help=_POLICY + " Default: reach.")],
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
    integer(seed, "--seed", 0, _SEEDS)
    if len(policies) > 1 or seeds or sweep or jobs != HERE:
        table = (
            None if out is None else refuse_existing(out.with_suffix(".csv"), overwrite=overwrite, name="out")
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

    _refuse_reports(out, overwrite=overwrite, film=False)
    network = policy_named(policies[0] if policies else ReachTask.name)
    known = _randomisation(network, randomisation)
    report = work(network, episodes, randomisation=known, seed=seed, engine=_engine(engine))
    return _report(report, out, film=False, overwrite=overwrite, as_json=as_json)


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


def deploy(
    policy: AnyPolicy = None,
    /,
    *,
    at: Annotated[
        tuple[tuple[float, float, float], ...],
        Parameter(help="A target x y z [m], base frame; may be repeated."),
    ] = (),
    random: Annotated[int, Parameter(help="Without --at: so many random targets.")] = 5,
    ask: Annotated[bool, Parameter(negative="", help="Read targets from standard input.")] = False,
    follow: Annotated[bool, Parameter(negative="", help="Follow a target that moves on a circle.")] = False,
    seed: Seed = 0,
    stiffness: Annotated[
        float | None, Parameter(help="Joint impedance [Nm/rad] instead of position control.")
    ] = None,
    tip: Annotated[
        float | None,
        Parameter(
            help="With contacts and --at: what is held ends so far in front of the flange [m]. "
            "Default: the peg of the scene peg-in-hole is fetched."
        ),
    ] = None,
    mass: Annotated[float, Parameter(help="With --tip: mass of what is on the flange [kg].")] = 0.0,
    through: Annotated[
        Literal["servo", "fri"],
        Parameter(
            help="With contacts: set-points of the cabinet's impedance, or torques of a law over FRI at 500 Hz."
        ),
    ] = "servo",
    latency: Annotated[float, Parameter(help="Delay between observation and command [s].")] = 0.0,
    speed: Speed = 0.5,
    twin: Annotated[
        str,
        Parameter(
            help="The simulator that carries out the recording once more, for comparison: sim://MODEL?OPTION=VALUE, "
            "sim://HOST:PORT, or none. Default: one with the options of --target, if that is a private one; otherwise "
            "one of its robot."
        ),
    ] = "",
    out: Annotated[Path | None, Parameter(help="Write report, recording and plot under this name.")] = None,
    film: Annotated[
        bool, Parameter(negative="", help="With --out: also a film of the first episodes.")
    ] = False,
    overwrite: Overwrite = False,
    yes: Yes = False,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Let a policy control an arm with a servo motion; needs no torch.

    A policy with contacts inserts --random times, the hole presumed wrongly each time, on a virtual cabinet with the
    scene peg-in-hole; or once at each --at. A recording is written in any case, and compared with the simulator, which
    takes as long as the deployment: --twin none does without.
    """
    within(speed, "--speed", 0.0, 1.0, above=True)
    integer(seed, "--seed", 0, _SEEDS)
    _check_twin(twin)
    network = policy_named(policy or ReachTask.name)
    if isinstance(network.task, ContactTask):
        if ask or follow or film or stiffness is not None:
            raise CommandRejected(
                f"--ask, --follow, --film and --stiffness are of the reach task, not of {network.task.name}",
                parameter="policy",
                value=network.task.name,
                hint="leave them out",
            )
        place = _Place(at, random, seed, tip, mass, latency, through, speed)
        place.check(network.task, target)
        return _insert(
            network, place, out=out, overwrite=overwrite, yes=yes, twin=twin, target=target, as_json=as_json
        )
    if tip is not None or mass or through != "servo":
        raise CommandRejected(
            "--tip, --mass and --through are of policies with contacts",
            parameter="tip",
            hint="leave them out",
        )
    chosen = [name for name, given in (("--at", at), ("--ask", ask), ("--follow", follow)) if given]
    if len(chosen) > 1:
        raise CommandRejected(
            f"{' and '.join(chosen)} must not be given together",
            parameter=chosen[-1].removeprefix("--"),
            hint="each of them chooses the targets: give one",
        )
    _refuse_reports(out, overwrite=overwrite, film=film)
    recording = _recording(network, out, overwrite=overwrite)
    settings = DeploySettings(
        mode=None if stiffness is None else JointImpedance(stiffness), latency=latency, speed=speed
    )
    targets = [] if ask else _targets(network, at, random, follow, seed)
    if at:
        for point in targets:
            settings.guard.check(point)
    with target.connect() as arm:
        deployed_task(network.task, ReachTask, arm.robot)
        if not (arm.is_virtual or yes or confirm(f"Let the policy control the real {arm.robot.title}?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        if ask:
            with arm.record(recording, overwrite=overwrite):
                return _ask(arm, network, settings)

        def show(number: int, distance: float) -> None:
            if not as_json:
                print(f"{number + 1:4d} of {len(targets)}: {1e3 * distance:6.1f} mm", file=sys.stderr)

        with arm.record(recording, overwrite=overwrite):
            report = deployment.deploy(arm, network, targets, settings=settings, progress=show)
    report = _compared(report, recording, twin, target, as_json=as_json)
    return _report(report, out, film=film, overwrite=overwrite, as_json=as_json)


def _recording(network: Policy[Any], out: Path | None, *, overwrite: bool) -> Path:
    """The file of a deployment's recording, under the name of its report or of its time."""
    name = out or Path(f"{network.task.name}-{datetime.now():%Y%m%d-%H%M%S}")
    return refuse_existing(name.with_suffix(".mcap"), overwrite=overwrite, name="out")


def _check_twin(twin: str) -> None:
    """Refuse a simulator for the comparison that is none.

    Raises:
        CommandRejected: neither empty, nor "none", nor a simulator.
        ConnectFailed: a simulator that is none.
    """
    from heptarm.arm.link.target import parse_target

    if twin in ("", "none"):
        return
    if not twin.startswith("sim://"):
        raise CommandRejected(
            f"--twin must be none or a simulator, sim://..., got {twin!r}",
            parameter="twin",
            value=twin,
            hint="for example sim://iiwa14",
        )
    parse_target(twin)


def _compared(
    report: EpisodeReport, recording: Path, twin: str, target: CommandTarget, *, as_json: bool
) -> EpisodeReport:
    """The report with what became of the recording in the simulator."""
    if twin == "none":
        return report
    from heptarm.arm.link.target import parse_target, target_from_env
    from heptarm.twin.replay import replay_in_sim

    given = target.text or target_from_env()
    is_like = given.startswith("sim://") and parse_target(given).is_private
    simulator = twin or (given if is_like else None)
    facts: dict[str, Any]
    try:
        found = replay_in_sim(recording, target=simulator)
    except HeptarmError as error:  # the deployment and its report count all the same
        print(f"heptarm: no comparison with the simulator: {error}", file=sys.stderr)
        return replace(
            report, facts={**report.facts, "recording": str(recording), "twin": {"refusal": error.text}}
        )
    if not as_json:
        print(found, file=sys.stderr)
    facts = {
        "alike": found.is_alike,
        "parts_s": None if isnan(found.parts) else found.parts,
        "largest": {deviation.signal: deviation.largest for deviation in found.deviations},
        "notes": list(found.notes),
    }
    return replace(report, facts={**report.facts, "recording": str(recording), "twin": facts})


@dataclass(frozen=True, slots=True)
class _Place:
    """Where a policy with contacts is deployed, see `deploy`."""

    at: tuple[tuple[float, float, float], ...]
    random: int
    seed: int
    tip: float | None
    mass: float
    latency: float
    through: str
    speed: float

    def __post_init__(self) -> None:
        if self.tip is not None:
            within(self.tip, "--tip", 0.0, _LONGEST, above=True, unit="m")
        for point in self.at:
            array(point, 3, "--at")
        within(self.mass, "--mass", 0.0, HEAVIEST, unit="kg")
        if (self.tip is None) == bool(self.at):
            raise CommandRejected(
                "--at and --tip must be given together, or neither", parameter="tip", value=self.tip
            )
        if self.random < 1:
            raise CommandRejected(f"--random must be at least 1, got {self.random}", parameter="random")

    @property
    def settings(self) -> ContactSettings:
        """Those of the deployment on a real arm."""
        frame = "tip" if self.tip is None else "tool"
        return ContactSettings(frame=frame, through=self.through, latency=self.latency)

    def check(self, task: ContactTask, target: CommandTarget) -> None:
        """Refuse, before anything connects, what cannot be deployed.

        Raises:
            CommandRejected: the task needs what is not there, or the peg is to be fetched where none is.
            LimitError: the task needs a higher speed.
            ConnectFailed: the target is none.
        """
        from heptarm.arm.link.target import parse_target, target_from_env

        if self.tip is None and not isinstance(task, PegInHole):
            raise CommandRejected(
                f"--at and --tip must be given for the task {task.name}: no scene of it is shipped",
                parameter="at",
            )
        check_contact(task, self.settings, self.speed)
        given = parse_target(target.text or target_from_env())
        if (
            self.tip is None
            and given.is_private
            and Path(dict(given.options).get("scene", "")).stem != _SCENE
        ):
            options = "&".join(f"{name}={value}" for name, value in given.options if name != "scene")
            fitting = f"sim://{given.model}?scene={_SCENE}{'&' if options else ''}{options}"
            raise CommandRejected(
                f"the virtual arm must have the scene {_SCENE}, in which the peg is fetched, got {given}",
                parameter="target",
                value=str(given),
                hint=f"--target '{fitting}', or --at and --tip where something is held already",
            )

    @contextmanager
    def prepared(self, arm: Arm, task: ContactTask) -> Iterator[tuple[list[Pose], Any]]:
        """Origins and targets of the episodes, while the part is held."""
        if self.tip is not None:
            held = Tool("held", mass=self.mass, com=(0, 0, 0.5 * self.tip), tcp=Pose.at(0, 0, self.tip))
            with arm.tool(held):
                quat = arm.pose().quat
                origins = [Pose.of(place, quat) for place in self.at]
                yield origins, np.zeros((len(origins), len(task.targets(np.random.default_rng(0), 1)[0])))
            return
        with held_peg(arm) as hole:
            errors = task.targets(np.random.default_rng(self.seed), self.random)
            yield [PegInHole.presumed(hole, error) for error in errors], errors


def _insert(
    network: Policy[Any],
    place: _Place,
    *,
    out: Path | None,
    overwrite: bool,
    yes: bool,
    twin: str,
    target: CommandTarget,
    as_json: bool,
) -> int:
    """Deploy a policy with contacts, and record it."""
    recording = _recording(network, out, overwrite=overwrite)
    out = out or recording.with_suffix("")
    _refuse_reports(out, overwrite=overwrite, film=False)
    with target.connect() as arm:
        deployed_task(network.task, ContactTask, arm.robot)  # type: ignore[type-abstract]
        arm.speed = min(arm.speed, place.speed)
        check_contact(network.task, place.settings, arm.speed)
        if not (arm.is_virtual or yes or confirm(f"Let the policy control the real {arm.robot.title}?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")

        def show(number: int, missing: float) -> None:
            if not as_json:
                print(f"{number + 1:4d}: {1e3 * missing:6.1f} mm missing", file=sys.stderr)

        with (
            arm.record(recording, overwrite=overwrite),
            place.prepared(arm, network.task) as (origins, targets),
        ):
            report = deploy_contact(
                arm,
                network,
                origins,
                targets,
                settings=replace(place.settings, stale=2.0) if arm.is_virtual else place.settings,
                progress=show,
            )
    report = _compared(report, recording, twin, target, as_json=as_json)
    return _report(report, out, film=False, overwrite=overwrite, as_json=as_json)


def _targets(
    network: Policy[Any], at: tuple[tuple[float, float, float], ...], random: int, follow: bool, seed: int
) -> list[Any]:
    if follow:
        moving: deployment.Target = circle(network.task.centre, 0.12, period=6.0)
        return [moving]
    if at:
        return [np.array(point) for point in at]
    if random < 1:
        raise CommandRejected(
            f"--random must be at least 1, got {random}", parameter="random", hint="or give --at X Y Z"
        )
    return list(network.task.targets(np.random.default_rng(seed), random))


def _ask(arm: Any, network: Policy[Any], settings: DeploySettings) -> int:
    """Move to targets typed by the user, until an empty line."""
    print("target x y z [m], empty line to end; the box is around", network.task.centre, file=sys.stderr)
    while line := sys.stdin.readline().strip():
        try:
            point = [float(word) for word in line.replace(",", " ").split()]
            report = deployment.deploy(arm, network, [np.array(point)], settings=settings)
        except (ValueError, CommandRejected) as error:  # a typing error does not end the session
            print(f"heptarm: {error}", file=sys.stderr)
            continue
        print(f"{1e3 * report.mean:.1f} mm from {point} at the end")
    return 0


def _refuse_reports(out: Path | None, *, overwrite: bool, film: bool) -> None:
    """Refuse, before anything runs, a name under which there is a report."""
    if out is not None:
        for suffix in (".npz", ".json", ".png", *([".gif"] if film else [])):
            refuse_existing(out.with_suffix(suffix), overwrite=overwrite, name="out")


def _report(report: EpisodeReport, out: Path | None, *, film: bool, overwrite: bool, as_json: bool) -> int:
    if out is not None:
        files = [report.save(out.with_suffix(ending), overwrite=overwrite) for ending in (".npz", ".json")]
        files.append(report.plot(out.with_suffix(".png"), overwrite=overwrite))
        if film:
            from heptarm.rl.film import film as draw

            files.append(draw(report, out.with_suffix(".gif"), overwrite=overwrite))
        if not as_json:
            print("written:", ", ".join(map(str, files)), file=sys.stderr)
    emit(report.as_dict()) if as_json else print(report.summary())
    return 0
