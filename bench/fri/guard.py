"""Invalid commands through the whole stack: a step, NaN, ten times the speed of each axis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import heptarm as ha
from bench.fri.hold import BENT, Tape
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from heptarm.fri.guard.fallback import Missing, Policy

#: Interventions that the report must name after each command.
NAMED = ("velocity limited", "not finite", "acceleration limited")


@dataclass(frozen=True)
class Wild:
    """Motion of the arm under invalid commands.

    Attributes:
        survived: the session lasted to the end.
        speed: fastest axis as a fraction of its limit.
        inside: every position was within the axes' ranges.
        reached: how far the arm was from the step's goal in the end [rad].
        limited: what the guard reported.
    """

    survived: bool
    speed: float
    inside: bool
    reached: float
    limited: list[str]


def wild(arm: ha.Arm, *, period_ms: int = 1) -> Wild:
    """Command a step of half a radian, NaN, and ten times the speed of every axis."""
    arm.move(ha.ptp(BENT))
    robot = arm.robot
    with arm.fri("position", period_ms=period_ms, policy=Policy(Missing.HOLD), history=8192) as session:
        tape, start = Tape(session), session.start.q_ipo.copy()
        session.command(q=start + 0.5)
        tape.record(2.0)
        reached = float(np.abs(session.state.q - start - 0.5).max())
        session.command(q=np.full(7, np.nan))
        tape.record(0.3)
        begin = session.state.t
        for s in session:
            ahead = s.t - begin
            if ahead > 0.1:
                break
            session.command(q=start + 0.5 - 10.0 * robot.dq_max * ahead)
        session.command(q=start)
        survived = tape.record(2.0)
    arm.move(ha.ptp(BENT))
    speed = np.abs(np.diff(tape.q, axis=0)) / np.diff(tape.t)[:, None] / robot.dq_max
    inside = bool(((tape.q >= robot.q_min) & (tape.q <= robot.q_max)).all())
    return Wild(survived, float(speed.max()), inside, reached, session.limited)


@benchmark("fri_guard")
def fri_guard() -> Iterator[Figure]:
    """A step of 0.5 rad, NaN, ten times the speed at 1 kHz: fastest axis, and what the report named."""
    with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=5.0) as arm:
        found = wild(arm)
    # of the limit; the drives overshoot a little
    yield Figure(
        "fri_guard_speed",
        found.speed,
        "fraction",
        limit=1.01,
        detail={"survived": found.survived, "inside": found.inside, "reached_mrad": found.reached * 1e3},
    )
    named = sum(any(word in line for line in found.limited) for word in NAMED)
    yield Figure(
        "fri_guard_named",
        named,
        "count",
        limit=len(NAMED),
        at_least=True,
        detail={"report": found.limited},
    )
