"""Every error that heptarm raises.

::

    HeptarmError
    ├── ConnectFailed (ConnectionError)     nobody there, refused, wrong key
    │   └── VersionMismatch                 the two sides speak different major versions
    ├── ConnectionLost (ConnectionError)    the session ended under way
    ├── ProtocolError
    │   ├── LocalProtocolError              this side broke the protocol: a bug here
    │   └── RemoteProtocolError             the other side broke it
    ├── CommandRejected (ValueError)        refused before anything moved
    │   ├── ShapeError                      wrong shape or length
    │   ├── LimitError                      outside a range
    │   │   └── Unreachable                 no joint position leads there
    │   ├── ModeConflict                    does not go together with what is running
    │   └── NotInControl                    this client does not control the robot
    ├── MotionError                         a motion did not end as it should; carries its result
    │   ├── MotionAborted                   it was stopped under way
    │   │   └── CollisionDetected           by a collision guard; `collision` says which joint and how much
    │   ├── NoContact                       nothing was touched
    │   └── ArrivalError                    it ended short of its target
    ├── StreamError
    │   ├── Starved                         no target within the watchdog time
    │   └── QualityLost                     the connection became too slow
    ├── NotReady                            the robot cannot move now
    │   ├── NeedsOperator                   a person has to act; `instructions` says how
    │   └── SafetyStop                      a safety function is active
    ├── StaleState                          the newest state is too old to act on
    ├── Timeout (TimeoutError)              it did not happen in time
    └── MissingExtra (ImportError)          an optional package is not installed

An error says what was refused, the value, the allowed range and what to do.
"""

from __future__ import annotations

import importlib
from typing import Any


class HeptarmError(Exception):
    """Base of all errors of heptarm.

    Args:
        text: what happened, in words.
        code: number in the protocol's table of codes; 0 if it did not come over the wire.
        parameter: path of the refused field.
        value: the refused value.
        allowed: the legal range or the legal choices.
        hint: what to do.
    """

    def __init__(
        self,
        text: str,
        *,
        code: int = 0,
        parameter: str = "",
        value: object = "",
        allowed: str = "",
        hint: str = "",
    ) -> None:
        super().__init__(text)
        self.text = text
        self.code = code
        self.parameter = parameter
        self.value = value
        self.allowed = allowed
        self.hint = hint

    def __str__(self) -> str:
        """The text and, where there is one, the advice."""
        return f"{self.text} ({self.hint})" if self.hint else self.text


class ConnectFailed(HeptarmError, ConnectionError):
    """No session could be made."""


class VersionMismatch(ConnectFailed):
    """The two sides speak different major versions of the protocol."""


class ConnectionLost(HeptarmError, ConnectionError):
    """The session ended under way."""


class ProtocolError(HeptarmError):
    """The protocol was broken."""


class LocalProtocolError(ProtocolError):
    """This side tried something illegal: a bug in the calling code."""


class RemoteProtocolError(ProtocolError):
    """The other side sent something illegal."""


class CommandRejected(HeptarmError, ValueError):
    """Refused before anything moved; nothing has changed."""


class ShapeError(CommandRejected):
    """Wrong shape, length or type."""


class LimitError(CommandRejected):
    """A value is outside its range."""


class Unreachable(LimitError):
    """No joint position leads to the pose."""


class ModeConflict(CommandRejected):
    """Does not go together with what is running."""


class NotInControl(CommandRejected):
    """This client does not control the robot."""


class MotionError(HeptarmError):
    """A motion did not end as it should.

    Attributes:
        result: how it ended; carries the cause and the last state.
        history: the last states before the end, oldest first.
    """

    def __init__(self, text: str, *, result: Any = None, history: Any = (), **details: Any) -> None:
        super().__init__(text, **details)
        self.result = result
        self.history = tuple(history)

    @property
    def cause(self) -> Any:
        """Why the motion ended."""
        return None if self.result is None else self.result.cause

    @property
    def state(self) -> Any:
        """The state at its end."""
        return None if self.result is None else self.result.state


class MotionAborted(MotionError):
    """The motion was ended under way, or could not be planned."""


class CollisionDetected(MotionAborted):
    """A collision guard ended it.

    Attributes:
        collision: which joint, and how much; None if nothing is known of it.
    """

    def __init__(self, text: str, *, collision: Any = None, **details: Any) -> None:
        super().__init__(text, **details)
        self.collision = collision


class NoContact(MotionError):
    """Something was to be touched, and was not."""


class ArrivalError(MotionError):
    """The motion ended short of its target."""


class StreamError(HeptarmError):
    """A stream of targets failed."""


class Starved(StreamError):
    """No target arrived within the watchdog time."""


class QualityLost(StreamError):
    """The connection became too slow for the stream."""


class NotReady(HeptarmError):
    """The robot cannot move now."""


class NeedsOperator(NotReady):
    """A person at the smartPAD has to act."""

    @property
    def instructions(self) -> str:
        """What to do, in words."""
        return self.hint or self.text


class SafetyStop(NotReady):
    """A safety function is active."""


class StaleState(HeptarmError):
    """The newest state is too old to act on."""


class Timeout(HeptarmError, TimeoutError):
    """It did not happen in time."""


class MissingExtra(HeptarmError, ImportError):
    """An optional package is not installed."""


def require(module: str, *, extra: str) -> Any:
    """Import a module of an optional extra.

    Raises:
        MissingExtra: it is not installed, or broken; the hint is the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        root = module.partition(".")[0]
        missing = isinstance(error, ModuleNotFoundError) and error.name == root
        trouble = "is not installed" if missing else f"cannot be imported ({error})"
        raise MissingExtra(
            f"this needs {root!r}, which {trouble}",
            parameter=root,
            hint=f"pip install 'heptarm[{extra}]'",
        ) from error
