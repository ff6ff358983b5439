"""A recording read back from its file, and figures of it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import numpy.typing as npt

from heptarm.errors import CommandRejected, require
from heptarm.record.layout import FRI_CYCLE, STATE, RowLayout, image_data
from heptarm.record.mcap_file import ARM, BEGIN, END
from heptarm.record.pictures import Pictures
from heptarm.record.plot import Chart, chart_of
from heptarm.record.plot.content import Style
from heptarm.record.plot.signals import Kind
from heptarm.record.recorded import FRI, RecordedData, RecordedEvent, RecordedMotion, RecordedNumbers
from heptarm.record.samples import signals_of
from heptarm.values.checks import Array, flag, frozen, instance, shown
from heptarm.values.files import open_regular, path_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MAGIC = b"\x89MCAP0\r\n"
#: Largest chunk that is unpacked [bytes]; heptarm writes chunks of up to some megabytes.
_LARGEST_CHUNK = 2**28
#: Fields of rows that are no signals of their own.
_HIDDEN = ("received",)


@dataclass(frozen=True, eq=False, repr=False)
class Recording(RecordedData):
    """A recording in memory; made by `load`.

    `run["q"]` is the array of a signal, `run.names` lists them. Time zero is the first pushed state; times are the
    cabinet's, so that a simulator that runs faster has its own seconds.

    Attributes:
        path: the file.
        facts: texts about robot and connection: "robot", "software", "cabinet", "rate", ...
        signals: arrays by name; those of pushed states have as many rows as `t`, those that begin with "fri." as many
            as "fri.t".
        motions: programs in the order of their beginning.
        events: what happened, in order.
        complete: the file has its end; otherwise it was cut off, and what is here is all up to its last whole chunk.
        lost: states and FRI cycles that could not be recorded; only known of a complete file.
        damage: where and how the file is damaged; what is here is all before that. Empty: it is not.
        pictures: of a simulated camera, if there was one.
        views: pictures of the cameras of an episode, by their names.
        streams: numbers of the streams of an episode, by their names.
        outcome: texts of the end of a complete file.
    """

    def chart(self, *signals: str, kind: Kind = "time") -> Chart:
        """A chart to be written, also as an interactive page: `run.chart("q", "wrench").save("run.html")`.

        Args:
            signals: names as in `names`, or "path"; none: the usual ones.
            kind: "time"; "histogram": fraction of the samples at each value; "spectrum": amplitude spectral density.

        Raises:
            CommandRejected: no such signal, or nothing to draw.
        """
        return chart_of(self, signals=signals, kind=kind)

    def plot(self, *signals: str, kind: Kind = "time", style: Style = "screen") -> Figure:
        """A Matplotlib figure of signals over time, with motions and events. See `heptarm plot`.

        Args:
            signals: names as in `names`, or "path"; none: the usual ones.
            kind: as in `chart`.
            style: "screen"; "paper": one column of a journal.

        Raises:
            CommandRejected: no such signal, or nothing to draw.
            MissingExtra: Matplotlib is not installed.
        """
        return self.chart(*signals, kind=kind).figure(style=style)


# ------------------------------------------------------------------------------------------------ reading


@dataclass
class _Content:
    """What was read from a file so far."""

    facts: dict[str, str] = field(default_factory=dict)
    end: dict[str, str] | None = None
    layouts: dict[int, RowLayout] = field(default_factory=dict)
    topics: dict[int, str] = field(default_factory=dict)
    payloads: dict[str, list[bytes]] = field(
        default_factory=lambda: {STATE.full_name: [], FRI_CYCLE.full_name: []}
    )
    published: list[int] = field(default_factory=list)
    cycled: list[int] = field(default_factory=list)
    entries: list[tuple[int, str, bytes]] = field(default_factory=list)
    pictures: list[tuple[int, bytes]] = field(default_factory=list)
    views: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    streams: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    arm: str = ""
    arms: list[str] = field(default_factory=list)
    earliest: int | None = None


def load(path: str | Path, *, arm: str = "", damaged: bool = False) -> Recording:
    """Read a recording; one that was cut off is read to its last whole chunk.

    Args:
        path: the file.
        arm: which one, in a recording of several arms. Time zero is then the first pushed state of all of them.
        damaged: of a damaged file, read what is before the damage; otherwise it is refused.

    Raises:
        CommandRejected: the file cannot be read, or is no recording of heptarm, or has no such arm. Or it is damaged:
            the text has the place, and how much is before it.
        MissingExtra: the package mcap is not installed.
    """
    where = path_of(path)
    content = _Content(arm=instance(arm, str, "arm"))
    flag(damaged, "damaged")
    with open_regular(where) as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise _no_recording(where, "it does not begin as an MCAP file does")
        damage = _read(file, content)
    if not content.facts and damage:
        raise _no_recording(where, f"it is damaged {damage}, before its description of the robot")
    if (arm or content.arms) and arm not in content.arms:
        known = ", ".join(content.arms) or "none: the recording is of a single arm"
        raise CommandRejected(
            f"arm must be one of {known}, got {shown(arm)}", parameter="arm", value=arm, allowed=known
        )
    if not content.facts:
        raise _no_recording(where, "it has no description of the robot")
    try:
        found = replace(_recording(where, content), damage=damage)
    except Exception as error:  # its chunks are whole, their content is not what heptarm writes
        raise _no_recording(where, f"its content cannot be read: {error or type(error).__name__}") from error
    if damage and not damaged:
        raise CommandRejected(
            f"{where} is damaged {damage}; before that are {len(found)} states, {found.duration:.2f} s",
            parameter="path",
            value=str(where),
            hint="load(path, damaged=True) reads what is before the damage",
        )
    return found


def _no_recording(path: Path, why: str) -> CommandRejected:
    return CommandRejected(
        f"{path} must be a recording of heptarm: {why}",
        parameter="path",
        value=str(path),
        hint="record one with arm.record(...) or heptarm record",
    )


class _Bounded:
    """A file of which nobody reads more than there is, however much a length in it claims."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._left = file, size

    def read(self, count: int) -> bytes:
        """Up to so many bytes; fewer only at the end."""
        data = self._file.read(min(count, self._left))
        self._left -= len(data)
        return data


def _read(file: BinaryIO, content: _Content) -> str:
    """Take all records up to the end, or to where the file was cut off or is damaged.

    Returns:
        Where and how it is damaged; empty: it is whole, or was cut off.
    """
    reader = require("mcap.stream_reader", extra="record")
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - len(_MAGIC)))
    has_end = size > 2 * len(_MAGIC) and file.read() == _MAGIC
    file.seek(0)
    stream = reader.StreamReader(_Bounded(file, size), emit_chunks=True, record_size_limit=size)
    place = 0
    try:
        for record in stream.records:
            if type(record).__name__ == "Chunk":
                for message in _of_chunk(reader, record):
                    _take(message, content)
            else:
                _take(record, content)
            if type(record).__name__ == "DataEnd":
                break  # behind it are indices, which nobody needs here
            place = file.tell()
    except Exception as error:  # of any decoder over any bytes
        if has_end:
            return f"at byte {place} of {size}: {' '.join(str(error).split()) or type(error).__name__}"
    return ""


def _of_chunk(reader: Any, chunk: Any) -> list[Any]:
    """The records of a chunk.

    Raises:
        ValueError: it is too large, or its check sum is wrong.
        Exception: of its decoders.
    """
    size = chunk.uncompressed_size
    if size > _LARGEST_CHUNK:
        raise ValueError(f"a chunk of {size} bytes is larger than {_LARGEST_CHUNK} bytes")
    if chunk.compression == "zstd":
        claimed = require("zstandard", extra="record").frame_content_size(chunk.data)
        if claimed > size:
            raise ValueError(f"a chunk of {size} bytes claims to have {claimed}")
    elif chunk.compression not in ("", "lz4"):
        raise ValueError(f"the compression {shown(chunk.compression)} is unknown")
    return list(reader.breakup_chunk(chunk, validate_crc=True))


def _take(record: Any, content: _Content) -> None:
    kind = type(record).__name__
    prefix = f"/{content.arm}" if content.arm else ""
    if kind == "Message":
        topic = content.topics.get(record.channel_id, "")
        if topic.endswith("/state"):
            at = record.publish_time
            content.earliest = at if content.earliest is None else min(content.earliest, at)
        if topic == f"{prefix}/state":
            content.payloads[STATE.full_name].append(record.data)
            content.published.append(record.publish_time)
        elif topic == f"{prefix}/fri":
            content.payloads[FRI_CYCLE.full_name].append(record.data)
            content.cycled.append(record.publish_time)
        elif topic == f"{prefix}/camera/image":
            content.pictures.append((record.publish_time, image_data(record.data)))
        elif topic.startswith(f"{prefix}/camera/") and topic.endswith("/image"):
            name = topic.removeprefix(f"{prefix}/camera/").removesuffix("/image")
            content.views.setdefault(name, []).append((record.publish_time, image_data(record.data)))
        elif topic.startswith(f"{prefix}/stream/"):
            name = topic.removeprefix(f"{prefix}/stream/")
            content.streams.setdefault(name, []).append((record.publish_time, record.data))
        elif topic in (f"{prefix}/journal", f"{prefix}/signals"):
            content.entries.append((record.publish_time, topic.removeprefix(prefix), record.data))
    elif kind == "Channel":
        content.topics[record.id] = record.topic
        own = {f"{prefix}/state": STATE.full_name, f"{prefix}/fri": FRI_CYCLE.full_name}
        if "layout" in record.metadata and record.topic in own:
            content.layouts[record.id] = RowLayout.of_text(own[record.topic], record.metadata["layout"])
    elif kind == "Metadata" and record.name == BEGIN:
        name = record.metadata.get(ARM, "")
        content.arms += [name] if name and name not in content.arms else []
        if name == content.arm:
            content.facts = dict(record.metadata)
    elif kind == "Metadata" and record.name == END:
        content.end = dict(record.metadata)


@dataclass(frozen=True)
class _TimeLine:
    """Times of a recording: nanoseconds since 1970 to the cabinet's seconds since the first state."""

    published: npt.NDArray[np.float64]
    t: Array
    rate: float

    def __call__(self, nanos: npt.ArrayLike) -> Array:
        """Convert times [ns] to [s]; before and behind the states by the rate of the cabinet's clock."""
        given = np.asarray(nanos, dtype=np.float64)
        if not len(self.t):
            return given * 1e-9
        inside = np.interp(given, self.published, self.t)
        early, late = given - self.published[0], given - self.published[-1]
        outside = np.where(early < 0, early, np.where(late > 0, late, 0.0))
        return np.asarray(inside + outside * 1e-9 * self.rate)


def _recording(path: Path, content: _Content) -> Recording:
    layouts = {layout.full_name: layout for layout in content.layouts.values()}
    states = layouts.get(STATE.full_name, STATE).read(content.payloads[STATE.full_name])
    signals: dict[str, npt.NDArray[Any]] = {}
    stamps = states["stamp"]
    t = (stamps - stamps[0]) * 1e-9 if len(stamps) else np.zeros(0)
    published = np.array(content.published, dtype=np.float64)
    order, rate = np.argsort(published, kind="stable"), float(content.facts.get("clock_rate", "1"))
    if len(t) and content.earliest is not None:  # of several arms: zero is the first state of all
        t = t + (content.published[0] - content.earliest) * 1e-9 * rate
    line = _TimeLine(published[order], t[order], rate)
    if not len(t) and content.cycled:  # of an FRI client: zero is its first cycle
        cycled = np.array(content.cycled, dtype=np.float64)
        line = _TimeLine(cycled, (cycled - cycled[0]) * 1e-9, 1.0)
    signals["t"] = t
    signals |= signals_of(states)
    if content.cycled:
        cycles = layouts.get(FRI_CYCLE.full_name, FRI_CYCLE).read(content.payloads[FRI_CYCLE.full_name])
        signals[f"{FRI}t"] = line(content.cycled)
        signals |= {
            f"{FRI}{name}": signal for name, signal in signals_of(cycles).items() if name not in _HIDDEN
        }
    events = tuple(_events(content.entries, line))
    return Recording(
        path,
        content.facts,
        signals,
        tuple(_motions(events, signals)),
        events,
        complete=content.end is not None,
        lost=int((content.end or {}).get("lost", 0)),
        pictures=_pictures(
            content.pictures, line, dropped=int((content.end or {}).get("pictures_dropped", 0))
        ),
        views={name: _pictures(found, line) for name, found in content.views.items()},
        streams={name: _numbers(name, found, line) for name, found in content.streams.items()},
        outcome=content.end or {},
    )


def _pictures(found: Sequence[tuple[int, bytes]], line: _TimeLine, *, dropped: int = 0) -> Pictures:
    times = line([at for at, _ in found]) if found else frozen(np.zeros(0))
    return Pictures(times, tuple(data for _, data in found), dropped)


def _numbers(name: str, found: Sequence[tuple[int, bytes]], line: _TimeLine) -> RecordedNumbers:
    rows = [json.loads(data)["values"] for _, data in found]
    sizes = dict.fromkeys(map(len, rows))
    if len(sizes) > 1:
        raise ValueError(
            f"the stream {name} must have as many numbers each time, got {' and '.join(map(str, sizes))}"
        )
    return RecordedNumbers(line([at for at, _ in found]), np.array(rows, dtype=np.float64))


def _events(entries: Sequence[tuple[int, str, bytes]], line: _TimeLine) -> Iterator[RecordedEvent]:
    times = line([at for at, _, _ in entries]) if entries else np.zeros(0)
    for (_, topic, data), t in sorted(zip(entries, times.tolist()), key=lambda pair: pair[1]):
        content = json.loads(data)
        if topic == "/signals":
            yield RecordedEvent(t, "signals", "Signals", _signals_text(content), content)
        else:
            yield RecordedEvent(
                t, content["kind"], content["name"], content["text"], content["content"], content["id"]
            )


def _signals_text(content: Mapping[str, Any]) -> str:
    parts = [f"{name} = {value:g}" for name, value in content.get("io", {}).items()]
    if "mode" in content:
        mode, tool = content["mode"].get("mode", {}), content["mode"].get("tool", "")
        parts.append(f"control mode {mode.get('type', '?') if isinstance(mode, dict) else mode}")
        parts += [f"tool {tool}"] if tool else []
    return ", ".join(parts)


def _motions(
    events: Sequence[RecordedEvent], signals: Mapping[str, npt.NDArray[Any]]
) -> Iterator[RecordedMotion]:
    """Programs: of their events, and of the states where those of another client have none."""
    texts: dict[int, str] = {}
    begins: dict[int, float] = {}
    ends: dict[int, RecordedEvent] = {}
    for event in events:
        if event.kind == "request" and event.name in ("Run", "ServoOpen", "FriOpen"):
            texts[event.id] = (
                event.text.partition(": ")[2] if event.name == "Run" else event.name.removesuffix("Open")
            )
        elif event.name == "MotionStarted":
            begins.setdefault(int(event.content["id"]), event.t)
        elif event.name == "MotionFinished":
            ends[int(event.content["id"])] = event
    ids, t = signals.get("motion", np.zeros(0, int)), signals["t"]
    for number in np.unique(ids[ids > 0]).tolist():
        seen = t[ids == number]
        begins[number] = min(float(seen[0]), begins.get(number, inf))  # an event may come late
    for number, begin in sorted(begins.items(), key=lambda pair: pair[1]):
        seen = t[ids == number]
        end, is_open = ends.get(number), bool(len(ids) and ids[-1] == number)
        until = end.t if end is not None else float("nan") if is_open or not len(seen) else float(seen[-1])
        yield RecordedMotion(
            number,
            texts.get(number, f"program {number}"),
            begin,
            until,
            "" if end is None else str(end.content["cause"]),
            "" if end is None else str(end.content.get("text") or ""),
        )
