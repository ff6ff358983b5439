"""`heptarm servo`: swings one axis by a stream of targets, and says how the stream went."""

from __future__ import annotations

from dataclasses import asdict
from math import pi, radians, sin
from typing import Literal

import numpy as np

from heptarm.arm.connect import connect
from heptarm.arm.servo import ServoStats
from heptarm.cli.output import confirm, emit
from heptarm.errors import NotReady
from heptarm.values.arrays import within


def run(
    *,
    axis: int,
    amplitude: float,
    frequency: float,
    rate: float,
    duration: float,
    speed: float,
    engine: Literal["smart", "direct"],
    yes: bool,
    target: str | None,
    as_json: bool,
) -> int:
    """Swing an axis about where it is; returns the exit code.

    Args:
        axis: 1 to 7.
        amplitude: [deg].
        frequency: of the swing [Hz].
        rate: targets per second [Hz].
        duration: [s].
        speed: ceiling, a fraction of the axis' maximum.
        engine: which servo motion of the cabinet.
        yes: do not ask before a real robot moves.
        target: what to connect to.
        as_json: print an object.

    Raises:
        HeptarmError: refused, or ended under way.
    """
    index = int(within(axis, "axis", 1, 7)) - 1
    turn = radians(within(amplitude, "amplitude", 0.0, 45.0, unit="deg"))
    hertz = within(frequency, "frequency", 0.0, 5.0, above=True, unit="Hz")
    seconds = within(duration, "duration", 0.0, 86400.0, above=True, unit="s")
    with connect(target) as arm:
        if not (arm.is_virtual or yes or confirm(f"Swing A{index + 1} of the real {arm.robot.title}?")):
            raise NotReady("nothing was moved", hint="confirm the question, or give --yes")
        direction, lag = np.eye(7)[index], 0.0
        with arm.servo("joint", rate=rate, engine=engine, speed=speed, acceleration=1.0) as sv:
            while sv.tick() and sv.t < seconds:
                fade = min(1.0, sv.t, max(0.0, seconds - sv.t))  # a second to swing up and one to calm down
                goal = sv.start.q + turn * fade * sin(2 * pi * hertz * sv.t) * direction
                sv.set(goal)
                lag = max(lag, abs(float(arm.state.q[index] - goal[index])))
        stats = sv.stats
    emit(asdict(stats) | {"largest_lag_rad": lag}) if as_json else print(report(stats, lag))
    return 0


def report(stats: ServoStats, lag: float) -> str:
    """What a stream was like, in words."""
    return "\n".join(
        (
            f"sent      {stats.sent} targets at {stats.rate:.1f} Hz, {stats.late_ticks} ticks late",
            f"set       {stats.set_median * 1e6:.0f} us median, {stats.set_p99 * 1e6:.0f} us p99",
            f"cabinet   {stats.received} received, {stats.applied} applied, {stats.refused} refused, {stats.late} gaps",
            f"age       {stats.age_median * 1e3:.2f} ms median, {stats.age_p99 * 1e3:.2f} ms p99 when applied",
            f"lag       {np.degrees(lag):.2f} deg at most behind the targets",
        )
    )
