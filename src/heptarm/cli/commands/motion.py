"""What moves an arm, stops it, or makes it ready again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from heptarm.cli.app import Degrees, DryRun, Json, Speed, Target, Yes, app, move_app


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
        Literal["servo", "spline"],
        Parameter(help="As it was taught, or as one smooth motion of the cabinet."),
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


@app.command
def stop(*, target: Target = None, json: Json = False) -> int:
    """Stop whatever runs; needs no control."""
    from heptarm.cli import move as work

    return work.stop(target=target, as_json=json)


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
