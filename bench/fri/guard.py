"""C12: wild wishes through the whole stack: a step, no number at all, ten times an axis' speed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import heptarm as ha
from bench.fri_hold import BENT, Tape
from bench.process import Cabinet
from bench.registry import Figure, benchmark
from heptarm.fri import Missing, Policy

#: What the report has to name after each wish.
NAMED = ("velocity limited", "no finite number", "acceleration limited")


@dataclass(frozen=True)
class Wild:
    """What the arm made of wild wishes.

    Attributes:
        stood: the session lived to the end.
        speed: fastest axis as a share of what it may.
        inside: every position was within the axes' ranges.
        reached: how far the arm was from the step's goal in the end [rad].
        limited: what the guard named.
    """

    stood: bool
    speed: float
    inside: bool
    reached: float
    limited: list[str]


def wild(arm: ha.Arm, *, period_ms: int = 1) -> Wild:
    """Ask for a step of half a radian, for no number, and for ten times the speed of every axis."""
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
        stood = tape.record(2.0)
    arm.move(ha.ptp(BENT))
    speed = np.abs(np.diff(tape.q, axis=0)) / np.diff(tape.t)[:, None] / robot.dq_max
    inside = bool(((tape.q >= robot.q_min) & (tape.q <= robot.q_max)).all())
    return Wild(stood, float(speed.max()), inside, reached, session.limited)


@benchmark("fri_guard", "C12")
def fri_guard() -> Iterator[Figure]:
    """A step of 0.5 rad, NaN, ten times the speed at 1 kHz: fastest axis, and what the report named."""
    with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=5.0) as arm:
        found = wild(arm)
    # a share of the speed's limit; the drives overshoot a little
    yield Figure(
        "fri_guard_speed",
        "C12",
        found.speed,
        "of dq_max",
        limit=1.01,
        detail={"stood": found.stood, "inside": found.inside, "reached_mrad": found.reached * 1e3},
    )
    named = sum(any(word in line for line in found.limited) for word in NAMED)
    yield Figure(
        "fri_guard_named",
        "C12",
        named,
        "kinds",
        limit=len(NAMED),
        least=True,
        detail={"report": found.limited},
    )
