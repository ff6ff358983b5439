"""What an FRI session tells the application that opened it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from heptarm.fri.messages import IoValue, Quality, SessionState, Transformation


@dataclass(frozen=True, slots=True)
class StateChanged:
    """The session has another state."""

    state: SessionState
    before: SessionState


@dataclass(frozen=True, slots=True)
class QualityChanged:
    """The connection has another quality.

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
    """The overlay acts no more; whatever motion it lay on has to end, too.

    Attributes:
        cause: "cancelled" by the application, "closed" with the session, or an error: "quality", "limit", "field",
            "synchronisation", "safety".
        text: of an error, of the kind that the smartPAD shows; empty without one.
    """

    cause: str
    text: str

    @property
    def is_error(self) -> bool:
        """Whether the motion under the overlay fails by it."""
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
    """A datagram, or a part of one, was not taken; told once for each kind."""

    text: str


Event: TypeAlias = StateChanged | QualityChanged | OverlayEnded | OutputWritten | FrameProvided | Refused
