"""Events of a session."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Kind(enum.Enum):
    """Subject of an event."""

    STATE = "state"
    QUALITY = "quality"
    VERSION = "version"
    WRONG_VERSION = "wrong version"
    MALFORMED = "malformed"
    LOST = "lost"
    DUPLICATED = "duplicated"
    REORDERED = "reordered"
    RESTARTED = "restarted"
    COMMAND_MODE = "command mode"
    SAFETY = "safety"
    NO_IPO = "no interpolator position"
    CLIENT = "client"


@dataclass(frozen=True, slots=True)
class Event:
    """Event of a session.

    Attributes:
        kind: subject.
        text: description.
        at: time of the client's clock [ns].
    """

    kind: Kind
    text: str
    at: int
