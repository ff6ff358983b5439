"""`heptarm move` and `heptarm stop`."""

from __future__ import annotations

import numpy as np

from heptarm.arm import program
from heptarm.arm.connect import connect
from heptarm.cli.output import confirm, emit, state_data
from heptarm.errors import NotReady
from heptarm.values import motion as motions
from heptarm.values.motion import Motion
from heptarm.values.pose import Pose


def _angles(values: tuple[float, ...], *, degrees: bool) -> list[float]:
    return [float(v) for v in (np.radians(values) if degrees else values)]


def ptp(joints: tuple[float, ...], *, degrees: bool) -> Motion:
    """A ptp from the command line's numbers."""
    return motions.ptp(_angles(joints, degrees=degrees))


def lin(pose: tuple[float, ...], *, degrees: bool) -> Motion:
    """A lin from the command line's numbers."""
    return motions.lin(Pose.xyz_abc(*pose[:3], *_angles(pose[3:], degrees=degrees)))


def lin_rel(offset: tuple[float, ...], *, frame: str, degrees: bool) -> Motion:
    """A lin_rel from the command line's numbers."""
    return motions.lin_rel(*offset[:3], *_angles(offset[3:], degrees=degrees), frame=frame)


def run(motion: Motion, *, target: str | None, speed: float, yes: bool, dry_run: bool, as_json: bool) -> int:
    """Carry out a motion; returns the exit code.

    Raises:
        HeptarmError: refused, or ended under way.
    """
    with connect(target, control=not dry_run) as arm:
        program.items(
            (motion,), arm.robot, speed
        )  # refuses here what would be refused anyway, before any question
        if dry_run:
            text = f"{motion} at {speed:.0%} speed is within the limits of the {arm.robot.title}; nothing was moved"
            emit({"ok": True, "text": text}) if as_json else print(text)
            return 0
        if not (arm.is_virtual or yes or confirm(f"Move the real {arm.robot.title} at {speed:.0%} speed?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        result = arm.move(motion, speed=speed)
        state = arm.wait_for_rest()
    if as_json:
        emit(
            {"cause": result.cause.value, "duration_s": result.duration, "residual_rad": result.residual}
            | state_data(state)
        )
    else:
        joints = " ".join(f"{v:.2f}" for v in np.degrees(state.q).round(2) + 0.0)
        print(f"{result.cause.value} after {result.duration:.2f} s, residual {result.residual:.1e} rad")
        print(f"joints {joints} deg\nflange {state.pose}")
    return 0


def stop(*, target: str | None, as_json: bool) -> int:
    """Stop whatever runs; returns the exit code."""
    with connect(target, control=False) as arm:
        arm.stop()
        arm.wait_for_rest()
    emit({"stopped": True}) if as_json else print("the arm is at rest")
    return 0


def recover(*, target: str | None, timeout: float, as_json: bool) -> int:
    """Make the robot ready again, or say what is left to a person; returns the exit code."""
    with connect(target) as arm:
        recovery = arm.recover(timeout=timeout)
        if as_json:
            emit({"done": recovery.done, "did": list(recovery.did), "remaining": list(recovery.remaining)})
        else:
            print(recovery)
    return 0 if recovery.done else 1
