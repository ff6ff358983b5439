"""The file of a recording: MCAP with protobuf and JSON messages, which Foxglove and rerun open without a plugin.

Topics: /state and /fri (one message per pushed state and per FRI cycle), /tcp and /tf (the motion frame, and the frames
of the links with the names of the URDF, for a 3D view, at most 30 per second), /log (what happened, as text), /journal
(the same with all its data), /signals (IO and control mode, when they change), /camera/image and /camera/calibration
(pictures of a simulated camera), /camera/NAME/image and /stream/NAME (pictures and numbers of an episode, see
`heptarm.record.episodes`). The log time of a message is its receipt, the publish time of a state the moment of
its sampling; a picture has those of the state that it shows. In a recording of several arms the topics begin with
the arm's name, as in /left/state, and so do the frames: left_base.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.errors import require
from heptarm.record.camera import DrawnPicture
from heptarm.record.journal import REFUSAL, REQUEST, JournalEntry, plain
from heptarm.record.layout import (
    CAMERA_CALIBRATION,
    COMPRESSED_IMAGE,
    FRAME_TRANSFORMS,
    FRI_CYCLE,
    LOG,
    POSE_IN_FRAME,
    STATE,
    RowLayout,
    cycle_rows,
    encode_calibration,
    encode_image,
    encode_log,
    encode_pose,
    encode_transforms,
    transform_head,
)
from heptarm.record.recorded import RecordedData
from heptarm.record.samples import RestWatch, StateSample, state_rows
from heptarm.values.camera import Camera
from heptarm.values.files import unwritable
from heptarm.values.robot import known_robot
from heptarm.wire import messages as wire

#: Name of the metadata at the beginning of a file, and of those at its end.
BEGIN, END = "heptarm", "heptarm.end"
#: Fact in a recording of several arms: the name of the arm that the others are about.
ARM = "arm"
#: States that are written before other threads get their turn.
_TURN = 4
#: Begin of the time line of merged recordings: a day after 1970 [s], so that earlier events have a time; their chunks.
_MERGED_EPOCH, _MERGED_CHUNK = 86400.0, 524_288
_NO_TURN = (0.0, 0.0, 0.0, 1.0)
#: Shortest time between two poses for a 3D view [ns].
_POSE_PERIOD = 33_000_000
#: Requests that are text for people, too; the others are in the journal only.
SHOWN_REQUESTS = (wire.Run, wire.Stop, wire.ServoOpen, wire.FriOpen, wire.Pause, wire.Resume, wire.AttachTool)
_JOURNAL_SCHEMA = {
    "type": "object",
    "properties": {
        "kind": {"type": "string"},
        "name": {"type": "string"},
        "id": {"type": "integer"},
        "text": {"type": "string"},
        "content": {"type": "object"},
    },
}
_STREAM_SCHEMA = {"type": "object", "properties": {"values": {"type": "array", "items": {"type": "number"}}}}
_SIGNALS_SCHEMA = {"type": "object", "properties": {"io": {"type": "object"}, "mode": {"type": "object"}}}


class RecordingFile:
    """Writer of a recording; not to be used by several threads at once.

    Args:
        path: the file; one that exists is replaced, see `Recorder`.
        facts: texts about robot and connection, by name.
        epoch: nanoseconds since 1970 at our clock's zero.
        chunk: size of a chunk [bytes]: what is lost if the process ends at any time.
        arm: name of the arm, if there are several in the file; see `beside`.

    Attributes:
        path: the file.
        sampled: our clock at the sampling of the last state that was written [ns].

    Raises:
        CommandRejected: the file cannot be written.
        MissingExtra: the package mcap is not installed.
    """

    def __init__(
        self, path: Path, facts: Mapping[str, str], *, epoch: int, chunk: int, arm: str = ""
    ) -> None:
        writer = require("mcap.writer", extra="record")
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("wb")
        except OSError as error:
            raise unwritable(path, error) from error
        self._epoch = epoch
        self._out: Any = writer.Writer(self._file, chunk_size=chunk)
        try:
            self._out.start(profile="", library="heptarm")
            self._begin(facts, arm)
        except OSError as error:
            self.abandon()
            raise unwritable(path, error) from error

    def beside(self, facts: Mapping[str, str], arm: str) -> RecordingFile:
        """A writer of another arm's part of the same file; `flush`, `finish` and `abandon` are left to this one."""
        other = copy(self)
        other._begin(facts, arm)
        return other

    def _begin(self, facts: Mapping[str, str], arm: str) -> None:
        """Write the beginning of an arm's part, which a file that is cut off still has."""
        self._prefix = f"/{arm}" if arm else ""
        self.sampled = 0
        self._pose_due = 0
        self._rest = RestWatch()
        self._cycles: int | None = None
        self._camera: tuple[int, int] | None = None
        self._more: dict[str, int] = {}
        self._names = f"{arm}_" if arm else ""
        self._out.add_metadata(BEGIN, {**facts, **({ARM: arm} if arm else {})})
        self._states = self._add_rows("/state", STATE)
        self._pose = self._add("/tcp", *POSE_IN_FRAME)
        self._frames = self._add("/tf", *FRAME_TRANSFORMS)
        self._links = _LinkFrames(facts.get("robot", ""), self._names)
        self._log = self._add("/log", *LOG)
        self._journal = self._add_json("/journal", "heptarm.JournalEntry", _JOURNAL_SCHEMA)
        self._signals = self._add_json("/signals", "heptarm.Signals", _SIGNALS_SCHEMA)
        self.flush()

    def _add(self, topic: str, name: str, descriptor: bytes, **metadata: str) -> int:
        schema = self._out.register_schema(name=name, encoding="protobuf", data=descriptor)
        return int(self._out.register_channel(self._prefix + topic, "protobuf", schema, metadata))

    def _add_rows(self, topic: str, layout: RowLayout) -> int:
        return self._add(topic, layout.full_name, layout.descriptor, layout=layout.text)

    def _add_json(self, topic: str, name: str, content: Mapping[str, Any]) -> int:
        schema = self._out.register_schema(
            name=name, encoding="jsonschema", data=json.dumps(content).encode()
        )
        return int(self._out.register_channel(self._prefix + topic, "json", schema))

    def states(
        self, samples: Sequence[StateSample], *, to_ours: Callable[[int], int], signals: Sequence[str] = ()
    ) -> None:
        """Write pushed states.

        Args:
            samples: in order.
            to_ours: makes a time of our clock of one of the cabinet's [ns].
            signals: names of the cabinet's signals by their indices.
        """
        if not samples:
            return
        rows = state_rows([sample.body for sample in samples])
        sampled = sampling_times(rows["stamp"], to_ours) + self._epoch
        data, size, out, channel = rows.tobytes(), rows.itemsize, self._out, self._states
        for index, (state, at) in enumerate(zip(samples, sampled.tolist(), strict=True)):
            if not index % _TURN:
                time.sleep(0.0)  # the thread that receives states is not held up by the interpreter's lock
            payload = data[index * size : (index + 1) * size]
            out.add_message(channel, state.received + self._epoch, payload, at, state.number & 0xFFFFFFFF)
            self._write_pose(rows[index], state.received, at)
            self._write_rest(state, at, signals)
        self.sampled = at - self._epoch

    def _write_pose(self, row: Any, received: int, sampled: int) -> None:
        """Write what is three-dimensional, if it is due: the pose of the motion frame, and the frames of the links."""
        if received < self._pose_due:
            return
        at, links = received + self._epoch, self._links
        if not np.isnan(row["xyz"]).any():
            self._pose_due = received + _POSE_PERIOD
            data = encode_pose(sampled, links.base, row["xyz"].tolist(), row["quat"].tolist())
            self._out.add_message(self._pose, at, data, sampled)
        if not np.isnan(row["q"]).any():
            self._pose_due = received + _POSE_PERIOD
            data = encode_transforms(sampled, links.transforms(row["q"].tolist()))
            self._out.add_message(self._frames, at, data, sampled)

    def _write_rest(self, sample: StateSample, sampled: int, names: Sequence[str]) -> None:
        """Write control mode and signals if they have changed; their stamps do not count."""
        state = self._rest.change(sample.body)
        if state is None:
            return
        content: dict[str, Any] = {}
        if state.io is not None:
            content["io"] = {
                names[signal.index] if signal.index < len(names) else str(signal.index): signal.value
                for signal in state.io.values
            }
        if state.mode is not None:
            content["mode"] = plain(state.mode) | {"stamp": 0}
        data = json.dumps(content, allow_nan=False)
        self._out.add_message(self._signals, sample.received + self._epoch, data.encode(), sampled)

    def cycles(self, words: npt.NDArray[np.float64]) -> None:
        """Write FRI cycles; `words` has shape (n, 123)."""
        if self._cycles is None:
            self._cycles = self._add_rows("/fri", FRI_CYCLE)
        rows = cycle_rows(words)
        data, size = rows.tobytes(), rows.itemsize
        for index, received in enumerate(rows["received"].tolist()):
            at = received + self._epoch
            self._out.add_message(self._cycles, at, data[index * size : (index + 1) * size], at)

    def picture(self, camera: Camera, picture: DrawnPicture) -> None:
        """Write a picture, how the camera projects, and the camera's frame: z ahead, x to the right, y down."""
        if self._camera is None:
            image = self._add("/camera/image", *COMPRESSED_IMAGE)
            self._camera = image, self._add("/camera/calibration", *CAMERA_CALIBRATION)
        received, at = picture.received + self._epoch, picture.sampled + self._epoch
        frame, pose, number = f"{self._names}camera", camera.pose, picture.number & 0xFFFFFFFF
        head = transform_head(self._names + camera.frame, frame, pose.xyz.tolist())
        image, calibration = self._camera
        for channel, data in (
            (self._frames, encode_transforms(at, [(head, pose.quat.tolist())])),
            (calibration, encode_calibration(at, frame, camera.size, camera.matrix, camera.distortion)),
            (image, encode_image(at, frame, picture.data)),
        ):
            self._out.add_message(channel, received, data, at, number)

    def view(self, name: str, at: int, data: bytes) -> None:
        """Write a picture of a named camera, the bytes of a JPEG file, taken at a time of our clock [ns]."""
        topic = f"/camera/{name}/image"
        if topic not in self._more:
            self._more[topic] = self._add(topic, *COMPRESSED_IMAGE)
        at += self._epoch
        self._out.add_message(self._more[topic], at, encode_image(at, f"{self._names}{name}", data), at)

    def numbers(self, name: str, at: int, values: Sequence[float]) -> None:
        """Write numbers of a named stream at a time of our clock [ns]."""
        topic = f"/stream/{name}"
        if topic not in self._more:
            self._more[topic] = self._add_json(topic, "heptarm.Numbers", _STREAM_SCHEMA)
        at += self._epoch
        self._out.add_message(self._more[topic], at, json.dumps({"values": list(values)}).encode(), at)

    def entry(self, entry: JournalEntry) -> None:
        """Write what happened."""
        at = entry.time + self._epoch
        self._out.add_message(self._journal, at, entry.data.encode(), at)
        if entry.kind != REQUEST or isinstance(entry.content, SHOWN_REQUESTS):
            name = "cabinet" if entry.kind in ("event", REFUSAL) else entry.kind
            self._out.add_message(self._log, at, encode_log(at, entry.level, entry.text, name), at)

    def copy(self, recording: RecordedData) -> None:
        """Write states and events of a recording that was read, at the times of its time line."""
        rows = STATE.rows(len(recording))
        for name in rows.dtype.names or ():
            if name in recording and not name.startswith("_"):
                rows[name] = recording[name]
        stamps = np.round(recording.t * 1e9).astype(np.int64)
        rows["stamp"] = stamps
        data, size = rows.tobytes(), rows.itemsize
        for index, at in enumerate((stamps + self._epoch).tolist()):
            self._out.add_message(self._states, at, data[index * size : (index + 1) * size], at)
            self._write_pose(rows[index], int(stamps[index]), at)
        for event in recording.events:
            at = round(event.t * 1e9) + self._epoch
            if event.kind == "signals":
                self._out.add_message(self._signals, at, json.dumps(event.content).encode(), at)
                continue
            entry = {"kind": event.kind, "name": event.name, "id": event.id, "text": event.text}
            data_of = json.dumps(entry | {"content": event.content}, ensure_ascii=False).encode()
            self._out.add_message(self._journal, at, data_of, at)
            self._out.add_message(self._log, at, encode_log(at, "info", event.text, event.kind), at)

    def flush(self) -> None:
        """Hand complete chunks to the operating system."""
        self._file.flush()

    def finish(self, facts: Mapping[str, str]) -> None:
        """Write the end of the file and close it."""
        self._out.add_metadata(END, dict(facts))
        self._out.finish()
        self._file.close()

    def abandon(self) -> None:
        """Close the file without an end, after an error; it can be read to its last complete chunk."""
        try:
            self._file.close()
        except OSError:
            pass  # the disk is full: what was buffered is lost


class _LinkFrames:
    """Frames of an arm's links, each in the one before, as in the URDF of `heptarm_description`.

    Args:
        model: of the arm, such as "iiwa14" or "iiwa14+touch"; an unknown one has no links.
        prefix: before all names.
    """

    def __init__(self, model: str, prefix: str) -> None:
        self.base = f"{prefix}base"
        names = [self.base, *(f"{prefix}link_{index}" for index in range(8)), f"{prefix}flange"]
        self._heads: list[bytes] = []
        if (arm := known_robot(model)) is not None:
            links = arm.links
            places = [np.zeros(3), *links.origin, links.flange]
            self._heads = [
                transform_head(parent, child, place.tolist())
                for (parent, child), place in zip(pairwise(names), places, strict=True)
            ]

    def transforms(self, q: Sequence[float]) -> list[tuple[bytes, tuple[float, ...]]]:
        """Heads and quaternions x y z w at joint positions [rad]."""
        turns = [_NO_TURN]
        for joint, angle in enumerate(q):
            half = 0.5 * (-angle if joint == 3 else angle)
            turn = (0.0, math.sin(half), 0.0) if joint % 2 else (0.0, 0.0, math.sin(half))
            turns.append((*turn, math.cos(half)))
        turns.append(_NO_TURN)
        return list(zip(self._heads, turns, strict=False))


def sampling_times(stamps: npt.NDArray[np.int64], to_ours: Callable[[int], int]) -> npt.NDArray[np.int64]:
    """Times of our clock of states sampled at times of the cabinet's, in order, shape (n,) [ns]."""
    first, last = int(stamps[0]), int(stamps[-1])
    begin, end = to_ours(first), to_ours(last)
    rate = (end - begin) / (last - first) if last > first else 1.0
    return (begin + (stamps - first) * rate).astype(np.int64)


def merge(path: Path, recordings: Mapping[str, RecordedData]) -> Path:
    """Write recordings to one file over their common time line: states and events, without FRI cycles and pictures.

    Args:
        path: the file; one that exists is replaced.
        recordings: by the name that each gets as an arm of the file; at least one.

    Returns:
        The file.

    Raises:
        CommandRejected: the file cannot be written.
    """
    zero = round(_MERGED_EPOCH * 1e9)  # files of the same recordings are the same
    (first, recording), *others = recordings.items()
    same = {"clock_rate": "1"}  # times are the cabinet's already
    out = RecordingFile(path, {**recording.facts, **same}, epoch=zero, chunk=_MERGED_CHUNK, arm=first)
    try:
        out.copy(recording)
        for name, other in others:
            out.beside({**other.facts, **same}, name).copy(other)
        out.finish({"states": str(sum(map(len, recordings.values()))), "lost": "0"})
    except BaseException:
        out.abandon()
        raise
    return path
