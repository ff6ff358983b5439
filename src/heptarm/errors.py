"""Every error that heptarm raises.

::

    HeptarmError
    ├── ConnectFailed (ConnectionError)     no answer, refused, wrong key
    │   └── VersionMismatch                 the two sides speak different major versions
    ├── ConnectionLost (ConnectionError)    the session ended unexpectedly
    ├── ProtocolError
    │   ├── LocalProtocolError              this side violated the protocol: a bug
    │   └── RemoteProtocolError             the cabinet violated it
    ├── CommandRejected (ValueError)        refused before anything moved
    │   ├── ShapeError                      wrong shape or length
    │   ├── LimitError                      outside a range
    │   │   ├── Unreachable                 no joint position reaches the pose
    │   │   └── OutsideWorkspace            a command leaves `arm.workspace`
    │   ├── ModeConflict                    conflicts with what is running
    │   ├── CollisionForeseen               a collision model found bodies that would touch
    │   ├── NoPath                          no path was found around the bodies of a world
    │   ├── UnknownSetting (AttributeError) an object has no setting of that name
    │   └── NotInControl                    this client does not control the robot
    ├── MotionError                         a motion did not end as commanded; has its result
    │   ├── MotionAborted                   it was stopped early
    │   │   └── CollisionDetected           by a collision guard; `collision` has joint and torque
    │   ├── NoContact                       no contact was found
    │   ├── InsertionFailed                 a part did not go into its hole
    │   ├── GraspFailed                     a gripper was closed and holds nothing
    │   └── ArrivalError                    it ended short of its target
    ├── StreamError
    │   ├── Starved                         no target within the watchdog time
    │   └── QualityLost                     the connection became too slow
    ├── NotReady                            the robot cannot move now
    │   ├── NeedsOperator                   the operator must act; `instructions` has the steps
    │   └── SafetyStop                      a safety function is active
    ├── StaleState                          the newest state is too old or lacks a group
    ├── Timeout (TimeoutError)              it did not happen in time
    └── MissingExtra (ImportError)          an optional package is not installed

An error names what was refused, the value with its unit, the allowed range and the remedy.
"""

from __future__ import annotations

import errno
import importlib
import importlib.util
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

if sys.platform != "win32":
    from resource import RLIMIT_NOFILE, getrlimit

_Error = TypeVar("_Error", bound="HeptarmError")

#: Documentation of the codes.
_PAGE = "https://github.com/heptarm/heptarm/blob/main/docs/reference/errors.md"
#: The operating system.
_PLATFORM = sys.platform


class HeptarmError(Exception):
    """Base of all errors of heptarm.

    Args:
        text: what happened.
        code: number in the protocol's table of codes; 0 if it did not come over the wire.
        parameter: path of the refused field.
        value: the refused value.
        allowed: the allowed range or choices.
        hint: the remedy.
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
        self._place = ""
        self._black_box: Callable[[], Path | None] | None = None

    def __str__(self) -> str:
        """The text and, if there is one, the hint."""
        return f"{self.text} ({self.hint})" if self.hint else self.text

    @property
    def page(self) -> str:
        """Address of the documentation of its code: what it means, and what to do."""
        return f"{_PAGE}#code-{self.code}" if self.code else _PAGE

    @property
    def black_box(self) -> Path | None:
        """Recording of the last 30 s before the error, for `heptarm.load`; None: none was written.

        Errors that end a motion, safety stops and lost connections have one. Reading it waits until it is written,
        half a second at most for what happens after the error.
        """
        return None if self._black_box is None else self._black_box()

    def inside(self: _Error, place: str) -> _Error:
        """The same error, of an element: text and parameter name it.

        The elements that contain it put themselves before it, from the inside to the outside:
        `error.inside("segments[2]").inside("motions[1]")` is of `motions[1].segments[2]`.

        Args:
            place: the element, such as "segments[2]"; "": none, and the error stays as it is.
        """
        if place:
            said = self.text.removeprefix(f"{self._place}: ") if self._place else self.text
            self._place = ".".join(filter(None, (place, self._place)))
            self.text = f"{self._place}: {said}"
            self.args = (self.text,)
            self.parameter = ".".join(filter(None, (place, self.parameter)))
        return self

    def with_black_box(self: _Error, source: HeptarmError | Callable[[], Path | None] | None) -> _Error:
        """The same error with the black box of another error, or with one that a function returns."""
        self._black_box = source._black_box if isinstance(source, HeptarmError) else source
        return self


@contextmanager
def inside(place: str) -> Iterator[None]:
    """Name an element in the errors of a block; see `HeptarmError.inside`."""
    try:
        yield
    except HeptarmError as error:
        error.inside(place)
        raise


class ConnectFailed(HeptarmError, ConnectionError):
    """No session could be opened."""


class VersionMismatch(ConnectFailed):
    """The two sides speak different major versions of the protocol."""


class ConnectionLost(HeptarmError, ConnectionError):
    """The session ended unexpectedly."""


class ProtocolError(HeptarmError):
    """The protocol was violated."""


class LocalProtocolError(ProtocolError):
    """This side violated the protocol: a bug in the calling code."""


class RemoteProtocolError(ProtocolError):
    """The cabinet sent something that the protocol does not allow."""


class CommandRejected(HeptarmError, ValueError):
    """A request was refused before anything moved; nothing has changed."""


class ShapeError(CommandRejected):
    """Wrong shape, length or type."""


class LimitError(CommandRejected):
    """A value is outside its range."""


class Unreachable(LimitError):
    """No joint position reaches the pose."""


class OutsideWorkspace(LimitError):
    """A command leaves `arm.workspace`; it was not sent."""


class ModeConflict(CommandRejected):
    """The request conflicts with what is running."""


class CollisionForeseen(CommandRejected):
    """Bodies would touch, by the collision check of the arm or `keep_clear_of` of a servo stream; it was not sent.

    Attributes:
        touch: the bodies, and where on the path.
        motion: index of the motion in the program.
    """

    def __init__(self, text: str, *, touch: Any = None, motion: int = 0, **details: Any) -> None:
        super().__init__(text, **details)
        self.touch = touch
        self.motion = motion


class NoPath(CommandRejected):
    """No path was found around the bodies of a world; nothing moves.

    Attributes:
        reason: "start", "goal", "inverse kinematics", "constraint", "not connected", "time" or "torque"; of a pick
            or a place also "approach": bodies are in the way on the straight lines there.
        clearance: the two bodies that are in the way at the start or at the goal; None: not for this reason.
        states: joint positions that the search has reached.
        nearest: distance between what is reached from the start and from the goals [rad]; infinite: nothing was.
    """

    def __init__(
        self,
        text: str,
        *,
        reason: str = "",
        clearance: Any = None,
        states: int = 0,
        nearest: float = float("inf"),
        **details: Any,
    ) -> None:
        super().__init__(text, **details)
        self.reason, self.clearance, self.states, self.nearest = reason, clearance, states, nearest


class UnknownSetting(CommandRejected, AttributeError):
    """An object has no setting of this name, or it cannot be set; nothing was set."""


class NotInControl(CommandRejected):
    """This client does not control the robot."""


class MotionError(HeptarmError):
    """A motion did not end as commanded.

    Attributes:
        result: how it ended, with the cause and the last state.
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
    """The motion was stopped early, or could not be planned."""


class CollisionDetected(MotionAborted):
    """A collision guard stopped the motion.

    Attributes:
        collision: the joint and its torque; None if unknown.
    """

    def __init__(self, text: str, *, collision: Any = None, **details: Any) -> None:
        super().__init__(text, **details)
        self.collision = collision


class NoContact(MotionError):
    """A motion until contact ended without contact."""


class InsertionFailed(MotionError):
    """A part did not go into its hole.

    Attributes:
        depth: how deep it is behind the surface that it touched [m].
    """

    def __init__(self, text: str, *, depth: float = 0.0, **details: Any) -> None:
        super().__init__(text, **details)
        self.depth = depth


class GraspFailed(MotionError):
    """A gripper was closed and holds nothing."""


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
    """The operator must act at the smartPAD."""

    @property
    def instructions(self) -> str:
        """Steps for the operator."""
        return self.hint or self.text


class SafetyStop(NotReady):
    """A safety function is active."""


class StaleState(HeptarmError):
    """The newest state is too old to act on, or lacks a group."""


class Timeout(HeptarmError, TimeoutError):
    """Something did not happen in time."""


class MissingExtra(HeptarmError, ImportError):
    """An optional package is not installed."""


#: A class of an exception of Java, and the colon behind it.
_JAVA = re.compile(r"(?:\b[a-z]\w*\.)+[A-Z]\w*(?:Exception|Error)\b(?:: ?|(?=[\s.,;)]|$))")


def without_java(text: str) -> str:
    """A text without the names of Java's exceptions, which say nothing to people; empty if nothing is left."""
    return _JAVA.sub("", text).strip()


#: Packages that each extra of heptarm brings, as they are imported.
EXTRAS = {
    "sim": ("mujoco", "ruckig", "jpype"),
    "viz": ("viser", "matplotlib", "trimesh"),
    "rl": ("torch", "gymnasium", "PIL"),
    "record": ("mcap", "pandas", "pyarrow", "plotly"),
    "devices": ("evdev", "pyspacemouse"),
    "rerun": ("rerun",),
    "hdf5": ("h5py",),
    "vision": ("cv2", "scipy"),
    "ray": ("ray",),
}


def shortage(error: BaseException) -> str:
    """The remedy of an error of the system that lacks a file descriptor, a process or memory; "" of any other error."""
    match error.errno if isinstance(error, OSError) else None:
        case errno.EMFILE:
            most = "" if sys.platform == "win32" else f" {getrlimit(RLIMIT_NOFILE)[0]}"
            return (
                f"this program has all{most} files and sockets open that it may have: close what is not used any more, "
                "such as arms, FRI sessions and recordings, or allow more (ulimit -n)"
            )
        case errno.ENFILE:
            return "too many files are open on this machine: end programs, or allow more (sysctl fs.file-max)"
        case errno.EAGAIN:
            return "too many processes of this user run: end some, or allow more (ulimit -u)"
        case errno.ENOMEM | errno.ENOBUFS:
            return "this machine has no memory left: end programs"
        case _:
            return ""


@contextmanager
def system_errors(text: str, *, kind: type[HeptarmError] = HeptarmError) -> Iterator[None]:
    """Make errors of the system in a block, which opens files or sockets or starts a process, errors of heptarm.

    Args:
        text: what could not be done; the reason is put behind it.
        kind: class of the error.

    Raises:
        HeptarmError: of this kind; the hint is the remedy, if a resource is lacking.
    """
    try:
        yield
    except OSError as error:
        if isinstance(error, HeptarmError):
            raise
        raise kind(f"{text}: {(error.strerror or str(error)).lower()}", hint=shortage(error)) from error


def missing_extra(module: str) -> MissingExtra | None:
    """The error of a package that cannot be imported, if an extra of heptarm brings it; None for any other package."""
    root = module.partition(".")[0]
    for extra, names in EXTRAS.items():
        if root in names:
            return MissingExtra(
                f"this needs the package {root!r}, which is not installed",
                parameter=root,
                hint=f"pip install 'heptarm[{extra}]'",
            )
    return None


def require_extra(extra: str) -> None:
    """Check that all packages of an extra are installed, without importing them.

    Raises:
        MissingExtra: one is not; the hint is the command that installs it.
        HeptarmError: they cannot be looked for.
    """
    for name in EXTRAS[extra]:
        with system_errors(f"the package {name!r} cannot be looked for"):
            error = missing_extra(name) if importlib.util.find_spec(name) is None else None
        if error is not None:
            raise error


def refuse_windows(what: str) -> None:
    """Check that something that was written for Linux and macOS does not run on Windows.

    Raises:
        CommandRejected: this is Windows.
    """
    if _PLATFORM == "win32":
        raise CommandRejected(
            f"{what} runs on Linux, this is Windows",
            parameter="platform",
            value=_PLATFORM,
            hint="use WSL (wsl --install); a robot can be controlled from Windows, but not over FRI",
        )


def require(module: str, *, extra: str) -> Any:
    """Import a module of an optional extra.

    Raises:
        MissingExtra: it is not installed, or broken; the hint is the command that installs it.
    """
    try:
        return importlib.import_module(module)
    except (ImportError, OSError) as error:
        root = module.partition(".")[0]
        missing = isinstance(error, ModuleNotFoundError) and error.name == root
        reason = "is not installed" if missing else f"cannot be imported ({error})"
        raise MissingExtra(
            f"this needs the package {root!r}, which {reason}",
            parameter=root,
            hint=shortage(error) or f"pip install 'heptarm[{extra}]'",
        ) from error
