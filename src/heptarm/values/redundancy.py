"""KUKA's redundancy of an LBR pose: which of the many arm positions that lead there is meant."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan

from heptarm.errors import LimitError
from heptarm.values.arrays import Value, scalar, within

#: Larger arm angles are mistakes [rad].
_LARGEST = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class Redundancy(Value):
    """Arm angle E1, Status and Turn.

    Attributes:
        e1: arm angle [rad]: that of the elbow about the shoulder-wrist line, from the arm with A3 = 0 in the
            same Status. NaN: not given.
        status: bit 0, the wrist is behind A1's x axis; bit 1, A4 < 0; bit 2, A6 <= 0. -1: not given.
        turn: bit i, A(i+1) < 0. -1: not given. An LBR does not need it: its joints turn less than once.

    Raises:
        LimitError: E1 is infinite, or Status or Turn has bits that do not exist.
    """

    e1: float = nan
    status: int = -1
    turn: int = -1

    def __post_init__(self) -> None:
        e1 = scalar(self.e1, "e1")
        if not isnan(e1):
            within(e1, "e1", -_LARGEST, _LARGEST, unit="rad")
        for name, value, last in (("status", self.status, 7), ("turn", self.turn, 127)):
            if not (isinstance(value, int) and -1 <= value <= last):
                raise LimitError(
                    f"{name} is {value!r}; allowed is 0 to {last}, or -1 for not given",
                    code=2,
                    parameter=name,
                    value=value,
                    allowed=f"[-1, {last}]",
                )
