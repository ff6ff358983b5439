"""`heptarm rl`: trains a policy, looks how good it is, and lets it drive an arm."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from heptarm.arm.connect import connect
from heptarm.cli.output import confirm, emit
from heptarm.errors import CommandRejected, NotReady, require
from heptarm.rl.deploy import Settings, Target, circle, deploy
from heptarm.rl.policy import Policy, shipped
from heptarm.rl.report import Report
from heptarm.values.mode import JointImpedance

if TYPE_CHECKING:
    from heptarm.rl.train import Row


def train(
    *,
    out: Path,
    robot: str,
    action: str,
    feature: bool,
    exact: bool,
    steps: int,
    seed: int,
    resume: bool,
    device: str,
    engine: str,
    as_json: bool,
) -> int:
    """Train a policy; returns the exit code.

    Raises:
        HeptarmError: arguments that do not go together, nothing to resume, or a missing extra.
    """
    require("torch", extra="rl")
    from heptarm.rl.task import ReachTask
    from heptarm.rl.train import Recipe
    from heptarm.rl.train import train as work

    task = ReachTask(robot, action=action, feature="kinematic" if feature else "")
    recipe = Recipe.exact(task, seed=seed) if exact else Recipe(task, seed=seed)
    recipe = replace(recipe, steps=steps) if steps else recipe
    budget = recipe.steps

    def show(row: Row) -> None:
        if as_json:
            emit(
                {"steps": row.steps, "seconds": row.seconds, "distance": row.distance, "success": row.success}
            )
            return
        share = min(1.0, row.steps / budget)
        bar = "#" * round(30 * share)
        print(
            f"\r[{bar:<30}] {row.steps / 1e6:5.2f} M steps  {row.seconds:5.0f} s  "
            f"{1e3 * row.distance:6.1f} mm at the end of noisy episodes",
            end="",
            file=sys.stderr,
            flush=True,
        )

    trained = work(
        None if resume else recipe,
        out=out,
        progress=show,
        resume=out if resume else None,
        steps=steps if resume and steps else None,
        device=device,
        engine=_engine(engine),
    )
    curve = trained.plot(out.with_suffix(".png"))
    told = {"policy": str(out), "curve": str(curve), "steps": trained.steps, "seconds": trained.seconds}
    if as_json:
        emit(told)
    else:
        print(f"\n{trained.steps} steps in {trained.seconds:.0f} s; policy {out}, learning curve {curve}")
    return 0


def _engine(name: str) -> Any:
    """The class of a simulation's engine by its name."""
    if name == "mujoco":
        from heptarm.rl.batch import Engine

        return Engine
    if name == "warp":
        from heptarm.rl.warp import WarpEngine

        return WarpEngine
    from heptarm.rl.plant import PlantEngine

    return PlantEngine


def evaluate(
    *,
    policy: Path | None,
    episodes: int,
    seed: int,
    randomisation: str,
    engine: str,
    out: Path | None,
    as_json: bool,
) -> int:
    """Run a policy in simulation on targets that training never saw; returns the exit code.

    Raises:
        HeptarmError: no such policy, or a missing extra.
    """
    from heptarm.rl.evaluate import evaluate as work
    from heptarm.rl.randomise import level

    report = work(
        _brain(policy), episodes, randomisation=level(randomisation), seed=seed, engine=_engine(engine)
    )
    return _tell(report, out, film=False, as_json=as_json)


def drive(
    *,
    policy: Path | None,
    at: tuple[tuple[float, float, float], ...],
    random: int,
    ask: bool,
    follow: bool,
    seed: int,
    stiffness: float | None,
    latency: float,
    speed: float,
    out: Path | None,
    film: bool,
    yes: bool,
    target: str | None,
    as_json: bool,
) -> int:
    """Let a policy drive an arm; returns the exit code.

    Raises:
        HeptarmError: refused, or ended under way.
    """
    brain = _brain(policy)
    settings = Settings(
        mode=None if stiffness is None else JointImpedance(stiffness), latency=latency, speed=speed
    )
    with connect(target) as arm:
        if not (arm.is_virtual or yes or confirm(f"Let the policy drive the real {arm.robot.title}?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        if ask:
            return _ask(arm, brain, settings)
        targets = _targets(brain, at, random, follow, seed)

        def show(number: int, distance: float) -> None:
            if not as_json:
                print(f"{number + 1:4d} of {len(targets)}: {1e3 * distance:6.1f} mm", file=sys.stderr)

        report = deploy(arm, brain, targets, settings=settings, progress=show)
    return _tell(report, out, film=film, as_json=as_json)


def _brain(file: Path | None) -> Policy:
    return shipped() if file is None else Policy.load(file)


def _targets(
    brain: Policy, at: tuple[tuple[float, float, float], ...], random: int, follow: bool, seed: int
) -> list[Any]:
    if follow:
        moving: Target = circle(brain.task.centre, 0.12, period=6.0)
        return [moving]
    if at:
        return [np.array(point) for point in at]
    if random < 1:
        raise CommandRejected(
            f"random is {random}; at least 1 is wanted", parameter="random", hint="or give --at X Y Z"
        )
    return list(brain.task.targets(np.random.default_rng(seed), random))


def _ask(arm: Any, brain: Policy, settings: Settings) -> int:
    """Targets typed by the user, until an empty line."""
    print("target x y z [m], empty line to end; the box is around", brain.task.centre, file=sys.stderr)
    while line := sys.stdin.readline().strip():
        try:
            point = [float(word) for word in line.replace(",", " ").split()]
            report = deploy(arm, brain, [np.array(point)], settings=settings)
        except (ValueError, CommandRejected) as error:  # a slip of the user's does not end the session
            print(f"heptarm: {error}", file=sys.stderr)
            continue
        print(f"{1e3 * report.mean:.1f} mm from {point} at the end")
    return 0


def _tell(report: Report, out: Path | None, *, film: bool, as_json: bool) -> int:
    if out is not None:
        files = [report.save(out.with_suffix(".npz")), report.save(out.with_suffix(".json"))]
        files.append(report.plot(out.with_suffix(".png")))
        if film:
            from heptarm.rl.film import film as draw

            files.append(draw(report, out.with_suffix(".gif")))
        if not as_json:
            print("written:", ", ".join(map(str, files)), file=sys.stderr)
    emit(report.as_dict()) if as_json else print(report.summary())
    return 0
