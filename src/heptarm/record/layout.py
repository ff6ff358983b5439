"""Messages of a recording: protobuf of a fixed size, so that numpy writes and reads thousands of them at once.

Every field of such a message is always present and has a fixed number of entries, so the keys between the numbers are
constant and a message is a row of a structured array. It remains ordinary protobuf (proto3), which other tools decode
by the descriptor in the file. The few messages of the foxglove schemas (Log, PoseInFrame) are written one by one.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.fri.loop import shared_memory as at
from heptarm.fri.protocol.protobuf import BYTES, FIXED32, FIXED64, fields, key, put_bytes, put_varint, varint
from heptarm.values.checks import Array
from heptarm.wire.messages import STATE_LAYOUT

Rows = npt.NDArray[Any]

#: Numbers of a field by their code: numpy type, protobuf type (of descriptor.proto), wire type.
_CODES = {
    "f8": ("<f8", 1, FIXED64),
    "i8": ("<i8", 16, FIXED64),
    "u4": ("<u4", 7, FIXED32),
    "i4": ("<i4", 15, FIXED32),
}
#: Codes for the integers of the wire, which a recording keeps in 32 bits.
_WIDER = {"u1": "u4", "u2": "u4", "u4": "u4", "i4": "i4", "i8": "i8", "f8": "f8"}
_PACKAGE = "heptarm"
#: Fields of a group whose name alone does not say what they are.
_RENAMED = {("safety", "bits"): "safety", ("safety", "mode"): "operation_mode"}


@dataclass(frozen=True)
class RowField:
    """A field of a message.

    Attributes:
        name: unique in the message.
        code: "f8", "i8", "u4" or "i4".
        size: number of entries; a single one is not repeated.
    """

    name: str
    code: str
    size: int = 1


@dataclass(frozen=True)
class RowLayout:
    """A message of fixed size.

    Attributes:
        name: of the message, such as "State".
        fields: in the order of their protobuf numbers, from 1.
    """

    name: str
    fields: tuple[RowField, ...]

    @property
    def full_name(self) -> str:
        """Name with its package, as it is in the file."""
        return f"{_PACKAGE}.{self.name}"

    @cached_property
    def _keys(self) -> tuple[bytes, ...]:
        """The constant bytes before the numbers of each field."""
        found = []
        for number, field in enumerate(self.fields, 1):
            dtype, _, wire_type = _CODES[field.code]
            head = key(number, wire_type)
            if field.size > 1:
                head = key(number, BYTES) + varint(field.size * np.dtype(dtype).itemsize)
            found.append(head)
        return tuple(found)

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Type of a row; fields that begin with "_" are the keys."""
        entries: list[Any] = []
        for number, (field, head) in enumerate(zip(self.fields, self._keys, strict=True)):
            entries.append((f"_{number}", "u1", (len(head),)))
            code = _CODES[field.code][0]
            entries.append((field.name, code) if field.size == 1 else (field.name, code, (field.size,)))
        return np.dtype(entries)

    def rows(self, count: int) -> Rows:
        """Rows with their keys; floats are NaN, integers 0."""
        template = np.zeros(1, self.dtype)
        for number, (field, head) in enumerate(zip(self.fields, self._keys, strict=True)):
            template[f"_{number}"] = np.frombuffer(head, np.uint8)
            if field.code == "f8":
                template[field.name] = np.nan
        return np.repeat(template, count)

    def read(self, payloads: Sequence[bytes]) -> Rows:
        """Rows of encoded messages."""
        return np.frombuffer(b"".join(payloads), self.dtype)

    @property
    def text(self) -> str:
        """The fields as text, for the file."""
        return json.dumps([(field.name, field.code, field.size) for field in self.fields])

    @classmethod
    def of_text(cls, name: str, text: str) -> RowLayout:
        """The layout of a message in a file, which may be another version's."""
        return cls(name.rpartition(".")[2], tuple(RowField(*entry) for entry in json.loads(text)))

    @property
    def descriptor(self) -> bytes:
        """FileDescriptorSet of the message."""
        parts = [
            _field(field.name, number, _CODES[field.code][1], is_repeated=field.size > 1)
            for number, field in enumerate(self.fields, 1)
        ]
        message = put_bytes(1, self.name.encode()) + b"".join(put_bytes(2, part) for part in parts)
        return _file_set(_file(f"heptarm/{self.name}.proto", _PACKAGE, [message]))


# ------------------------------------------------------------------------------------------ heptarm's messages


def _state() -> RowLayout:
    fields = [RowField("stamp", "i8")]
    for group, _, entries in STATE_LAYOUT:
        for name, code, size in entries:
            fields.append(RowField(column(group, name), _WIDER[code.lstrip(">")], size))
    return RowLayout("State", tuple(fields))


def column(group: str, name: str) -> str:
    """Name in a recording of a field of a group of the state."""
    return f"{group}_stamp" if name == "stamp" else _RENAMED.get((group, name), name)


#: A pushed state: all groups of fixed size; `stamp` is the newest of theirs, cabinet time [ns].
STATE = _state()

#: A cycle of FRI: the fields of `heptarm.fri` states, with the words of the shared memory that they come from.
_CYCLE_WORDS: tuple[tuple[RowField, int], ...] = (
    (RowField("received", "i8"), at.S_RECEIVED),
    (RowField("sequence", "i8"), at.S_SEQUENCE),
    (RowField("stamp", "i8"), at.S_STAMP),
    (RowField("session", "i8"), at.S_SESSION),
    (RowField("quality", "i8"), at.S_QUALITY),
    (RowField("period", "i8"), at.S_PERIOD),
    (RowField("latency", "i8"), at.S_LATENCY),
    (RowField("flags", "i8"), at.S_FLAGS),
    (RowField("tracking", "f8"), at.S_TRACKING),
    *((RowField(name, "f8", 7), place.start) for name, place in at.ARRAYS.items()),
    (RowField("wrench", "f8", 6), at.S_WRENCH),
    (RowField("pose", "f8", 7), at.S_POSE),
    (RowField("q_sent", "f8", 7), at.S_Q_SENT),
    (RowField("tau_sent", "f8", 7), at.S_TAU_SENT),
    (RowField("wrench_sent", "f8", 6), at.S_WRENCH_SENT),
    (RowField("pose_sent", "f8", 7), at.S_POSE_SENT),
    (RowField("io", "f8", 10), at.S_IO),
)
FRI_CYCLE = RowLayout("FriCycle", tuple(field for field, _ in _CYCLE_WORDS))
#: FRI's poses are x y z [mm] and w x y z; a recording has x y z [m] and x y z w.
_POSES = ("pose", "pose_sent")


def cycle_rows(words: npt.NDArray[np.float64]) -> Rows:
    """Rows of FRI cycles.

    Args:
        words: slots of the ring of states, shape (n, 123).
    """
    rows, ints = FRI_CYCLE.rows(len(words)), words.view(np.int64)
    for field, place in _CYCLE_WORDS:
        source = ints if field.code == "i8" else words
        rows[field.name] = source[:, place] if field.size == 1 else source[:, place : place + field.size]
    for name in _POSES:
        pose = rows[name]
        rows[name] = np.concatenate([pose[:, :3] * 1e-3, pose[:, [4, 5, 6, 3]]], axis=1)
    return rows


# ----------------------------------------------------------------------- schemas of foxglove, for other tools

_DOUBLE, _STRING, _MESSAGE, _BYTES, _ENUM, _FIXED32 = 1, 9, 11, 12, 14, 7
_INT64, _INT32 = 3, 5
#: Levels of a log message.
LEVELS = {"unknown": 0, "debug": 1, "info": 2, "warning": 3, "error": 4, "fatal": 5}


def _field(name: str, number: int, kind: int, type_name: str = "", *, is_repeated: bool = False) -> bytes:
    """FieldDescriptorProto."""
    content = put_bytes(1, name.encode()) + put_varint(3, number)
    content += put_varint(4, 3 if is_repeated else 1) + put_varint(5, kind)
    return content + (put_bytes(6, type_name.encode()) if type_name else b"")


def _message(name: str, *entries: bytes, enum: bytes = b"") -> bytes:
    """DescriptorProto."""
    content = put_bytes(1, name.encode()) + b"".join(put_bytes(2, entry) for entry in entries)
    return content + (put_bytes(4, enum) if enum else b"")


def _file(name: str, package: str, messages: Sequence[bytes], needs: Sequence[str] = ()) -> bytes:
    """FileDescriptorProto."""
    content = put_bytes(1, name.encode()) + put_bytes(2, package.encode())
    content += b"".join(put_bytes(3, need.encode()) for need in needs)
    content += b"".join(put_bytes(4, message) for message in messages)
    return content + put_bytes(12, b"proto3")


def _file_set(*files: bytes) -> bytes:
    """FileDescriptorSet; a file is behind those that it needs."""
    return b"".join(put_bytes(1, file) for file in files)


_TIME = "google/protobuf/timestamp.proto"
_TIMESTAMP = _file(
    _TIME,
    "google.protobuf",
    [_message("Timestamp", _field("seconds", 1, _INT64), _field("nanos", 2, _INT32))],
)
_STAMPED = _field("timestamp", 1, _MESSAGE, ".google.protobuf.Timestamp")


def _log_descriptor() -> bytes:
    values = b"".join(
        put_bytes(2, put_bytes(1, name.upper().encode()) + put_varint(2, number))
        for name, number in LEVELS.items()
    )
    level = put_bytes(1, b"Level") + values
    log = _message(
        "Log",
        _STAMPED,
        _field("level", 2, _ENUM, ".foxglove.Log.Level"),
        _field("message", 3, _STRING),
        _field("name", 4, _STRING),
        _field("file", 5, _STRING),
        _field("line", 6, _FIXED32),
        enum=level,
    )
    return _file_set(_TIMESTAMP, _file("foxglove/Log.proto", "foxglove", [log], [_TIME]))


_VECTOR = _message("Vector3", *(_field(name, i, _DOUBLE) for i, name in enumerate("xyz", 1)))
_QUATERNION = _message("Quaternion", *(_field(name, i, _DOUBLE) for i, name in enumerate("xyzw", 1)))


def _pose_descriptor() -> bytes:
    pose = _message(
        "Pose",
        _field("position", 1, _MESSAGE, ".foxglove.Vector3"),
        _field("orientation", 2, _MESSAGE, ".foxglove.Quaternion"),
    )
    stamped = _message(
        "PoseInFrame", _STAMPED, _field("frame_id", 2, _STRING), _field("pose", 3, _MESSAGE, ".foxglove.Pose")
    )
    shapes = _file("foxglove/Pose.proto", "foxglove", [_VECTOR, _QUATERNION, pose])
    needs = ["foxglove/Pose.proto", _TIME]
    return _file_set(_TIMESTAMP, shapes, _file("foxglove/PoseInFrame.proto", "foxglove", [stamped], needs))


def _transforms_descriptor() -> bytes:
    message = _message(
        "FrameTransform",
        _STAMPED,
        _field("parent_frame_id", 2, _STRING),
        _field("child_frame_id", 3, _STRING),
        _field("translation", 4, _MESSAGE, ".foxglove.Vector3"),
        _field("rotation", 5, _MESSAGE, ".foxglove.Quaternion"),
    )
    several = _message(
        "FrameTransforms", _field("transforms", 1, _MESSAGE, ".foxglove.FrameTransform", is_repeated=True)
    )
    content = _file(
        "foxglove/FrameTransforms.proto", "foxglove", [_VECTOR, _QUATERNION, message, several], [_TIME]
    )
    return _file_set(_TIMESTAMP, content)


def _image_descriptor() -> bytes:
    image = _message(
        "CompressedImage",
        _STAMPED,
        _field("frame_id", 4, _STRING),
        _field("data", 2, _BYTES),
        _field("format", 3, _STRING),
    )
    return _file_set(_TIMESTAMP, _file("foxglove/CompressedImage.proto", "foxglove", [image], [_TIME]))


def _calibration_descriptor() -> bytes:
    calibration = _message(
        "CameraCalibration",
        _STAMPED,
        _field("frame_id", 9, _STRING),
        _field("width", 2, _FIXED32),
        _field("height", 3, _FIXED32),
        _field("distortion_model", 4, _STRING),
        *(_field(name, number, _DOUBLE, is_repeated=True) for number, name in enumerate("DKRP", 5)),
    )
    content = _file("foxglove/CameraCalibration.proto", "foxglove", [calibration], [_TIME])
    return _file_set(_TIMESTAMP, content)


#: Name and descriptor of the messages that are written one by one.
LOG = ("foxglove.Log", _log_descriptor())
POSE_IN_FRAME = ("foxglove.PoseInFrame", _pose_descriptor())
FRAME_TRANSFORMS = ("foxglove.FrameTransforms", _transforms_descriptor())
COMPRESSED_IMAGE = ("foxglove.CompressedImage", _image_descriptor())
CAMERA_CALIBRATION = ("foxglove.CameraCalibration", _calibration_descriptor())


def encode_log(nanos: int, level: str, text: str, name: str) -> bytes:
    """A log message; `nanos` since 1970."""
    return (
        put_bytes(1, _timestamp(nanos))
        + put_varint(2, LEVELS[level])
        + put_bytes(3, text.encode(errors="replace"))
        + put_bytes(4, name.encode(errors="replace"))
    )


def encode_pose(nanos: int, frame: str, xyz: Sequence[float], quat: Sequence[float]) -> bytes:
    """A pose in a frame; `nanos` since 1970, [m], quaternion x y z w."""
    pose = put_bytes(1, _numbers(xyz)) + put_bytes(2, _numbers(quat))
    return put_bytes(1, _timestamp(nanos)) + put_bytes(2, frame.encode()) + put_bytes(3, pose)


def encode_transforms(nanos: int, transforms: Sequence[tuple[bytes, Sequence[float]]]) -> bytes:
    """Transforms of frames; `nanos` since 1970, each with its `transform_head` and its quaternion x y z w."""
    stamp = put_bytes(1, _timestamp(nanos))
    return b"".join(put_bytes(1, stamp + head + put_bytes(5, _numbers(quat))) for head, quat in transforms)


def encode_image(nanos: int, frame: str, data: bytes) -> bytes:
    """A picture, the bytes of a JPEG file, of a camera with this frame; `nanos` since 1970."""
    head = put_bytes(1, _timestamp(nanos)) + put_bytes(4, frame.encode())
    return head + put_bytes(3, b"jpeg") + put_bytes(2, data)


def image_data(message: bytes) -> bytes:
    """The bytes of the file in such a message; empty: there are none."""
    return next((value for tag, _, value in fields(message) if tag == 2 and isinstance(value, bytes)), b"")


def encode_calibration(
    nanos: int, frame: str, size: tuple[int, int], matrix: Array, distortion: Sequence[float]
) -> bytes:
    """How a camera projects; `nanos` since 1970, its intrinsic matrix, shape (3, 3) [pixels], k1 k2 p1 p2 k3."""
    content = put_bytes(1, _timestamp(nanos)) + put_bytes(9, frame.encode())
    for number, length in enumerate(size, 2):
        content += key(number, FIXED32) + struct.pack("<I", length)
    content += put_bytes(4, b"plumb_bob")
    projection = np.column_stack([matrix, np.zeros(3)])
    for number, values in enumerate((np.array(distortion), matrix, np.eye(3), projection), 5):
        content += put_bytes(number, values.astype("<f8").tobytes())
    return content


def transform_head(parent: str, child: str, xyz: Sequence[float]) -> bytes:
    """What does not change of a transform: the names of its frames, and the place of the child in its parent [m]."""
    return put_bytes(2, parent.encode()) + put_bytes(3, child.encode()) + put_bytes(4, _numbers(xyz))


def _timestamp(nanos: int) -> bytes:
    seconds, rest = divmod(max(nanos, 0), 1_000_000_000)
    return put_varint(1, seconds) + put_varint(2, rest)


def _numbers(values: Sequence[float]) -> bytes:
    return b"".join(key(i, FIXED64) + struct.pack("<d", value) for i, value in enumerate(values, 1))
