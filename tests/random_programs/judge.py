"""The judge of random programs: what no tick of the plant may show, whatever a client asks for.

It reads the plant's own record (`heptarm.sim.plant.shared_state.Trace`), not what a client received.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from heptarm.planning.seam import TICK_NS, SafetyFlags, StateWords
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Times and flags of ticks.
Ticks = npt.NDArray[np.int64]
#: Rounding of a difference of two set-points, relative to the limit.
ROUNDING = 1e-6
#: A stop has brought the arm to rest after so long [s]; behind closed brakes it gives so much when pushed [rad].
STOP_TIME, GIVES = 2.0, 0.02
#: An arm may be so much faster than its set-point.
MEASURED = 1.2
#: A set-point that moves less than this in a tick rests [rad].
STILL = 1e-9
_DT = 1e-9 * TICK_NS
_STOPS = (
    SafetyFlags.EMERGENCY_STOP
    | SafetyFlags.EXTERNAL_STOP
    | SafetyFlags.SAFEGUARD_OPEN
    | SafetyFlags.PROTECTIVE_STOP
    | SafetyFlags.DRIVE_ERROR
)


@dataclass(frozen=True)
class Violation:
    """What a tick has shown.

    Attributes:
        rule: which one it breaks.
        axis: 0 to 6; -1: the whole arm.
        time: of the simulation [s].
        value: what was seen.
        allowed: what is allowed.
    """

    rule: str
    axis: int
    time: float
    value: float
    allowed: float

    def __str__(self) -> str:
        """In words."""
        where = f"A{self.axis + 1}" if self.axis >= 0 else "the arm"
        return f"{self.time:.3f} s: {self.rule} of {where} is {self.value:.6g}, allowed {self.allowed:.6g}"


class Judge:
    """Reads the record of a plant as it grows.

    Args:
        robot: whose limits count.
        path: of the record.
    """

    def __init__(self, robot: RobotModel, path: Path) -> None:
        self._robot, self._path = robot, path
        self._read = 0
        self.ticks = 0

    def skip(self) -> None:
        """Leave out what was recorded so far."""
        self._read = self._path.stat().st_size // (8 * StateWords.SIZE)

    def violations(self, *, compliant: bool) -> list[Violation]:
        """What the ticks since the last call have shown; the first one of each rule and axis."""
        with self._path.open("rb") as file:
            file.seek(8 * StateWords.SIZE * self._read)
            words = np.frombuffer(file.read(), dtype=np.float64)
        rows = words[: len(words) - len(words) % StateWords.SIZE].reshape(-1, StateWords.SIZE)
        self._read += len(rows)
        self.ticks += len(rows)
        return judged(self._robot, rows, compliant=compliant)


def judged(robot: RobotModel, rows: Array, *, compliant: bool) -> list[Violation]:
    """What successive ticks show, shape (n, StateWords.SIZE).

    Where an arm was compliant its set-point begins again at the measured position with every change of the mode.
    """
    if len(rows) < 4:
        return []
    times = rows[:, StateWords.TIME].copy().view(np.int64)
    flags = rows[:, StateWords.FLAGS].copy().view(np.int64)
    assert (np.diff(times) == TICK_NS).all(), "the record has gaps"
    seconds: Array = times.astype(np.float64) * 1e-9
    points = rows[:, StateWords.Q_CMD]
    open_brakes = (flags & SafetyFlags.BRAKES_OPEN) != 0
    # where brakes have held the arm, the set-point begins again at the measured position
    driven = open_brakes[:-3] & open_brakes[1:-2] & open_brakes[2:-1] & open_brakes[3:]
    velocity = np.diff(points, axis=0) / _DT
    acceleration = np.diff(velocity, axis=0) / _DT
    found = _beyond("set-point below the limit [rad]", -points, -robot.q_min, seconds, slack=1e-9)
    found += _beyond("set-point above the limit [rad]", points, robot.q_max, seconds, slack=1e-9)
    speeds = np.abs(rows[:, StateWords.DQ])
    found += _beyond("measured velocity [rad/s]", speeds, MEASURED * robot.dq_max, seconds)
    if compliant:
        return found + _stopped(flags, rows[:, StateWords.Q], seconds)
    found += _beyond("velocity [rad/s]", np.abs(velocity[2:]) * driven[:, None], robot.dq_max, seconds[3:])
    found += _beyond(
        "acceleration [rad/s²]", np.abs(acceleration[1:]) * driven[:, None], robot.ddq_max, seconds[3:]
    )
    moves = np.abs(np.diff(points, axis=0)).max(axis=1)
    found += _first(
        "set-point behind closed brakes [rad]",
        moves * ~(open_brakes[1:] | open_brakes[:-1]),
        STILL,
        seconds[1:],
    )
    return found + _stopped(flags, rows[:, StateWords.Q], seconds)


def _stopped(flags: Ticks, positions: Array, seconds: Array) -> list[Violation]:
    return [one for bit in SafetyFlags(_STOPS) for one in _after_stop(bit, flags, positions, seconds)]


def _beyond(
    rule: str, values: Array, limits: Array, seconds: Array, *, slack: float = 0.0
) -> list[Violation]:
    """The first value of each axis beyond its limit."""
    found: list[Violation] = []
    for axis in range(values.shape[1]):
        allowed = float(limits[axis])
        wrong = np.flatnonzero(values[:, axis] > allowed + slack + ROUNDING * abs(allowed) * (slack == 0.0))
        if len(wrong):
            worst = wrong[np.argmax(values[wrong, axis])]
            found.append(Violation(rule, axis, float(seconds[wrong[0]]), float(values[worst, axis]), allowed))
    return found


def _first(rule: str, values: Array, allowed: float, seconds: Array) -> list[Violation]:
    wrong = np.flatnonzero(values > allowed)
    return (
        [Violation(rule, -1, float(seconds[wrong[0]]), float(values[wrong].max()), allowed)]
        if len(wrong)
        else []
    )


def _after_stop(bit: SafetyFlags, flags: Ticks, positions: Array, seconds: Array) -> list[Violation]:
    """Where the arm goes while a stop has been in force for longer than it needs to come to rest."""
    on = ((flags & bit) != 0).astype(np.int8)
    found: list[Violation] = []
    begins, ends = (
        np.flatnonzero(np.diff(on, prepend=0) == 1),
        np.flatnonzero(np.diff(on, append=0) == -1) + 1,
    )
    for begin, end in zip(begins, ends, strict=True):
        rest = begin + round(STOP_TIME / _DT)
        if rest < end:
            away = np.abs(positions[rest:end] - positions[rest]).max(axis=1)
            found += _first(f"motion [rad] {STOP_TIME:g} s after {bit.name}", away, GIVES, seconds[rest:end])
    return found[:1]
