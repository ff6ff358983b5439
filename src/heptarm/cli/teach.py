"""`heptarm teach` and `heptarm replay`: lead the arm by hand, keep the way in a file, do it again."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from heptarm.arm.connect import connect
from heptarm.cli.output import confirm, emit
from heptarm.errors import CommandRejected, NotReady
from heptarm.values.arrays import within
from heptarm.values.motion import hand_guide, hold
from heptarm.values.trajectory import Trajectory
from heptarm.values.yielding import yielding


def teach(
    *, out: Path, free: str, seconds: float, tolerance: float, yes: bool, target: str | None, as_json: bool
) -> int:
    """Record the way while somebody leads the arm; returns the exit code.

    Args:
        out: file to write.
        free: directions to give way in; empty: hand guiding, for the time that its switch is held.
        seconds: how long at most [s].
        tolerance: how far the kept points may lead off the way [rad].
        yes: do not ask before a real robot gives way.
        target: what to connect to.
        as_json: print an object.

    Raises:
        HeptarmError: refused, ended under way, or nothing moved.
    """
    limit = within(seconds, "seconds", 0.0, 86400.0, above=True, unit="s")
    mode = yielding(free, frame="base") if free else None
    with connect(target) as arm:
        asked = free and not (arm.is_virtual or yes)
        if asked and not confirm(
            f"The real {arm.robot.title} gives way for {limit:g} s. Does somebody hold it?"
        ):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        if not as_json:
            print(
                f"lead the arm: {'it gives way now' if free else 'hold the switch of the hand guiding device'}"
            )
        motion = hold(limit) if free else hand_guide()
        whole = arm.teach(motion, mode=mode, timeout=limit / min(arm.pace, 1.0) + 1.0)
    way = whole.trimmed().thinned(tolerance=tolerance)
    file = way.save(out)
    if as_json:
        emit({"file": str(file), "recorded": len(whole), "points": len(way), "duration_s": way.duration})
    else:
        print(f"{way.duration:.1f} s in {len(way)} points (of {len(whole)} recorded) are in {file}")
    return 0


def replay(
    *, file: Path, by: Literal["servo", "spline"], pace: float, yes: bool, target: str | None, as_json: bool
) -> int:
    """Do again what was taught; returns the exit code.

    Args:
        file: what `heptarm teach` wrote.
        by: "servo" or "spline".
        pace: by servo: times as fast; by spline: fraction of the full speed.
        yes: do not ask before a real robot moves.
        target: what to connect to.
        as_json: print an object.

    Raises:
        HeptarmError: no such file, refused, or ended under way.
    """
    try:
        way = Trajectory.load(file)
    except OSError as error:
        raise CommandRejected(f"{file}: {error.strerror}", parameter="file", value=str(file)) from error
    with connect(target) as arm:
        if not (arm.is_virtual or yes or confirm(f"Move the real {arm.robot.title} along {file}?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        done = arm.replay(way, by=by, pace=pace)
    if as_json:
        emit({"cause": done.result.cause.value, "deviation_rad": done.deviation, "lag_s": done.lag})
    else:
        off = np.degrees(done.deviation)
        print(f"{done.result.cause.value} after {done.result.duration:.1f} s, {off:.2f} deg off at most")
    return 0
