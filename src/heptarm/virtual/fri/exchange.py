"""What passes beside the motion: signals that the client reads and writes, frames that it provides."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite

from heptarm.errors import CommandRejected
from heptarm.fri import messages as m
from heptarm.virtual.fri.configuration import Configuration
from heptarm.virtual.fri.events import Event, FrameProvided, OutputWritten, Refused


class Exchange:
    """Signals and frames of one session.

    Attributes:
        signals: inputs and outputs by name, with their present values.
        frames: newest frames of the client by name.
        veto: says why the cabinet does not take an output; empty if it does.
    """

    def __init__(self, configuration: Configuration) -> None:
        self.signals: dict[str, m.IoValue] = {signal.name: signal for signal in configuration.signals}
        self.frames: dict[str, m.Transformation] = {}
        self.veto: Callable[[m.IoValue], str] = _takes_all
        self._wanted = configuration.transformations

    def set(self, name: str, value: int | float) -> None:
        """Give a signal another value, as the cabinet's side.

        Raises:
            CommandRejected: it is not registered, or cannot have that value.
        """
        signal = self.signals.get(name)
        if signal is None:
            raise CommandRejected(
                f"no signal {name!r} is registered in this session",
                parameter="name",
                value=name,
                allowed=", ".join(self.signals),
            )
        if not fits(signal.type, value):
            raise CommandRejected(
                f"{name} is {signal.type.name}; it cannot be {value!r}", parameter="value", value=value
            )
        self.signals[name] = m.IoValue(name, signal.type, signal.direction, value)

    def requested(self, stamp: m.TimeStamp) -> tuple[m.Transformation, ...]:
        """The frames that the client is asked for."""
        return tuple(m.Transformation(name, (), stamp) for name in self._wanted)

    def take(self, command: m.Command) -> list[Event]:
        """Take outputs and frames of a command; returns what changed and what was refused."""
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
            return Refused(f"the client writes {value.name!r}, which is {known.type.name}, an illegal value")
        if known.value == value.value:
            return None
        why = self.veto(value)
        if why:
            return Refused(why)
        self.signals[value.name] = value
        return OutputWritten(value)

    def _provide(self, frame: m.Transformation) -> Event | None:
        if frame.name not in self._wanted:
            return Refused(
                f"the client provides the frame {frame.name!r}, which is not registered in this session"
            )
        if not all(isfinite(value) for value in frame.values):
            return Refused(f"the client provides the frame {frame.name!r} with numbers that are not finite")
        before, self.frames[frame.name] = self.frames.get(frame.name), frame
        return None if before is not None and before.values == frame.values else FrameProvided(frame)


def _takes_all(value: m.IoValue) -> str:
    return ""


def fits(kind: m.IoType, value: int | float) -> bool:
    """Whether a signal of that type can have the value."""
    if kind is m.IoType.ANALOG:
        return isfinite(value)
    most = 1 if kind is m.IoType.BOOLEAN else 2**64 - 1
    return isinstance(value, int) and 0 <= value <= most
