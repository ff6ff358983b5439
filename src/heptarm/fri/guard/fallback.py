"""Policy for missing commands; native/fri_commands.c follows it."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from heptarm.values.checks import instance, within

#: Longest duration of a policy [s].
LONGEST = 1e9


class Missing(enum.Enum):
    """Behaviour without a fresh command.

    HOLD keeps the last command. EXTRAPOLATE continues the position or pose with its last velocity and keeps torques and
    redundancy angle; after `over` seconds it ramps down. RAMP_DOWN brakes the axes, or flange and elbow, to a stop and
    reduces torques and wrenches to zero within `over` seconds.
    """

    HOLD = "hold"
    EXTRAPOLATE = "extrapolate"
    RAMP_DOWN = "ramp down"


@dataclass(frozen=True, slots=True)
class Policy:
    """Validity of a command, and behaviour after it.

    Attributes:
        missing: behaviour without a fresh command.
        patience: time for which a command is fresh [s]; it is at least one and a half command periods.
        over: duration of an extrapolation, and of a ramp of torques to zero [s].

    Raises:
        ShapeError: a value of another type.
        LimitError: a duration is negative or longer than 1e9 s.
    """

    missing: Missing = Missing.RAMP_DOWN
    patience: float = 0.05
    over: float = 0.1

    def __post_init__(self) -> None:
        instance(self.missing, Missing, "missing", hint="for example Missing.HOLD")
        for name in ("patience", "over"):
            within(getattr(self, name), name, 0.0, LONGEST, unit="s")
