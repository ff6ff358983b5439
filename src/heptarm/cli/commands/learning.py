"""`heptarm rl`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.cli.app import Json, Speed, Target, Yes, rl_app

Seed = Annotated[int, Parameter(help="Of everything random.")]
Randomisation = Annotated[
    Literal["none", "mild", "strong"], Parameter(help="How much simulated robots differ.")
]
Engine = Annotated[
    Literal["mujoco", "warp", "plant"],
    Parameter(
        help="Simulation: MuJoCo on the CPU, MuJoCo Warp on a GPU, or the virtual cabinet's own plant."
    ),
]
PolicyFile = Annotated[Path, Parameter(help="File of the policy, .npz.")]
AnyPolicy = Annotated[
    Path | None, Parameter(help="File of the policy, .npz. Default: the one that comes with heptarm.")
]


@rl_app.command(name="train")
def rl_train(
    *,
    out: PolicyFile = Path("reach.npz"),
    robot: Annotated[Literal["iiwa7", "iiwa14"], Parameter(help="Robot.")] = "iiwa14",
    action: Annotated[Literal["joint", "cartesian"], Parameter(help="What the policy decides.")] = "joint",
    feature: Annotated[bool, Parameter(negative="", help="Let it see the way to the target, too.")] = False,
    exact: Annotated[
        bool, Parameter(negative="", help="The paper's reward to the letter: no costs for robustness.")
    ] = False,
    steps: Annotated[int, Parameter(help="Environment steps; 0: 2.2 million, 1.3 with the feature.")] = 0,
    seed: Seed = 0,
    resume: Annotated[bool, Parameter(negative="", help="Go on where --out left off.")] = False,
    device: Annotated[Literal["cpu", "cuda"], Parameter(help="Where the networks learn.")] = "cpu",
    engine: Engine = "mujoco",
    json: Json = False,
) -> int:
    """Train a policy; under torchrun, several workers train one."""
    from heptarm.cli import rl as work

    return work.train(
        out=out,
        robot=robot,
        action=action,
        feature=feature,
        exact=exact,
        steps=steps,
        seed=seed,
        resume=resume,
        device=device,
        engine=engine,
        as_json=json,
    )


@rl_app.command(name="eval")
def rl_eval(
    policy: AnyPolicy = None,
    /,
    *,
    episodes: Annotated[int, Parameter(help="Targets, none of them seen in training.")] = 1000,
    seed: Seed = 0,
    randomisation: Randomisation = "none",
    engine: Engine = "mujoco",
    out: Annotated[Path | None, Parameter(help="Write report, recording and plot under this name.")] = None,
    json: Json = False,
) -> int:
    """Run a policy in simulation and report how it went."""
    from heptarm.cli import rl as work

    return work.evaluate(
        policy=policy,
        episodes=episodes,
        seed=seed,
        randomisation=randomisation,
        engine=engine,
        out=out,
        as_json=json,
    )


@rl_app.command(name="deploy")
def rl_deploy(
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
    latency: Annotated[float, Parameter(help="Delay between seeing and commanding [s].")] = 0.0,
    speed: Speed = 0.5,
    out: Annotated[Path | None, Parameter(help="Write report, recording and plot under this name.")] = None,
    film: Annotated[
        bool, Parameter(negative="", help="With --out: also a film of the first episodes.")
    ] = False,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Let a policy drive an arm at 30 Hz over a servo motion; needs no torch."""
    from heptarm.cli import rl as work

    return work.drive(
        policy=policy,
        at=at,
        random=random,
        ask=ask,
        follow=follow,
        seed=seed,
        stiffness=stiffness,
        latency=latency,
        speed=speed,
        out=out,
        film=film,
        yes=yes,
        target=target,
        as_json=json,
    )
