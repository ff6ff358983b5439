"""Signals and frames of an FRI session, and their synchronisation with the virtual cabinet's IO image."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite

from heptarm.errors import CommandRejected
from heptarm.fri.protocol import messages as m
from heptarm.planning.seam import FriSignal, SignalType
from heptarm.sim.fri.settings import Event, FrameProvided, OutputWritten, Refused, SessionConfiguration
from heptarm.values.checks import Array


class SessionIo:
    """Signals and frames of one session.

    Attributes:
        signals: inputs and outputs by name, with their present values.
        frames: newest frames of the client by name.
        veto: returns why the cabinet refuses an output; empty if it accepts it.
    """

    def __init__(self, configuration: SessionConfiguration) -> None:
        self.signals: dict[str, m.IoValue] = {signal.name: signal for signal in configuration.signals}
        self.frames: dict[str, m.Transformation] = {}
        self.veto: Callable[[m.IoValue], str] = _accept_all
        self._requested = configuration.transformations

    def set(self, name: str, value: int | float) -> None:
        """Set a signal from the cabinet's side.

        Raises:
            CommandRejected: it is not registered, or cannot have that value.
        """
        signal = self.signals.get(name)
        if signal is None:
            raise CommandRejected(
                f"signal {name!r} is not registered in this session",
                parameter="name",
                value=name,
                allowed=", ".join(self.signals),
            )
        if not fits(signal.type, value):
            raise CommandRejected(
                f"{name} must be a {signal.type.name} value, got {value!r}", parameter="value", value=value
            )
        self.signals[name] = m.IoValue(name, signal.type, signal.direction, value)

    def requested(self, stamp: m.TimeStamp) -> tuple[m.Transformation, ...]:
        """The frames that the client has to provide."""
        return tuple(m.Transformation(name, (), stamp) for name in self._requested)

    def take(self, command: m.Command) -> list[Event]:
        """Take outputs and frames of a command; returns changes and refusals."""
        events = [self._write(value) for value in command.io]
        events += [self._provide(frame) for frame in command.transformations]
        return [event for event in events if event is not None]

    def _write(self, value: m.IoValue) -> Event | None:
        known = self.signals.get(value.name)
        if known is None:
            return Refused(f"the client writes {value.name!r}, which is not registered in this session")
        if known.type is not value.type or m.IoDirection.INPUT in (known.direction, value.direction):
            return Refused(
                f"the client writes {value.name!r}; it is {known.type.name} {known.direction.name}"
            )
        if not fits(value.type, value.value):
            return Refused(
                f"the client writes an illegal value to {value.name!r}: it must be {known.type.name}"
            )
        if known.value == value.value:
            return None
        why = self.veto(value)
        if why:
            return Refused(why)
        self.signals[value.name] = value
        return OutputWritten(value)

    def _provide(self, frame: m.Transformation) -> Event | None:
        if frame.name not in self._requested:
            return Refused(
                f"the client provides the frame {frame.name!r}, which is not registered in this session"
            )
        if not all(isfinite(value) for value in frame.values):
            return Refused(f"the client provides the frame {frame.name!r} with values that are not finite")
        before, self.frames[frame.name] = self.frames.get(frame.name), frame
        return None if before is not None and before.values == frame.values else FrameProvided(frame)


def _accept_all(value: m.IoValue) -> str:
    return ""


def fits(kind: m.IoType, value: int | float) -> bool:
    """Whether a signal of that type can have the value."""
    if kind is m.IoType.ANALOG:
        return isfinite(value)
    most = 1 if kind is m.IoType.BOOLEAN else 2**64 - 1
    return isinstance(value, int) and 0 <= value <= most


_SIGN = 1 << 64
#: FRI transmits no sign.
_TYPES = {
    SignalType.BOOLEAN: m.IoType.BOOLEAN,
    SignalType.UNSIGNED_INTEGER: m.IoType.DIGITAL,
    SignalType.INTEGER: m.IoType.DIGITAL,
    SignalType.ANALOG: m.IoType.ANALOG,
}


@dataclass(frozen=True, slots=True)
class SessionSignal:
    """A signal of a session.

    Attributes:
        name: "Group.Signal".
        type: FRI's type; a signed number is digital, its negative values wrap at 64 bits.
        is_output: the client may write it.
        place: index in the IO image.
        low: smallest value.
        high: largest value.
    """

    name: str
    type: m.IoType
    is_output: bool
    place: int
    low: float = -inf
    high: float = inf

    @classmethod
    def of(cls, signal: FriSignal) -> SessionSignal:
        """A signal as Java registers it."""
        return cls(signal.name, _TYPES[signal.type], signal.is_output, signal.place, signal.low, signal.high)

    def value(self, number: float) -> m.IoValue:
        """A value of the image as FRI transmits it."""
        direction = m.IoDirection.OUTPUT if self.is_output else m.IoDirection.INPUT
        value: int | float = number
        if self.type is m.IoType.BOOLEAN:
            value = int(number != 0.0)
        elif self.type is m.IoType.DIGITAL:
            value = round(number) % _SIGN
        return m.IoValue(self.name, self.type, direction, value)


class IoImageSync:
    """Synchronises a session's signals with the image; all calls come from the thread that ticks the plant.

    Args:
        signals: of the session.
        image: the IO image, shape (n,).
    """

    def __init__(self, signals: tuple[SessionSignal, ...], image: Array) -> None:
        self._signals, self._image = signals, image

    def update(self, exchange: SessionIo) -> None:
        """Copy the image to the session."""
        for signal in self._signals:
            value = signal.value(float(self._image[signal.place]))
            if exchange.signals[signal.name].value != value.value:
                exchange.signals[signal.name] = value

    def veto(self, written: m.IoValue, *, stopped: bool) -> str:
        """Why an output is refused; empty if it is accepted.

        Args:
            written: value of the client.
            stopped: an emergency stop is in force, during which a cabinet writes no outputs.
        """
        signal, number = self._found(written)
        if stopped:
            return f"{signal.name} is not written during an emergency stop"
        if signal.low <= number <= signal.high:
            return ""
        return f"{signal.name} must be in [{signal.low:g}, {signal.high:g}], got {number:g}"

    def write(self, written: m.IoValue) -> None:
        """Write an output of the client to the image."""
        signal, number = self._found(written)
        self._image[signal.place] = number

    def _found(self, written: m.IoValue) -> tuple[SessionSignal, float]:
        signal = next(signal for signal in self._signals if signal.name == written.name)
        number = float(written.value)
        if signal.low < 0.0 and signal.type is m.IoType.DIGITAL and number >= _SIGN / 2:
            number = float(int(written.value) - _SIGN)
        return signal, number
