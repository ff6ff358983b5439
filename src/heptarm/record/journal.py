"""What happened on a connection besides pushed states: requests, answers, events, errors, notes, FRI sessions."""

from __future__ import annotations

import enum
import json
import math
from collections import deque
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from types import NoneType
from typing import Any, NamedTuple, TypeAlias, get_args, get_type_hints

from heptarm.fri.loop.telemetry import Reader
from heptarm.wire import messages as wire

#: Kinds of entries.
REQUEST, REFUSAL, EVENT, ERROR, NOTE, FRI = "request", "refusal", "event", "error", "note", "fri"
CORRECTION = "correction"
#: Entries that are kept for the black box, their age [ns], and entries that a slow recorder may leave waiting.
KEPT, KEPT_TIME, WAITING = 5_000, 31_000_000_000, 100_000


class JournalEntry(NamedTuple):
    """Something that happened.

    Attributes:
        time: our clock [ns].
        kind: "request": the cabinet has accepted one; "refusal": it has refused one; "event": from the cabinet;
            "error": what went wrong on this side; "note": the user's; "fri": a message of an FRI session's loop;
            "correction": where a person's correction of a policy begins or ends.
        content: a message of the protocol, or a text.
        id: number under which the cabinet accepted a request; 0 elsewhere.
    """

    time: int
    kind: str
    content: Any
    id: int = 0

    @property
    def name(self) -> str:
        """Name of the message; for a text the kind."""
        return self.kind if isinstance(self.content, str) else type(self.content).__name__

    @property
    def text(self) -> str:
        """One line for people."""
        if isinstance(self.content, str):
            return self.content
        data = plain(self.content)
        if self.name == "Run":
            return f"motion {self.id}: {describe(self.content)}"
        if self.kind == REQUEST and self.id:
            return f"{self.name} {self.id}"
        text = data.pop("text", "")
        hidden = ("type", "code", "q") if not data.get("code") else ("type", "q")
        said = ", ".join(
            f"{name} {_short(value)}"
            for name, value in data.items()
            if name not in hidden and value is not None and not isinstance(value, dict)
        )
        return f"{self.name}: {', '.join(part for part in (said, text) if part)}"[:500]

    @property
    def level(self) -> str:
        """How serious it is: "info", "warning" or "error"."""
        severity = getattr(self.content, "severity", None)
        if isinstance(severity, wire.Severity):
            return severity.name.lower()
        if self.kind in (ERROR, REFUSAL):
            return "error"
        if isinstance(self.content, wire.MotionFinished):
            good = (wire.Cause.FINISHED, wire.Cause.CANCELLED, wire.Cause.CONDITION, wire.Cause.REPLACED)
            return "info" if self.content.cause in good else "error"
        return "warning" if isinstance(self.content, wire.SafetyChanged) else "info"

    @property
    def data(self) -> str:
        """Everything as JSON, for the file."""
        content = {"text": self.content} if isinstance(self.content, str) else plain(self.content)
        entry = {"kind": self.kind, "name": self.name, "id": self.id, "text": self.text, "content": content}
        return json.dumps(entry, ensure_ascii=False, allow_nan=False)


def plain(value: Any) -> Any:
    """A message as plain data: enumerations by name, NaN and infinite numbers as null."""
    if isinstance(value, enum.Enum):
        return value.name.lower() if value.name else int(value.value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, bytes):
        return value.hex()
    if is_dataclass(value) and not isinstance(value, type):
        found = {field.name: plain(getattr(value, field.name)) for field in fields(value)}
        return {"type": type(value).__name__, **found}
    if isinstance(value, (list, tuple)):
        return [plain(element) for element in value]
    return value


def restored(content: Any, kind: Any) -> Any:
    """The message that `plain` made plain data of; a number that is null is NaN.

    Args:
        content: the plain data, from a file.
        kind: class of the message, or the type of a field.

    Raises:
        ValueError: it is none, or has what this version does not know.
    """
    if is_dataclass(kind):
        return _restored_message(content, kind)
    members = get_args(kind)
    if members and isinstance(content, list):
        return tuple(restored(element, members[0]) for element in content)
    if members:  # a union
        if content is None and NoneType in members:
            return None
        name = content.get("type") if isinstance(content, dict) else content
        for member in members:
            if getattr(member, "__name__", "") == name:
                return restored(content, member)
        raise ValueError(f"{name!r} is not known")
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return _restored_word(content, kind)
    if kind is float and content is None:
        return math.nan
    if kind is bytes and isinstance(content, str):
        return bytes.fromhex(content)
    wanted = (int, float) if kind is float else kind
    if not isinstance(content, wanted) or (kind is not bool and isinstance(content, bool)):
        raise ValueError(f"{kind.__name__} expected, got {content!r}")
    return float(content) if kind is float else content


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _restored_message(content: Any, kind: Any) -> Any:
    if not isinstance(content, dict):
        raise ValueError(f"{kind.__name__} expected, got {content!r}")
    known = {field.name: field for field in fields(kind)}
    unknown = content.keys() - known.keys() - {"type"}
    if unknown:
        raise ValueError(f"{kind.__name__} has an unknown field {min(unknown)!r}")
    missing = [name for name, field in known.items() if field.default is MISSING and name not in content]
    if missing:
        raise ValueError(f"{kind.__name__} lacks {missing[0]!r}")
    hints = _hints(kind)
    return kind(**{name: restored(content[name], hints[name]) for name in known if name in content})


def _restored_word(content: Any, kind: type[enum.Enum]) -> Any:
    """A member of an enumeration by its name, or flags by theirs; a flag without a name is a number."""
    if isinstance(content, int):
        return kind(content)
    words = str(content).upper().split("|")
    if any(word not in kind.__members__ for word in words):
        raise ValueError(f"{kind.__name__} {content!r} is not known")
    found = kind[words[0]]
    for word in words[1:]:
        found |= kind[word]  # type: ignore[operator]
    return found


def describe(message: wire.Run) -> str:
    """The motions of a program in a few words, such as "Ptp, 3 Lin"."""
    names = [type(item.motion).__name__ for item in message.items]
    runs: list[list[Any]] = []
    for name in names:
        if runs and runs[-1][0] == name:
            runs[-1][1] += 1
        else:
            runs.append([name, 1])
    return ", ".join(name if count == 1 else f"{count} {name}" for name, count in runs)


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return f"[{' '.join(_short(element) for element in value)}]"
    return str(value)


#: What a JournalEntry is made of. A plain tuple takes half the time, and every request adds one.
Record: TypeAlias = tuple[int, str, Any, int]


class Journal:
    """Entries of a connection, the newest kept in memory; and the FRI sessions that are open.

    Args:
        clock: reads our clock [ns].

    Attributes:
        sessions: what reads the cycles of the open FRI sessions.
    """

    def __init__(self, clock: Callable[[], int]) -> None:
        self._clock = clock
        self._kept: deque[Record] = deque(maxlen=KEPT)
        self._queues: tuple[deque[Record], ...] = ()
        self.sessions: tuple[Reader, ...] = ()

    def add(self, kind: str, content: Any, number: int = 0, *, at: int | None = None) -> None:
        """Add an entry of a time of our clock [ns], None: now; costs a microsecond, blocks never."""
        time = self._clock() if at is None else at
        record = time, kind, content, number
        kept = self._kept
        kept.append(record)
        while kept[0][0] < time - KEPT_TIME:  # programs of a thousand motions are large
            kept.popleft()
        for queue in self._queues:
            queue.append(record)

    def since(self, time: int) -> list[JournalEntry]:
        """The kept entries from a time of our clock on [ns], oldest first."""
        return [JournalEntry(*entry) for entry in list(self._kept) if entry[0] >= time]

    def open(self) -> deque[Record]:
        """A queue that receives every entry from now on, as `Record`; its reader takes them from the left."""
        queue: deque[Record] = deque(maxlen=WAITING)
        self._queues = (*self._queues, queue)
        return queue

    def close(self, queue: deque[Record]) -> None:
        """End a queue."""
        self._queues = tuple(other for other in self._queues if other is not queue)

    def begin_session(self, reader: Reader) -> None:
        """Note an FRI session, whose cycles are recorded from now on."""
        self.sessions = (*self.sessions, reader)

    def end_session(self, reader: Reader) -> None:
        """Note the end of an FRI session; a recorder still takes its last cycles."""
        self.sessions = tuple(session for session in self.sessions if session is not reader)
