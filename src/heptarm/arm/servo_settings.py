"""What a servo motion is opened with: its kind, engine, limits and times, checked before anything is sent."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, TypedDict

from heptarm.arm.modes import mode_message
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.arguments import TOOL, check_name
from heptarm.values.arrays import within
from heptarm.values.condition import Condition
from heptarm.values.mode import Mode
from heptarm.wire import messages as wire

ENGINES = {"smart": wire.ServoEngine.SMART, "direct": wire.ServoEngine.DIRECT}
#: Fraction of the axes' maxima that a servo motion of the joints uses without a word of the user.
_GENTLE = 0.2
#: How long the velocity of a target is kept after the target was passed [s].
_KEPT = 0.1
#: Without a word of the user the watchdog is so many periods long, but no shorter than this [s].
_PERIODS, _SHORTEST = 5.0, 0.2
_LONGEST = 2.0
#: How long the cabinet may take until the first target counts [s].
_FIRST = 2.0


class ServoSettings(TypedDict, total=False):
    """What `Arm.servo` can be told, for type checkers."""

    rate: float
    watchdog: float | None
    engine: Literal["smart", "direct"]
    mode: Mode | None
    speed: float | None
    acceleration: float | None
    speed_mps: float | None
    acceleration_mps2: float | None
    speed_radps: float | None
    acceleration_radps2: float | None
    min_trajectory_time: float | None
    goal_timeout: float
    speed_timeout: float | None
    moving: str
    until: Condition | None


@dataclass(frozen=True, slots=True)
class Line:
    """Limits of a straight servo motion along (and about) each axis of the base; None: as below.

    Attributes:
        speed_mps: (0, 10] [m/s]; None: 0.25.
        acceleration_mps2: (0, 100] [m/s²]; None: 1.
        speed_radps: (0, 20] [rad/s]; None: 0.5.
        acceleration_radps2: (0, 200] [rad/s²]; None: 2.
    """

    speed_mps: float | None = None
    acceleration_mps2: float | None = None
    speed_radps: float | None = None
    acceleration_radps2: float | None = None

    @property
    def given(self) -> list[str]:
        """Names of what was said."""
        return [one.name for one in fields(self) if getattr(self, one.name) is not None]

    def message(self, ceiling: float) -> wire.CartesianDynamics:
        """On the wire, the speeds scaled by a fraction in (0, 1].

        Raises:
            LimitError: one is outside its range.
        """
        chosen = [
            within(
                default if getattr(self, name) is None else getattr(self, name),
                name,
                0.0,
                most,
                above=True,
                unit=unit,
            )
            for name, default, most, unit in _LINE
        ]
        return wire.CartesianDynamics(
            velocity=ceiling * chosen[0],
            acceleration=chosen[1],
            orientation_velocity=ceiling * chosen[2],
            orientation_acceleration=chosen[3],
        )


_LINE = (
    ("speed_mps", 0.25, 10.0, "m/s"),
    ("acceleration_mps2", 1.0, 100.0, "m/s²"),
    ("speed_radps", 0.5, 20.0, "rad/s"),
    ("acceleration_radps2", 2.0, 200.0, "rad/s²"),
)


class _Limits(TypedDict, total=False):
    """Fields of a ServoOpen."""

    engine: wire.ServoEngine
    velocity: float
    acceleration: float
    linear: wire.CartesianDynamics


def open_message(
    kind: str,
    *,
    rate: float,
    watchdog: float | None,
    engine: str,
    mode: Mode | None,
    speed: float | None,
    acceleration: float | None,
    min_trajectory_time: float | None,
    goal_timeout: float,
    moving: str = TOOL,
    line: Line | None = None,
    ceiling: float = 1.0,
    speed_timeout: float | None = None,
) -> tuple[wire.ServoOpen, float, float]:
    """The message that opens a servo motion, its rate [Hz] and its watchdog [s], all checked; see `Arm.servo`."""
    if engine not in ENGINES:
        raise ShapeError(
            f"engine is {engine!r}; allowed are {', '.join(map(repr, ENGINES))}", parameter="engine"
        )
    check_name(moving, "moving")
    if kind not in ("joint", "pose", "lin"):
        raise ShapeError(f"kind is {kind!r}; allowed are 'joint', 'pose', 'lin'", parameter="kind")
    limits = _limits(kind, engine, speed, acceleration, line or Line(), ceiling)
    if speed_timeout is not None and (kind, engine) != ("joint", "smart"):
        raise CommandRejected(
            'speed_timeout belongs to targets with a velocity: arm.servo("joint") with the engine "smart"',
            parameter="speed_timeout",
            hint="leave it out",
        )
    hertz = within(rate, "rate", 0.0, 1000.0, above=True, unit="Hz")
    period = 1.0 / hertz
    seconds = min(max(_PERIODS * period, _SHORTEST), _LONGEST)
    if watchdog is not None:
        seconds = within(watchdog, "watchdog", 0.005, _LONGEST, unit="s")
    if seconds < period:
        raise LimitError(
            f"the watchdog of {seconds:g} s is shorter than the period of {period:g} s",
            code=2,
            parameter="watchdog",
            value=seconds,
            allowed=f"[{period:g}, {_LONGEST:g}] s",
            hint="give a longer watchdog or a higher rate",
        )
    shortest = min(max(period + 0.005, 0.001), 1.0) if min_trajectory_time is None else min_trajectory_time
    return (
        wire.ServoOpen(
            **limits,
            frame="" if moving == TOOL else moving,
            mode=mode_message(mode),
            min_trajectory_time=within(shortest, "min_trajectory_time", 0.001, 1.0, unit="s"),
            goal_timeout=within(goal_timeout, "goal_timeout", 0.1, 3600.0, unit="s"),
            speed_timeout=within(
                _KEPT if speed_timeout is None else speed_timeout, "speed_timeout", 0.001, 10.0, unit="s"
            ),
            watchdog=_FIRST,
        ),
        hertz,
        seconds,
    )


def _limits(
    kind: str, engine: str, speed: float | None, acceleration: float | None, line: Line, ceiling: float
) -> _Limits:
    """Engine and limits of a servo motion; what its kind would not heed is refused."""
    if kind != "lin":
        if line.given:
            why = f'belongs to arm.servo("lin"); a {kind} servo has speed and acceleration'
            raise _foreign(line.given[0], why)
        return {
            "engine": ENGINES[engine],
            "velocity": min(ceiling, _fraction(speed, "speed")),
            "acceleration": _fraction(acceleration, "acceleration"),
        }
    for name, value in (("speed", speed), ("acceleration", acceleration)):
        if value is not None:
            raise _foreign(name, "is a fraction of the axes' maxima, which a straight servo motion does not heed")
    if engine != "smart":
        raise _foreign("engine", 'is a choice of "joint" and "pose" only; a straight servo motion has one of its own')
    return {
        "engine": wire.ServoEngine.LIN,
        "velocity": 1.0,
        "acceleration": 1.0,
        "linear": line.message(ceiling),
    }


def _fraction(value: float | None, name: str) -> float:
    return within(_GENTLE if value is None else value, name, 0.0, 1.0, above=True)


def _foreign(name: str, why: str) -> CommandRejected:
    limits = ", ".join(one.name for one in fields(Line))
    return CommandRejected(f"{name} {why}", parameter=name, hint=f'the limits of arm.servo("lin") are {limits}')
