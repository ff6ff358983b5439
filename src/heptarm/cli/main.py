"""`heptarm`: every command's options and help; the work is done in a module of the command's name."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Group, Parameter

from heptarm import __version__
from heptarm.errors import HeptarmError

app = App(
    name="heptarm", help="Control a KUKA LBR iiwa, with or without a robot on the desk.", version=__version__
)
move_app = App(name="move", help="Move the arm and wait until it rests.")
app.command(move_app)
rl_app = App(name="rl", help="Train a policy that reaches targets, look how good it is, let it drive an arm.")
app.command(rl_app)

_COMMON = Group("Common options")
_FRI = Group("FRI")
_APP = Group("Your own application")
Target = Annotated[
    str | None,
    Parameter(
        name="--target",
        group=_COMMON,
        help="What to connect to: ADDRESS[:PORT], sim://HOST:PORT or sim://iiwa14. Default: HEPTARM_TARGET.",
    ),
]
Json = Annotated[
    bool, Parameter(name="--json", group=_COMMON, negative="", help="Print one JSON object a line.")
]
Degrees = Annotated[bool, Parameter(name="--deg", negative="", help="Angles are degrees.")]
Speed = Annotated[float, Parameter(name="--speed", help="Fraction of the full speed, (0, 1].")]
Yes = Annotated[bool, Parameter(name="--yes", negative="", help="Do not ask before a real robot moves.")]
DryRun = Annotated[
    bool, Parameter(name="--dry-run", negative="", help="Check and show the motion, move nothing.")
]


@app.command
def sim(
    *,
    model: Annotated[Literal["iiwa7", "iiwa14"], Parameter(help="Robot.")] = "iiwa14",
    host: Annotated[str, Parameter(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, Parameter(help="Port; 0 takes a free one.")] = 30001,
    speed: Annotated[float, Parameter(help="Simulated seconds per second.")] = 1.0,
    view: Annotated[bool, Parameter(negative="", help="Open a live 3D view in the browser.")] = False,
    view_port: Annotated[int, Parameter(help="Port of the view; 0 takes a free one.")] = 8080,
    key: Annotated[str, Parameter(help="Pre-shared key that clients must know.")] = "",
    fault: Annotated[
        tuple[str, ...],
        Parameter(
            help="Let something go wrong at a simulated time, as NAME@SECONDS: emergency_stop, operator_safety, "
            "protective_stop, drive_error, joint_limit, singularity, t1, release, clear ...; may be given again. "
            "The same words can be typed while it runs."
        ),
    ] = (),
    payload: Annotated[
        str,
        Parameter(
            help="MASS or MASS,X,Y,Z: hangs on the flange whatever the controller is told [kg, m]. "
            "Default: what it is told."
        ),
    ] = "",
    project: Annotated[
        Path | None,
        Parameter(help="RoboticsAPI.data.xml of a Sunrise project: process data, tool templates, frames."),
    ] = None,
    verbose: Annotated[bool, Parameter(negative="", help="Show the cabinet's log.")] = False,
    application: Annotated[
        Path | None,
        Parameter(
            name="--app", group=_APP, help="Compile and run this folder's Sunrise application instead."
        ),
    ] = None,
    app_class: Annotated[
        str, Parameter(group=_APP, help="Its class, where there are several applications.")
    ] = "",
    app_data: Annotated[
        tuple[str, ...], Parameter(group=_APP, help="Process data as NAME=VALUE; may be given again.")
    ] = (),
    fri: Annotated[
        str | None,
        Parameter(
            group=_FRI, help="Instead of a cabinet only its FRI, of this version, such as 1.15, 2.5 or 2.7."
        ),
    ] = None,
    fri_command: Annotated[
        Literal["monitor", "position", "torque", "wrench", "pose"],
        Parameter(group=_FRI, help="What the client may command."),
    ] = "position",
    fri_client: Annotated[
        str, Parameter(group=_FRI, help="HOST:PORT where the client listens.")
    ] = "127.0.0.1:30200",
    fri_period: Annotated[float, Parameter(group=_FRI, help="Time between two messages [ms].")] = 5.0,
    fri_multiplier: Annotated[int, Parameter(group=_FRI, help="The client answers every n-th message.")] = 1,
    fri_port: Annotated[
        int | None,
        Parameter(group=_FRI, help="UDP port to send from. Default: the client's or its neighbour."),
    ] = None,
    fri_io: Annotated[
        tuple[str, ...],
        Parameter(
            group=_FRI,
            help="GROUP.NAME<TYPE is an input that the client reads, GROUP.NAME>TYPE an output that it writes, "
            "TYPE bool, u8 (or other bits) or analog; may be given again. Type `set GROUP.NAME VALUE` while it runs.",
        ),
    ] = (),
    fri_frame: Annotated[
        tuple[str, ...],
        Parameter(group=_FRI, help="Name of a frame that the client is asked for; may be given again."),
    ] = (),
    json: Json = False,
) -> int:
    """Run a virtual cabinet until Ctrl-C; with --fri, a bare FRI controller; with --app, your own application."""
    if application is not None:
        from heptarm.cli import sim as cabinet

        return cabinet.run_application(
            folder=application, main=app_class, data=app_data, model=model, speed=speed, as_json=json
        )
    if fri is not None:
        from heptarm.cli import fri as controller

        return controller.run(
            version=fri,
            model=model,
            command=fri_command,
            client=fri_client,
            period=fri_period,
            multiplier=fri_multiplier,
            port=fri_port,
            signals=fri_io,
            frames=fri_frame,
            speed=speed,
            verbose=verbose,
            as_json=json,
        )
    from heptarm.cli import sim as work

    return work.run(
        model=model,
        host=host,
        port=port,
        speed=speed,
        view=view,
        view_port=view_port,
        key=key,
        faults=fault,
        payload=payload,
        project=project,
        verbose=verbose,
        as_json=json,
    )


@app.command
def state(
    *,
    watch: Annotated[bool, Parameter(negative="", help="Go on until Ctrl-C.")] = False,
    rate: Annotated[float, Parameter(help="States per second.")] = 10.0,
    duration: Annotated[float | None, Parameter(help="Watch for this long [s].")] = None,
    target: Target = None,
    json: Json = False,
) -> int:
    """Show the state of the arm."""
    from heptarm.cli import state as work

    return work.run(target=target, watch=watch, rate=rate, duration=duration, as_json=json)


@move_app.command(name="ptp")
def move_ptp(
    a1: float,
    a2: float,
    a3: float,
    a4: float,
    a5: float,
    a6: float,
    a7: float,
    /,
    *,
    deg: Degrees = False,
    speed: Speed = 0.1,
    yes: Yes = False,
    dry_run: DryRun = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Point to point, to seven joint positions [rad]."""
    from heptarm.cli import move as work

    motion = work.ptp((a1, a2, a3, a4, a5, a6, a7), degrees=deg)
    return work.run(motion, target=target, speed=speed, yes=yes, dry_run=dry_run, as_json=json)


@move_app.command(name="lin")
def move_lin(
    x: float,
    y: float,
    z: float,
    a: float,
    b: float,
    c: float,
    /,
    *,
    deg: Degrees = False,
    speed: Speed = 0.1,
    yes: Yes = False,
    dry_run: DryRun = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Straight line to a pose in the base frame: x y z [m], a b c about z y x [rad]."""
    from heptarm.cli import move as work

    motion = work.lin((x, y, z, a, b, c), degrees=deg)
    return work.run(motion, target=target, speed=speed, yes=yes, dry_run=dry_run, as_json=json)


@move_app.command(name="lin_rel")
def move_lin_rel(
    *,
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    a: float = 0.0,
    b: float = 0.0,
    c: float = 0.0,
    frame: Annotated[str, Parameter(help='Whose axes: "tool" or "base".')] = "tool",
    deg: Degrees = False,
    speed: Speed = 0.1,
    yes: Yes = False,
    dry_run: DryRun = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Straight line by an offset [m], [rad]."""
    from heptarm.cli import move as work

    motion = work.lin_rel((x, y, z, a, b, c), frame=frame, degrees=deg)
    return work.run(motion, target=target, speed=speed, yes=yes, dry_run=dry_run, as_json=json)


@app.command
def servo(
    *,
    axis: Annotated[int, Parameter(help="Axis to swing, 1 to 7.")] = 7,
    amplitude: Annotated[float, Parameter(help="How far [deg].")] = 5.0,
    frequency: Annotated[float, Parameter(help="Swings per second [Hz].")] = 0.5,
    rate: Annotated[float, Parameter(help="Targets per second [Hz].")] = 100.0,
    duration: Annotated[float, Parameter(help="How long [s].")] = 5.0,
    speed: Speed = 0.3,
    engine: Annotated[Literal["smart", "direct"], Parameter(help="Servo motion of the cabinet.")] = "smart",
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Swing an axis by a stream of targets, and say how the stream went."""
    from heptarm.cli import servo as work

    return work.run(
        axis=axis,
        amplitude=amplitude,
        frequency=frequency,
        rate=rate,
        duration=duration,
        speed=speed,
        engine=engine,
        yes=yes,
        target=target,
        as_json=json,
    )


@app.command
def teach(
    out: Annotated[Path, Parameter(help="File to write, .npz.")],
    /,
    *,
    free: Annotated[
        str,
        Parameter(
            help="Give way in these directions of the base, such as z, xy or xyzabc (a b c: about z y x). "
            "Default: hand guiding, while its switch is held."
        ),
    ] = "",
    seconds: Annotated[float, Parameter(help="How long at most [s].")] = 60.0,
    tolerance: Annotated[float, Parameter(help="How far the kept points may lead off the way [rad].")] = 2e-3,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Record the way while somebody leads the arm by hand."""
    from heptarm.cli import teach as work

    return work.teach(
        out=out, free=free, seconds=seconds, tolerance=tolerance, yes=yes, target=target, as_json=json
    )


@app.command
def replay(
    file: Annotated[Path, Parameter(help="What heptarm teach wrote.")],
    /,
    *,
    by: Annotated[
        Literal["servo", "spline"], Parameter(help="As it was taught, or as one smooth motion of the cabinet.")
    ] = "servo",
    pace: Annotated[
        float, Parameter(help="By servo: so many times as fast; by spline: fraction of the full speed.")
    ] = 0.5,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Move to the start of what was taught and do it again."""
    from heptarm.cli import teach as work

    return work.replay(file=file, by=by, pace=pace, yes=yes, target=target, as_json=json)


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


@app.command
def stop(*, target: Target = None, json: Json = False) -> int:
    """Stop whatever runs; needs no control."""
    from heptarm.cli import move as work

    return work.stop(target=target, as_json=json)


FriPort = Annotated[
    int | None, Parameter(group=_FRI, help="Own UDP port. Default: the first free one of 30200 to 30209.")
]
FriPeriod = Annotated[int, Parameter(group=_FRI, help="Time between two messages [ms].")]
FriVersion = Annotated[
    str | None, Parameter(group=_FRI, help="FRI release that the cabinet speaks. Default: whichever it is.")
]
FriListen = Annotated[
    bool,
    Parameter(
        group=_FRI,
        negative="",
        help="Open no session; listen to the FRI application that runs on the cabinet.",
    ),
]


@app.command
def recover(
    *,
    timeout: Annotated[float, Parameter(help="Wait so long for a person to do what is left [s].")] = 0.0,
    target: Target = None,
    json: Json = False,
) -> int:
    """Make the robot ready again after a stop, and say what is left to a person; exit code 1 if something is."""
    from heptarm.cli import move as work

    return work.recover(target=target, timeout=timeout, as_json=json)


@app.command
def doctor(
    *,
    fri: Annotated[bool, Parameter(group=_FRI, negative="", help="Also look at FRI.")] = False,
    listen: FriListen = False,
    fri_port: FriPort = None,
    fri_period: FriPeriod = 1,
    fri_version: FriVersion = None,
    seconds: Annotated[float, Parameter(group=_FRI, help="How long to look at FRI [s].")] = 5.0,
    target: Target = None,
    json: Json = False,
) -> int:
    """Check the installation, and a target if one is given: one verdict and one remedy a line.

    With --fri also the connection for FRI: a session of the target, or with --listen what some other application
    on the cabinet sends.
    """
    from heptarm.cli import doctor as work

    listens = listen or (target is None and not os.environ.get("HEPTARM_TARGET"))
    look = work.Look(listens, fri_port, fri_period, fri_version, seconds)
    return work.run(target=target, as_json=json, fri=look if fri else None)


@app.command
def bench(
    *,
    fri: Annotated[bool, Parameter(group=_FRI, negative="", help="Measure FRI.")] = False,
    listen: FriListen = False,
    fri_command: Annotated[
        Literal["monitor", "position"],
        Parameter(group=_FRI, help="Only monitor, or hold the position by commands."),
    ] = "monitor",
    fri_port: FriPort = None,
    fri_period: FriPeriod = 1,
    fri_version: FriVersion = None,
    duration: Annotated[float, Parameter(help="How long to measure [s].")] = 10.0,
    plot: Annotated[Path | None, Parameter(help="Save histogram and course as a picture.")] = None,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Measure how fast and how reliably FRI messages are answered, and name what spoils it; exit code for CI."""
    from heptarm.cli import fri_bench as work

    return work.run(
        fri=fri,
        listen=listen,
        command=fri_command,
        port=fri_port,
        period_ms=fri_period,
        version=fri_version,
        duration=duration,
        plot=plot,
        yes=yes,
        target=target,
        as_json=json,
    )


@app.command
def check(
    *only: Annotated[
        str, Parameter(help="Scenarios: names, groups, or patterns such as 'motions.*'. None: all.")
    ],
    list_only: Annotated[bool, Parameter(name="--list", negative="", help="Name them, run nothing.")] = False,
    contact: Annotated[
        bool, Parameter(negative="", help="On a robot, also those that touch something.")
    ] = False,
    faults: Annotated[
        bool, Parameter(negative="", help="On a robot, also those in which something goes wrong.")
    ] = False,
    sim_speed: Annotated[float, Parameter(help="Without a target: simulated seconds per second.")] = 2.0,
    junit: Annotated[Path | None, Parameter(help="Write a report for CI systems, JUnit XML.")] = None,
    yes: Yes = False,
    target: Target = None,
    json: Json = False,
) -> int:
    """Show what a robot can do, scenario by scenario, by measurement; exit code 1 if one fails.

    Without a target a simulator with a table, signals and tools is started. A real robot moves at a tenth of its speed,
    and every scenario that moves it asks first.
    """
    from heptarm.cli import check as work

    return work.run(
        only=only,
        list_only=list_only,
        contact=contact,
        faults=faults,
        sim_speed=sim_speed,
        junit=junit,
        yes=yes,
        target=target,
        as_json=json,
    )


@app.command(name="install-cabinet")
def install_cabinet(
    *,
    out: Annotated[Path, Parameter(help="Folder to write; must be new or empty.")],
    json: Json = False,
) -> int:
    """Write the cabinet application for a Sunrise project, with the steps."""
    from heptarm.cli import install_cabinet as work

    return work.run(out=out, as_json=json)


@app.command
def demo(
    *,
    plot: Annotated[Path, Parameter(help="Where to save the plot.")] = Path("heptarm-demo.png"),
    target: Target = None,
    json: Json = False,
) -> int:
    """Move a virtual arm through the whole stack; a table and a plot show how it went."""
    from heptarm.cli import demo as work

    return work.run(target=target, plot=plot, as_json=json)


def main() -> None:
    """Entry point: errors of heptarm are one sentence on standard error and exit code 1."""
    try:
        code = app()
    except HeptarmError as error:
        if os.environ.get("HEPTARM_DEBUG"):
            raise
        print(f"heptarm: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has gone, as in `heptarm state --watch | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    sys.exit(code if isinstance(code, int) else 0)


if __name__ == "__main__":
    main()
