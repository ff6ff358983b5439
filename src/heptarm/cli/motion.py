"""Commands that move an arm: `heptarm move`, `servo`, `teach`, `replay`; and `recover`."""

from __future__ import annotations

from dataclasses import asdict
from math import isnan, pi, radians, sin
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter

from heptarm.arm.motion.servo import ServoStats
from heptarm.arm.translate.motions import in_base, item
from heptarm.cli.options import (
    NO_TARGET,
    Access,
    CommandTarget,
    FrameOfPose,
    Json,
    MoveOptions,
    Overwrite,
    Speed,
)
from heptarm.cli.output import emit, state_data
from heptarm.cli.plan import preview_data
from heptarm.cli.progress import progress
from heptarm.record.recording import load
from heptarm.values.checks import within
from heptarm.values.files import writable_file
from heptarm.values.frames import BASE
from heptarm.values.mode.compliance import compliance
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.pose import Pose

_ACCESS, _MOVE = Access(), MoveOptions()


def move_ptp(
    a1: Annotated[float, Parameter(help="Position of A1 [rad], with --deg [deg]; likewise A2 to A7.")],
    a2: Annotated[float, Parameter(help="A2.")],
    a3: Annotated[float, Parameter(help="A3.")],
    a4: Annotated[float, Parameter(help="A4.")],
    a5: Annotated[float, Parameter(help="A5.")],
    a6: Annotated[float, Parameter(help="A6.")],
    a7: Annotated[float, Parameter(help="A7.")],
    /,
    *,
    options: MoveOptions = _MOVE,
) -> int:
    """Point to point, to seven joint positions [rad].

    For example:

        heptarm move ptp 0 30 0 -90 0 60 0 --deg --target lab1

        heptarm move ptp 0 0.5 0 -1.5 0 1 0 --speed 0.3 --dry-run --target sim://iiwa14
    """
    motion = ptp(_angles((a1, a2, a3, a4, a5, a6, a7), degrees=options.degrees))
    return _move(motion, options)


def move_lin(
    x: Annotated[float, Parameter(help="Position along x [m].")],
    y: Annotated[float, Parameter(help="Along y [m].")],
    z: Annotated[float, Parameter(help="Along z [m].")],
    a: Annotated[float, Parameter(help="Rotation about z [rad], with --deg [deg].")],
    b: Annotated[float, Parameter(help="Then about y.")],
    c: Annotated[float, Parameter(help="Then about x.")],
    /,
    *,
    frame: FrameOfPose = BASE,
    options: MoveOptions = _MOVE,
) -> int:
    """Straight line to a pose: x y z [m], a b c about z y x [rad], in the base or a taught frame.

    For example:

        heptarm move lin 0.5 0 0.4 180 0 180 --deg --target lab1

        heptarm move lin 0 0 0.1 180 0 180 --deg --frame /Table/Corner --target lab1
    """
    motion = lin(Pose.xyz_abc(x, y, z, *_angles((a, b, c), degrees=options.degrees)), frame=frame)
    return _move(motion, options)


def move_lin_rel(
    *,
    x: Annotated[float, Parameter(help="Offset along x [m].")] = 0.0,
    y: Annotated[float, Parameter(help="Offset along y [m].")] = 0.0,
    z: Annotated[float, Parameter(help="Offset along z [m].")] = 0.0,
    a: Annotated[float, Parameter(help="Rotation about z [rad], with --deg [deg].")] = 0.0,
    b: Annotated[float, Parameter(help="Then about y.")] = 0.0,
    c: Annotated[float, Parameter(help="Then about x.")] = 0.0,
    frame: Annotated[str, Parameter(help='Whose axes: "tool" or "base".')] = "tool",
    options: MoveOptions = _MOVE,
) -> int:
    """Straight line by an offset [m], [rad].

    For example:

        heptarm move lin-rel --z -0.05 --frame base --target lab1
    """
    motion = lin_rel(x, y, z, *_angles((a, b, c), degrees=options.degrees), frame=frame)
    return _move(motion, options)


def _angles(values: tuple[float, ...], *, degrees: bool) -> list[float]:
    return [float(v) for v in (np.radians(values) if degrees else values)]


def _move(motion: Motion, options: MoveOptions) -> int:
    """Carry out a motion; return the exit code.

    Raises:
        HeptarmError: refused, or ended under way.
    """
    with options.target.connect(control=not options.dry_run) as arm:
        # a motion outside the limits is refused here, before any question
        item(in_base(motion, arm.frames), arm.robot, speed=options.speed)
        title, percent = arm.robot.title, f"{options.speed:.0%}"
        if options.dry_run:
            preview = arm.plan(motion, speed=options.speed)
            emit({"ok": True} | preview_data(preview)) if options.as_json else print(preview)
            return 0
        options.ask_first(arm, f"Move the real {title} at {percent} speed?")
        with progress(arm):
            result = arm.move(motion, speed=options.speed)
        state = arm.wait_for_rest()
    if options.as_json:
        emit(
            {"cause": result.cause.value, "duration_s": result.duration, "residual_rad": result.residual}
            | state_data(state)
        )
    else:
        joints = " ".join(f"{v:.2f}" for v in np.degrees(state.q).round(2) + 0.0)
        print(f"{result.cause.value} after {result.duration:.2f} s, residual {result.residual:.1e} rad")
        print(f"joints {joints} deg\nflange {state.pose}")
    return 0


def servo(
    *,
    axis: Annotated[int, Parameter(help="Axis to swing, 1 to 7.")] = 7,
    amplitude: Annotated[float, Parameter(help="Amplitude [deg].")] = 5.0,
    frequency: Annotated[float, Parameter(help="Frequency of the swing [Hz].")] = 0.5,
    rate: Annotated[float, Parameter(help="Targets per second [Hz].")] = 100.0,
    duration: Annotated[float, Parameter(help="How long [s].")] = 5.0,
    speed: Speed = 0.3,
    engine: Annotated[Literal["smart", "direct"], Parameter(help="Servo motion of the cabinet.")] = "smart",
    access: Access = _ACCESS,
) -> int:
    """Swing an axis with a stream of targets and report the stream's quality.

    For example:

        heptarm servo --axis 7 --amplitude 5 --rate 200 --target lab1
    """
    index = int(within(axis, "axis", 1, 7)) - 1
    turn = radians(within(amplitude, "amplitude", 0.0, 45.0, unit="deg"))
    hertz = within(frequency, "frequency", 0.0, 5.0, above=True, unit="Hz")
    seconds = within(duration, "duration", 0.0, 86400.0, above=True, unit="s")
    with access.target.connect() as arm:
        access.ask_first(arm, f"Swing A{index + 1} of the real {arm.robot.title}?")
        direction, lag = np.eye(7)[index], 0.0
        with (
            progress(arm, seconds=seconds),
            arm.servo("joint", rate=rate, engine=engine, speed=speed, acceleration=1.0) as sv,
        ):
            while sv.tick() and sv.t < seconds:
                fade = min(
                    1.0, sv.t, max(0.0, seconds - sv.t)
                )  # a second to swing up and one to come to rest
                goal = sv.start.q + turn * fade * sin(2 * pi * hertz * sv.t) * direction
                sv.set(goal)
                lag = max(lag, abs(float(arm.state.q[index] - goal[index])))
        stats = sv.stats
    emit(asdict(stats) | {"largest_lag_rad": lag}) if access.as_json else print(report(stats, lag))
    return 0


def report(stats: ServoStats, lag: float) -> str:
    """A report of a stream, for people."""
    return f"{stats}\n  lag      {np.degrees(lag):.2f} deg at most behind the targets"


def teach(
    out: Annotated[Path, Parameter(help="File to write, .npz.")],
    /,
    *,
    free: Annotated[
        str,
        Parameter(
            help="Be compliant in these directions of the base, such as z, xy or xyzabc (a b c: about z y x). "
            "Default: hand guiding while its enabling switch is held."
        ),
    ] = "",
    seconds: Annotated[float, Parameter(help="Time limit [s].")] = 60.0,
    tolerance: Annotated[float, Parameter(help="Largest deviation of the reduced trajectory [rad].")] = 2e-3,
    overwrite: Overwrite = False,
    access: Access = _ACCESS,
) -> int:
    """Record a trajectory while a person guides the arm by hand.

    For example:

        heptarm teach path.npz --target lab1

        heptarm teach path.npz --free xy --seconds 20 --target lab1
    """
    limit = within(seconds, "seconds", 0.0, 86400.0, above=True, unit="s")
    writable_file(out.with_suffix(".npz"), overwrite=overwrite, name="out")
    mode = compliance(free, frame="base") if free else None
    with access.target.connect() as arm:
        if free:
            question = f"The real {arm.robot.title} becomes compliant for {limit:g} s. Does a person hold it?"
            access.ask_first(arm, question)
        if not access.as_json:
            how = "it is compliant now" if free else "hold the enabling switch of the hand guiding device"
            print(f"guide the arm: {how}")
        motion = hold(limit) if free else hand_guide()
        with progress(arm, seconds=limit):
            whole = arm.teach(motion, mode=mode, timeout=limit / min(arm.real_time_factor, 1.0) + 1.0)
    trajectory = whole.trimmed().thinned(tolerance=tolerance)
    file = trajectory.save(out, overwrite=overwrite)
    if access.as_json:
        emit(
            {
                "file": str(file),
                "recorded": len(whole),
                "points": len(trajectory),
                "duration_s": trajectory.duration,
            }
        )
    else:
        print(
            f"{trajectory.duration:.1f} s in {len(trajectory)} points (of {len(whole)} recorded) are in {file}"
        )
    return 0


def replay(
    file: Annotated[
        Path,
        Parameter(
            help="File written by heptarm teach, a recording, .mcap, or a table, .csv: seven columns of joint "
            "positions [rad], perhaps after one of times [s]."
        ),
    ],
    /,
    *,
    arm_of: Annotated[str, Parameter(name="--arm", help="Which arm, in a recording of several.")] = "",
    by: Annotated[
        Literal["servo", "spline"],
        Parameter(help="With the recorded timing, or as one smooth spline motion of the cabinet."),
    ] = "servo",
    speed_scaling: Annotated[
        float,
        Parameter(help="Factor on the recorded speed: 0.5 takes twice the time."),
    ] = 0.5,
    rate: Annotated[
        float | None,
        Parameter(
            help="Rows per second of a table without times in seconds [Hz]. Default: 100, without any times."
        ),
    ] = None,
    access: Access = _ACCESS,
) -> int:
    """Move to the start of a recorded trajectory and replay it.

    For example:

        heptarm replay path.npz --speed-scaling 0.3 --target lab1

        heptarm replay run.mcap --target sim://iiwa14
    """
    within(speed_scaling, "--speed-scaling", 0.0, 100.0, above=True)
    trajectory = _trajectory(file, arm_of, rate)
    with access.target.connect() as arm:
        access.ask_first(arm, f"Move the real {arm.robot.title} along {file}?")
        with progress(arm, seconds=trajectory.duration / speed_scaling):
            done = arm.replay(trajectory, by=by, speed_scaling=speed_scaling)
    if access.as_json:
        emit({"cause": done.result.cause.value, "deviation_rad": done.deviation, "lag_s": done.lag})
    else:
        off = np.degrees(done.deviation)
        lag = "" if isnan(done.lag) else f", {1e3 * done.lag:.0f} ms behind it"
        print(f"{done.result.cause.value} after {done.result.duration:.1f} s, {off:.2f} deg off at most{lag}")
    return 0


def _trajectory(file: Path, arm: str, rate: float | None) -> Trajectory:
    """The trajectory of a file that was taught or of a table, or that of a recording without its rests.

    Raises:
        CommandRejected: it cannot be read, or is neither.
    """
    if file.suffix.lower() == ".mcap":
        return load(file, arm=arm).trajectory().trimmed().thinned()
    return Trajectory.load(file, rate=rate)


def recover(
    *,
    timeout: Annotated[float, Parameter(help="How long to wait for a person to do the rest [s].")] = 0.0,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Make the robot ready again after a stop; exit code 1 if a person has to do the rest, which is printed.

    For example:

        heptarm recover --timeout 60 --target lab1
    """
    seconds = within(timeout, "timeout", 0.0, 86400.0, unit="s")
    with target.connect() as arm:
        recovery = arm.recover(timeout=seconds)
        if as_json:
            emit({"done": recovery.done, "did": list(recovery.did), "remaining": list(recovery.remaining)})
        else:
            print(recovery)
    return 0 if recovery.done else 1
