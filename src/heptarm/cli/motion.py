"""Commands that move an arm: `heptarm move`, `servo`, `teach`, `replay`; and `recover`."""

from __future__ import annotations

from dataclasses import asdict
from math import pi, radians, sin
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from cyclopts import Parameter

from heptarm.arm.motion.servo import ServoStats
from heptarm.arm.translate.motions import items
from heptarm.cli.options import NO_TARGET, Access, CommandTarget, Json, MoveOptions, Speed
from heptarm.cli.output import confirm, emit, state_data
from heptarm.errors import CommandRejected, NotReady
from heptarm.values.arrays import within
from heptarm.values.mode.compliance import compliance
from heptarm.values.motion.hand_guiding import hand_guide
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.pose import Pose

_ACCESS, _MOVE = Access(), MoveOptions()


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
    options: MoveOptions = _MOVE,
) -> int:
    """Point to point, to seven joint positions [rad]."""
    motion = ptp(_angles((a1, a2, a3, a4, a5, a6, a7), degrees=options.degrees))
    return _move(motion, options)


def move_lin(
    x: float,
    y: float,
    z: float,
    a: float,
    b: float,
    c: float,
    /,
    *,
    options: MoveOptions = _MOVE,
) -> int:
    """Straight line to a pose in the base frame: x y z [m], a b c about z y x [rad]."""
    motion = lin(Pose.xyz_abc(x, y, z, *_angles((a, b, c), degrees=options.degrees)))
    return _move(motion, options)


def move_lin_rel(
    *,
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    a: float = 0.0,
    b: float = 0.0,
    c: float = 0.0,
    frame: Annotated[str, Parameter(help='Whose axes: "tool" or "base".')] = "tool",
    options: MoveOptions = _MOVE,
) -> int:
    """Straight line by an offset [m], [rad]."""
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
        items((motion,), arm.robot, options.speed)
        title, percent = arm.robot.title, f"{options.speed:.0%}"
        if options.dry_run:
            text = f"{motion!r} at {percent} speed is within the limits of the {title}; nothing was moved"
            emit({"ok": True, "text": text}) if options.as_json else print(text)
            return 0
        if not (arm.is_virtual or options.yes or confirm(f"Move the real {title} at {percent} speed?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
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
    """Swing an axis with a stream of targets and report the stream's quality."""
    index = int(within(axis, "axis", 1, 7)) - 1
    turn = radians(within(amplitude, "amplitude", 0.0, 45.0, unit="deg"))
    hertz = within(frequency, "frequency", 0.0, 5.0, above=True, unit="Hz")
    seconds = within(duration, "duration", 0.0, 86400.0, above=True, unit="s")
    with access.target.connect() as arm:
        if not (
            arm.is_virtual or access.yes or confirm(f"Swing A{index + 1} of the real {arm.robot.title}?")
        ):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        direction, lag = np.eye(7)[index], 0.0
        with arm.servo("joint", rate=rate, engine=engine, speed=speed, acceleration=1.0) as sv:
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
    return "\n".join(
        (
            f"sent      {stats.sent} targets at {stats.rate:.1f} Hz, {stats.late_ticks} ticks late",
            f"set       {stats.set_median * 1e6:.0f} us median, {stats.set_p99 * 1e6:.0f} us p99",
            f"cabinet   {stats.received} received, {stats.applied} applied, {stats.refused} refused, {stats.late} gaps",
            f"age       {stats.age_median * 1e3:.2f} ms median, {stats.age_p99 * 1e3:.2f} ms p99 when applied",
            f"lag       {np.degrees(lag):.2f} deg at most behind the targets",
        )
    )


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
    access: Access = _ACCESS,
) -> int:
    """Record a trajectory while a person guides the arm by hand."""
    limit = within(seconds, "seconds", 0.0, 86400.0, above=True, unit="s")
    mode = compliance(free, frame="base") if free else None
    with access.target.connect() as arm:
        asked = free and not (arm.is_virtual or access.yes)
        if asked and not confirm(
            f"The real {arm.robot.title} becomes compliant for {limit:g} s. Does a person hold it?"
        ):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        if not access.as_json:
            how = "it is compliant now" if free else "hold the enabling switch of the hand guiding device"
            print(f"guide the arm: {how}")
        motion = hold(limit) if free else hand_guide()
        whole = arm.teach(motion, mode=mode, timeout=limit / min(arm.real_time_factor, 1.0) + 1.0)
    trajectory = whole.trimmed().thinned(tolerance=tolerance)
    file = trajectory.save(out)
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
    file: Annotated[Path, Parameter(help="File written by heptarm teach.")],
    /,
    *,
    by: Annotated[
        Literal["servo", "spline"],
        Parameter(help="With the recorded timing, or as one smooth spline motion of the cabinet."),
    ] = "servo",
    speed_scaling: Annotated[
        float,
        Parameter(help="By servo: factor on the recorded speed; by spline: fraction of the full speed."),
    ] = 0.5,
    access: Access = _ACCESS,
) -> int:
    """Move to the start of a recorded trajectory and replay it."""
    try:
        trajectory = Trajectory.load(file)
    except OSError as error:
        raise CommandRejected(f"{file}: {error.strerror}", parameter="file", value=str(file)) from error
    with access.target.connect() as arm:
        if not (arm.is_virtual or access.yes or confirm(f"Move the real {arm.robot.title} along {file}?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        done = arm.replay(trajectory, by=by, speed_scaling=speed_scaling)
    if access.as_json:
        emit({"cause": done.result.cause.value, "deviation_rad": done.deviation, "lag_s": done.lag})
    else:
        off = np.degrees(done.deviation)
        print(f"{done.result.cause.value} after {done.result.duration:.1f} s, {off:.2f} deg off at most")
    return 0


def recover(
    *,
    timeout: Annotated[float, Parameter(help="How long to wait for a person to do the rest [s].")] = 0.0,
    target: CommandTarget = NO_TARGET,
    as_json: Json = False,
) -> int:
    """Make the robot ready again after a stop; exit code 1 if a person has to do the rest, which is printed."""
    with target.connect() as arm:
        recovery = arm.recover(timeout=timeout)
        if as_json:
            emit({"done": recovery.done, "did": list(recovery.did), "remaining": list(recovery.remaining)})
        else:
            print(recovery)
    return 0 if recovery.done else 1
