"""The `protobuf` library as an oracle: it reads what the codecs write, and the codecs read what it writes.

The messages are described to it at run time, from the field tables below (facts about the wire, version by version).
"""

from __future__ import annotations

from typing import Any

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import COMMAND_ID, MONITORING_ID, Version, unwrap, wrap
from tests.oracles.fri import codec

from . import strategies as some
from .golden import COMMAND_1X, COMMAND_27, MONITORING_1X

every_version = pytest.mark.parametrize("wire", Version)
some_examples = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])

REQ, OPT, REP = "required", "optional", "repeated"

#: message -> (tag, name, type, label); a type that is none of protobuf's is another message.
TABLES: dict[str, list[tuple[int, str, str, str]]] = {
    "Header": [(1, "id", "uint32", REQ), (2, "sequence", "uint32", REQ), (3, "reflected", "uint32", REQ)],
    "Joints": [(1, "value", "double", REP)],
    "Vector": [(1, "value", "double", REP)],
    "Stamp": [(1, "sec", "uint32", REQ), (2, "nano", "uint32", REQ)],
    "Frame": [(1, "name", "string", REQ), (2, "value", "double", REP), (3, "stamp", "Stamp", OPT)],
    "Redundancy": [(1, "strategy", "int32", REQ), (2, "value", "double", REQ)],
    "Io": [
        (1, "name", "string", REQ),
        (2, "type", "int32", REQ),
        (3, "direction", "int32", REQ),
        (4, "digital", "uint64", OPT),
        (5, "analog", "double", OPT),
    ],
    "Robot": [
        (1, "joints", "int32", OPT),
        (2, "safety", "int32", OPT),
        (5, "drives", "int32", REP),
        (6, "operation", "int32", OPT),
        (7, "control", "int32", OPT),
    ],
    "Monitor": [
        (1, "q", "Joints", OPT),
        (2, "tau", "Joints", OPT),
        (3, "q_cmd", "Joints", OPT),
        (4, "tau_cmd", "Joints", OPT),
        (5, "tau_ext", "Joints", OPT),
        (6, "wrench", "Vector", OPT),
        (8, "io", "Io", REP),
        (9, "pose", "Frame", OPT),
        (10, "redundancy", "Redundancy", OPT),
        (15, "stamp", "Stamp", OPT),
    ],
    "Ipo": [
        (1, "q", "Joints", OPT),
        (2, "pose", "Frame", OPT),
        (3, "redundancy", "Redundancy", OPT),
        (10, "mode", "int32", OPT),
        (11, "overlay", "int32", OPT),
        (12, "tracking", "double", OPT),
    ],
    "Connection": [
        (1, "state", "int32", REQ),
        (2, "quality", "int32", REQ),
        (3, "period", "uint32", OPT),
        (4, "multiplier", "uint32", OPT),
    ],
    "Monitoring": [
        (1, "header", "Header", REQ),
        (2, "robot", "Robot", OPT),
        (3, "monitor", "Monitor", OPT),
        (4, "connection", "Connection", OPT),
        (5, "ipo", "Ipo", OPT),
        (6, "requested", "Frame", REP),
    ],
    "Data": [
        (1, "q", "Joints", OPT),
        (2, "wrench", "Vector", OPT),
        (3, "tau", "Joints", OPT),
        (4, "frames", "Frame", REP),
        (5, "io", "Io", REP),
        (6, "pose", "Frame", OPT),
        (7, "redundancy", "Redundancy", OPT),
    ],
    "Command": [(1, "header", "Header", REQ), (2, "data", "Data", OPT)],
}
#: Doubles that KUKA's controllers and clients write packed; joint arrays are not.
PACKED = ("Vector", "Frame")


def _classes(*, packed: tuple[str, ...]) -> dict[str, Any]:
    """The messages as classes of the protobuf library."""
    file = descriptor_pb2.FileDescriptorProto(name="fri.proto", package="fri", syntax="proto2")
    kinds = descriptor_pb2.FieldDescriptorProto
    for name, rows in TABLES.items():
        message = file.message_type.add(name=name)
        for tag, field, kind, label in rows:
            entry = message.field.add(name=field, number=tag, label=getattr(kinds, f"LABEL_{label.upper()}"))
            if kind in TABLES:
                entry.type, entry.type_name = kinds.TYPE_MESSAGE, f".fri.{kind}"
            else:
                entry.type = getattr(kinds, f"TYPE_{kind.upper()}")
            if name in packed and kind == "double":
                entry.options.packed = True
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return {
        name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"fri.{name}")) for name in TABLES
    }


ORACLE = _classes(packed=PACKED)
#: Writes every double in the other encoding; a decoder has to read both.
CONTRARY = _classes(packed=("Joints",))


def _joints(part: Any, field: str, values: tuple[float, ...] | None) -> None:
    if values is not None:
        getattr(part, field).value.extend(values)


def _frame(part: Any, value: m.Transformation | None) -> None:
    if value is None:
        return
    part.name = value.name
    part.value.extend(value.values)
    _stamp(part.stamp, value.stamp)


def _stamp(part: Any, value: m.TimeStamp | None) -> None:
    if value is not None:
        part.sec, part.nano = value.seconds, value.nanoseconds


def _redundancy(part: Any, value: m.Redundancy | None) -> None:
    if value is not None:
        part.strategy, part.value = value.strategy, value.value


def _ios(part: Any, values: tuple[m.IoValue, ...]) -> None:
    for value in values:
        one = part.add(name=value.name, type=value.type, direction=value.direction)
        if value.type is m.IoType.ANALOG:
            one.analog = value.value
        else:
            one.digital = int(value.value)


def _numbers(part: Any, **values: float | None) -> None:
    for field, value in values.items():
        if value is not None:
            setattr(part, field, value)


def oracle_of_monitoring(value: m.Monitoring, classes: dict[str, Any]) -> Any:
    """The library's message with the content of ours."""
    made = classes["Monitoring"]()
    made.header.id, made.header.sequence, made.header.reflected = (
        MONITORING_ID,
        value.header.sequence,
        value.header.reflected,
    )
    if (robot := value.robot) is not None:
        made.robot.SetInParent()
        made.robot.drives.extend(robot.drives)
        _numbers(
            made.robot,
            joints=robot.joints,
            safety=robot.safety,
            operation=robot.operation_mode,
            control=robot.control_mode,
        )
    if (data := value.monitor) is not None:
        made.monitor.SetInParent()
        for field in ("q", "tau", "q_cmd", "tau_cmd", "tau_ext", "wrench"):
            _joints(made.monitor, field, getattr(data, field))
        _ios(made.monitor.io, data.io)
        if data.pose is not None:
            _frame(made.monitor.pose, data.pose)
        _redundancy(made.monitor.redundancy, data.redundancy)
        _stamp(made.monitor.stamp, data.stamp)
    if (link := value.connection) is not None:
        _numbers(
            made.connection,
            state=link.state,
            quality=link.quality,
            period=link.period_ms,
            multiplier=link.multiplier,
        )
    if (ipo := value.ipo) is not None:
        made.ipo.SetInParent()
        _joints(made.ipo, "q", ipo.q)
        if ipo.pose is not None:
            _frame(made.ipo.pose, ipo.pose)
        _redundancy(made.ipo.redundancy, ipo.redundancy)
        _numbers(made.ipo, mode=ipo.command_mode, overlay=ipo.overlay, tracking=ipo.tracking)
    for one in value.requested:
        _frame(made.requested.add(), one)
    return made


def oracle_of_command(value: m.Command, classes: dict[str, Any]) -> Any:
    """The library's message with the content of ours."""
    made = classes["Command"]()
    made.header.id, made.header.sequence, made.header.reflected = (
        COMMAND_ID,
        value.header.sequence,
        value.header.reflected,
    )
    for field in ("q", "wrench", "tau"):
        _joints(made.data, field, getattr(value, field))
    for transformation in value.transformations:
        _frame(made.data.frames.add(), transformation)
    _ios(made.data.io, value.io)
    if value.pose is not None:
        _frame(made.data.pose, value.pose)
    _redundancy(made.data.redundancy, value.redundancy)
    return made


@every_version
@some_examples
@given(data=st.data())
def test_monitoring_messages_are_the_same_bytes(wire: Version, data: st.DataObject) -> None:
    value = data.draw(some.monitorings(wire))
    ours = codec.encode_monitoring(value, wire)
    theirs = oracle_of_monitoring(value, ORACLE)
    assert unwrap(ours, wire) == theirs.SerializeToString(deterministic=True)
    assert ORACLE["Monitoring"].FromString(unwrap(ours, wire)) == theirs


@every_version
@some_examples
@given(data=st.data())
def test_command_messages_are_the_same_bytes(wire: Version, data: st.DataObject) -> None:
    value = data.draw(some.commands(wire))
    ours = unwrap(codec.encode_command(value, wire), wire)
    assert ORACLE["Command"].FromString(ours) == oracle_of_command(value, ORACLE)
    assert ours == oracle_of_command(value, ORACLE).SerializeToString(deterministic=True)


@every_version
@some_examples
@given(data=st.data())
def test_what_the_library_writes_is_read_packed_or_not(wire: Version, data: st.DataObject) -> None:
    monitoring, command = data.draw(some.monitorings(wire)), data.draw(some.commands(wire))
    for classes in (ORACLE, CONTRARY):
        raw = wrap(oracle_of_monitoring(monitoring, classes).SerializeToString(), wire)
        assert codec.decode_monitoring(raw, wire) == monitoring
        assert codec.decode_monitoring(raw, wire) == monitoring
        raw = wrap(oracle_of_command(command, classes).SerializeToString(), wire)
        assert codec.decode_command(raw, wire) == command


def test_golden_bytes_are_what_the_library_reads() -> None:
    seen = ORACLE["Monitoring"].FromString(MONITORING_1X)
    assert seen.header.sequence == 1301 and seen.connection.state == 4 and len(seen.monitor.q.value) == 7
    for raw, wire in ((COMMAND_1X, Version.V1_15), (COMMAND_27, Version.V2_7)):
        assert len(ORACLE["Command"].FromString(unwrap(raw, wire)).data.q.value) == 7
