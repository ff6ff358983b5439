"""The signals of an FRI session and the virtual cabinet's IO image: each shows what the other has written."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any

from heptarm.fri import messages as m
from heptarm.values.arrays import Array
from heptarm.virtual.fri.exchange import Exchange

_SIGN = 1 << 64
#: FRI's types by the doubles' numbers; FRI tells no sign.
_TYPES = (m.IoType.BOOLEAN, m.IoType.DIGITAL, m.IoType.DIGITAL, m.IoType.ANALOG)


@dataclass(frozen=True, slots=True)
class SessionSignal:
    """A signal that a session carries.

    Attributes:
        name: "Group.Signal".
        type: as FRI has it; a number with a sign is digital, its negative values wrapped at 64 bits.
        is_output: the client may write it.
        place: in the IO image.
        low: its least value.
        high: its largest value.
    """

    name: str
    type: m.IoType
    is_output: bool
    place: int
    low: float = -inf
    high: float = inf

    @classmethod
    def of(cls, one: Any) -> SessionSignal:
        """That of a heptarm.doubles.FriSignal."""
        kind = _TYPES[int(one.type)]
        return cls(str(one.name), kind, bool(one.output), int(one.place), float(one.low), float(one.high))

    def value(self, number: float) -> m.IoValue:
        """A number of the image as FRI has it."""
        direction = m.IoDirection.OUTPUT if self.is_output else m.IoDirection.INPUT
        value: int | float = number
        if self.type is m.IoType.BOOLEAN:
            value = int(number != 0.0)
        elif self.type is m.IoType.DIGITAL:
            value = round(number) % _SIGN
        return m.IoValue(self.name, self.type, direction, value)


class Bridge:
    """Keeps a session's signals and the image equal; all calls come from the thread that ticks the plant.

    Args:
        signals: of the session.
        image: the IO image, shape (n,).
    """

    def __init__(self, signals: tuple[SessionSignal, ...], image: Array) -> None:
        self._signals, self._image = signals, image

    def show(self, exchange: Exchange) -> None:
        """Let the session show what the image has."""
        for one in self._signals:
            value = one.value(float(self._image[one.place]))
            if exchange.signals[one.name].value != value.value:
                exchange.signals[one.name] = value

    def veto(self, written: m.IoValue, *, stopped: bool) -> str:
        """Why an output cannot be written; empty if it can.

        Args:
            written: what the client writes.
            stopped: an emergency stop is in force, during which a cabinet writes nothing.
        """
        signal, number = self._found(written)
        if stopped:
            return f"{signal.name} is not written during an emergency stop"
        if signal.low <= number <= signal.high:
            return ""
        return f"{signal.name} cannot be {number:g}; it can be {signal.low:g} to {signal.high:g}"

    def write(self, written: m.IoValue) -> None:
        """Take an output that the client has written."""
        signal, number = self._found(written)
        self._image[signal.place] = number

    def _found(self, written: m.IoValue) -> tuple[SessionSignal, float]:
        signal = next(one for one in self._signals if one.name == written.name)
        number = float(written.value)
        if signal.low < 0.0 and signal.type is m.IoType.DIGITAL and number >= _SIGN / 2:
            number = float(int(written.value) - _SIGN)
        return signal, number
