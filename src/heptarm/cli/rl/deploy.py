"""`heptarm rl deploy`: lets a policy control an arm, and compares what became of it with the simulator."""

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

from heptarm.cli.options import NO_TARGET, CommandTarget, Json, Overwrite, Speed, Yes
from heptarm.cli.output import confirm
from heptarm.cli.rl.options import LARGEST_SEED, POLICY, Seed
from heptarm.cli.rl.reports import refuse_reports, write_report
from heptarm.errors import CommandRejected, HeptarmError, NotReady
from heptarm.rl import deploy as deployment
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.contact.task import ContactTask
from heptarm.rl.deploy import DeploySettings, circle
from heptarm.rl.deploy_contact import ContactSettings, check_contact, deploy_contact
from heptarm.rl.policy import Policy, policy_named
from heptarm.rl.report import EpisodeReport
from heptarm.rl.station import held_peg
from heptarm.rl.task import ReachTask
from heptarm.rl.tasks import deployed_task
from heptarm.values.checks import array, integer, within
from heptarm.values.files import refuse_existing
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.pose import Pose
from heptarm.values.tool import HEAVIEST, Tool

if TYPE_CHECKING:
    from heptarm.arm.arm import Arm

#: The scene in which the peg is fetched.
_SCENE = "peg-in-hole"
#: The farthest end of what the flange holds [m].
_FARTHEST = 2.0


def deploy(
    policy: Annotated[Path | None, Parameter(help=POLICY)] = None,
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
    seconds: Annotated[
        float | None,
        Parameter(
            help="With contacts: an episode ends after so long [s]. Default: after twice as long as in training."
        ),
    ] = None,
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
    integer(seed, "--seed", 0, LARGEST_SEED)
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
        place = _Place(at, random, seed, tip, mass, latency, through, seconds, speed)
        place.check(network.task, target)
        return _insert(
            network, place, out=out, overwrite=overwrite, yes=yes, twin=twin, target=target, as_json=as_json
        )
    if tip is not None or mass or through != "servo" or seconds is not None:
        raise CommandRejected(
            "--tip, --mass, --through and --seconds are of policies with contacts",
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
    refuse_reports(out, overwrite=overwrite, film=film)
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
        arm.speed = min(arm.speed, speed)
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
    return write_report(report, out, film=film, overwrite=overwrite, as_json=as_json)


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
    seconds: float | None
    speed: float

    def __post_init__(self) -> None:
        if self.tip is not None:
            within(self.tip, "--tip", 0.0, _FARTHEST, above=True, unit="m")
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
        return ContactSettings(frame=frame, through=self.through, latency=self.latency, seconds=self.seconds)

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
    refuse_reports(out, overwrite=overwrite, film=False)
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
    return write_report(report, out, film=False, overwrite=overwrite, as_json=as_json)


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
