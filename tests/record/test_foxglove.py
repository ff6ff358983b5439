"""A recording against what Foxglove publishes: its schemas, and how MCAP names encodings."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader

import heptarm as ha
from heptarm.model.kinematics import forward
from heptarm.record.camera import DrawnPicture
from heptarm.record.mcap_file import RecordingFile
from heptarm.values.robot import robot
from heptarm.wire import messages as wire
from tests.record.bodies import BEGIN, EPOCH, body, fri_words, samples, to_ours
from tests.record.test_file import FACTS, written

pytest.importorskip("foxglove_schemas_protobuf")

CAMERA = ha.Camera((0.1, 0.0, 0.05), (0.0, 0.0, 0.3), frame="flange", size=(320, 200))
#: Pairs of the encoding of a schema and that of its messages, of the registry in MCAP's specification.
ENCODINGS = {("protobuf", "protobuf"), ("jsonschema", "json")}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Any, Any, Any]]:
    """Schema, channel and message of everything in a recording."""
    path = written(tmp_path_factory.mktemp("foxglove") / "run.mcap", 200, motion=5)
    with_fri = RecordingFile(path.with_name("fri.mcap"), FACTS, epoch=EPOCH, chunk=50_000)
    (pressed,) = samples(1)
    with_fri.states([pressed._replace(body=body(0, button=1.0))], to_ours=to_ours, signals=("A.One", "A.Two"))
    with_fri.cycles(fri_words(20))
    with_fri.picture(CAMERA, DrawnPicture(1, pressed.received, to_ours(BEGIN), b"jpeg"))
    with_fri.finish({})
    found: list[tuple[Any, Any, Any]] = []
    for one in (path, with_fri.path):
        with one.open("rb") as stream:
            found += make_reader(stream, validate_crcs=True).iter_messages()
    return found


def published(name: str) -> Any:
    """The class that Foxglove publishes for a message such as "foxglove.Log"."""
    package, _, message = name.rpartition(".")
    assert package == "foxglove"
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{message}_pb2"), message)


def ours(schema: Any) -> Any:
    """The message of a schema in a file; everything that it needs is there, in order."""
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
        pool.Add(file)
    return pool.FindMessageTypeByName(schema.name)


def shape(message: Any) -> dict[str, Any]:
    """What a message is on the wire: numbers and types of its fields, those of what it contains, values of enums."""
    found: dict[str, Any] = {}
    for field in message.fields:
        inner: Any = None
        if field.message_type is not None:
            inner = field.message_type.full_name, shape(field.message_type)
        elif field.enum_type is not None:
            inner = field.enum_type.full_name, {value.name: value.number for value in field.enum_type.values}
        found[field.name] = (field.number, field.type, field.is_repeated, inner)
    return found


def test_every_channel_has_a_schema_in_an_encoding_that_foxglove_reads(recorded: list[Any]) -> None:
    topics = {channel.topic for _, channel, _ in recorded}
    assert topics >= {"/state", "/fri", "/tcp", "/tf", "/log", "/journal", "/signals"}
    assert topics >= {"/camera/image", "/camera/calibration"}
    for schema, channel, message in recorded:
        assert (schema.encoding, channel.message_encoding) in ENCODINGS, channel.topic
        if schema.encoding == "protobuf":
            kind = message_factory.GetMessageClass(ours(schema))
            assert kind.FromString(message.data).ListFields(), channel.topic
        else:
            assert json.loads(schema.data)["type"] == "object"
            content = json.loads(message.data)
            assert set(content) <= set(json.loads(schema.data)["properties"]), channel.topic


def test_foxgloves_messages_are_those_that_it_publishes(recorded: list[Any]) -> None:
    names = set()
    for schema, channel, message in recorded:
        if not schema.name.startswith("foxglove."):
            continue
        kind = published(schema.name)
        if schema.name not in names:
            assert shape(ours(schema)) == shape(kind.DESCRIPTOR), schema.name
            names.add(schema.name)
        parsed = kind.FromString(message.data)
        same = message_factory.GetMessageClass(ours(schema)).FromString(message.data)
        assert str(parsed) == str(same) and parsed.ByteSize() == same.ByteSize() > 0, channel.topic
        stamped = parsed.transforms if schema.name == "foxglove.FrameTransforms" else [parsed]
        assert all(one.timestamp.ToNanoseconds() == message.publish_time for one in stamped)
    assert names == {
        "foxglove.Log",
        "foxglove.PoseInFrame",
        "foxglove.FrameTransforms",
        "foxglove.CompressedImage",
        "foxglove.CameraCalibration",
    }


def test_a_camera_is_where_foxglove_expects_it(recorded: list[Any]) -> None:
    found = {channel.topic: (schema, message) for schema, channel, message in recorded}
    parsed = {
        topic: published(found[f"/{topic}"][0].name).FromString(found[f"/{topic}"][1].data)
        for topic in ("camera/image", "camera/calibration", "tf")
    }
    image, calibration = parsed["camera/image"], parsed["camera/calibration"]
    assert (image.frame_id, image.format, image.data) == ("camera", "jpeg", b"jpeg")
    assert (calibration.frame_id, calibration.width, calibration.height) == ("camera", 320, 200)
    np.testing.assert_array_equal(np.reshape(calibration.K, (3, 3)), CAMERA.matrix)
    np.testing.assert_array_equal(np.reshape(calibration.P, (3, 4))[:, :3], CAMERA.matrix)
    assert list(calibration.D) == [0.0] * 5 and list(calibration.R) == np.eye(3).reshape(-1).tolist()
    (frame,) = parsed["tf"].transforms
    assert (frame.parent_frame_id, frame.child_frame_id) == ("flange", "camera")
    assert (frame.translation.x, frame.translation.y, frame.translation.z) == CAMERA.place


def test_the_frames_are_a_chain_from_the_base_to_the_flange(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "left.mcap", FACTS, epoch=EPOCH, chunk=50_000, arm="left")
    file.states(samples(1), to_ours=to_ours)
    file.finish({})
    with (tmp_path / "left.mcap").open("rb") as stream:
        found = {channel.topic: message.data for _, channel, message in make_reader(stream).iter_messages()}
    transforms = published("foxglove.FrameTransforms").FromString(found["/left/tf"]).transforms
    assert published("foxglove.PoseInFrame").FromString(found["/left/tcp"]).frame_id == "left_base"
    frame, pose = "left_base", ha.Pose.of((0, 0, 0), (0, 0, 0, 1))
    for transform in transforms:
        assert transform.parent_frame_id == frame
        frame, (place, turn) = transform.child_frame_id, (transform.translation, transform.rotation)
        pose = pose @ ha.Pose.of((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
    state = wire.State.decode(body(0))
    assert state.joints is not None and frame == "left_flange"
    np.testing.assert_allclose(pose.matrix, forward(robot("iiwa14"), state.joints.q), atol=1e-9)
    names = [transform.child_frame_id for transform in transforms]
    assert names == [*(f"left_link_{index}" for index in range(8)), "left_flange"], "as in the URDF"
