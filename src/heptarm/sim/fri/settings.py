"""Configuration of an FRI session, and the events that it reports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from heptarm.errors import CommandRejected, LimitError
from heptarm.fri.protocol.messages import (
    MAX_IO,
    MAX_NAME,
    MAX_TRANSFORMATIONS,
    IoValue,
    Quality,
    SessionState,
    Transformation,
)
from heptarm.fri.protocol.version import Version

#: Legal periods [ms], of sending and of receiving.
PERIODS = (1, 100)


@dataclass(frozen=True, slots=True)
class SessionConfiguration:
    """Configuration of one session, as the application sets it up.

    Args:
        version: wire format.
        period_ms: time between two monitoring messages [ms], 1 to 100.
        multiplier: the client answers every n-th message; period times multiplier is at most 100 ms.
        signals: inputs and outputs of the client, with their initial values; from 1.14 on, at most 10.
        transformations: names of the frames that the client provides, at most 5.

    Raises:
        LimitError: a period or a multiplier is out of range.
        CommandRejected: too many signals or frames, a name that FRI cannot transmit, or one twice.
    """

    version: Version
    period_ms: int = 1
    multiplier: int = 1
    signals: tuple[IoValue, ...] = ()
    transformations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        low, high = PERIODS
        if not low <= self.period_ms <= high:
            raise LimitError(
                f"period_ms must be in [{low}, {high}] ms, got {self.period_ms}",
                parameter="period_ms",
                value=self.period_ms,
                allowed=f"[{low}, {high}] ms",
            )
        if self.multiplier < 1 or self.receive_ms > high:
            raise LimitError(
                f"multiplier must be in [1, {high // self.period_ms}] with a period of {self.period_ms} ms, got "
                f"{self.multiplier}: the receive period would be {self.receive_ms} ms, allowed are {low} to {high} ms",
                parameter="multiplier",
                value=self.multiplier,
                allowed=f"[1, {high // self.period_ms}]",
            )
        self._check_names()

    def _check_names(self) -> None:
        if self.signals and not self.version.traits.io:
            raise CommandRejected(
                f"FRI {self.version.value} has no signals",
                parameter="signals",
                hint="use FRI 1.14 or later, or no signals",
            )
        names = [signal.name for signal in self.signals]
        for what, found, most in (
            ("signals", names, MAX_IO),
            ("transformations", list(self.transformations), MAX_TRANSFORMATIONS),
        ):
            if len(found) > most:
                raise CommandRejected(f"{what}: at most {most} allowed, got {len(found)}", parameter=what)
            for name in found:
                if not 0 < len(name.encode()) <= MAX_NAME or found.count(name) > 1:
                    raise CommandRejected(
                        f"{what}: names must be unique and of 1 to {MAX_NAME} bytes, got {name!r}",
                        parameter=what,
                        value=name,
                    )

    @property
    def receive_ms(self) -> int:
        """Receive period: time between two answers of the client [ms]."""
        return self.period_ms * self.multiplier


@dataclass(frozen=True, slots=True)
class StateChanged:
    """The session has changed its state."""

    state: SessionState
    before: SessionState


@dataclass(frozen=True, slots=True)
class QualityChanged:
    """The connection has changed its quality.

    Attributes:
        quality: the new one.
        before: the old one.
        latency: mean time to an answer [s].
        jitter: its mean change from one answer to the next [s].
    """

    quality: Quality
    before: Quality
    latency: float
    jitter: float


@dataclass(frozen=True, slots=True)
class OverlayEnded:
    """The overlay has ended; the motion under it has to end, too.

    Attributes:
        cause: "cancelled" by the application, "closed" with the session, or an error: "quality", "limit", "field",
            "synchronisation", "safety".
        text: of an error, like a message of the smartPAD; empty without one.
    """

    cause: str
    text: str

    @property
    def is_error(self) -> bool:
        """Whether the motion under the overlay fails."""
        return self.cause not in ("cancelled", "closed")


@dataclass(frozen=True, slots=True)
class OutputWritten:
    """The client has set an output to another value."""

    value: IoValue


@dataclass(frozen=True, slots=True)
class FrameProvided:
    """The client has sent one of the frames that it provides."""

    transformation: Transformation


@dataclass(frozen=True, slots=True)
class Refused:
    """A datagram, or a part of one, was refused; reported once for each kind."""

    text: str


Event: TypeAlias = StateChanged | QualityChanged | OverlayEnded | OutputWritten | FrameProvided | Refused


def describe(event: Event) -> str:
    """An event in one line for a person; empty for events that happen too often to report."""
    if isinstance(event, StateChanged):
        return f"session {event.before.name} -> {event.state.name}"
    if isinstance(event, QualityChanged):
        return (
            f"quality {event.before.name} -> {event.quality.name} "
            f"(latency {1e3 * event.latency:.2f} ms, jitter {1e3 * event.jitter:.2f} ms)"
        )
    if isinstance(event, OverlayEnded):
        return f"overlay ended: {event.text or event.cause}"
    if isinstance(event, OutputWritten):
        return f"output {event.value.name} = {event.value.value:g}"
    if isinstance(event, FrameProvided):
        frame = event.transformation
        return f"frame {frame.name} = {', '.join(f'{value:g}' for value in frame.values)}"
    return event.text if isinstance(event, Refused) else ""
