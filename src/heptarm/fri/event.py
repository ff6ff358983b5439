"""What a client notices of a session, in words."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Kind(enum.Enum):
    """What an event is about."""

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
    """Something that happened in a session.

    Attributes:
        kind: what it is about.
        text: in words.
        at: the client's clock [ns].
    """

    kind: Kind
    text: str
    at: int
