"""FRI messages: golden bytes, round trips in every version, strictness."""

from __future__ import annotations

import zlib
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol import version
from heptarm.fri.protocol.protobuf import MalformedMessage, put_bytes, put_packed, put_unpacked, put_varint
from heptarm.fri.protocol.version import Version
from tests.long import longer
from tests.oracles.fri import codec

from . import strategies as some
from .golden import COMMAND_1X, COMMAND_27, MONITORING_1X

every_version = pytest.mark.parametrize("wire", Version)


def test_golden_monitoring_message_reads_and_writes_back_to_the_same_bytes() -> None:
    seen = codec.decode_monitoring(MONITORING_1X, Version.V1_15)
    assert seen.header == m.Header(1301, 1299)
    assert seen.connection == m.ConnectionInfo(m.SessionState.COMMANDING_ACTIVE, m.Quality.EXCELLENT, 1, 1)
    assert seen.monitor is not None and seen.monitor.q == pytest.approx((0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0))
    assert (
        seen.ipo is not None and seen.ipo.tracking == 1.0 and seen.ipo.command_mode is m.CommandMode.POSITION
    )
    assert codec.encode_monitoring(seen, Version.V1_15) == MONITORING_1X


@pytest.mark.parametrize(("raw", "wire"), [(COMMAND_1X, Version.V1_15), (COMMAND_27, Version.V2_7)])
def test_golden_commands_read_and_write_back_to_the_same_bytes(raw: bytes, wire: Version) -> None:
    seen = codec.decode_command(raw, wire)
    assert seen.header.sequence == seen.header.reflected in (1300, 1301)
    assert codec.encode_command(seen, wire) == raw


@every_version
@given(data=st.data())
def test_monitoring_round_trip(wire: Version, data: st.DataObject) -> None:
    value = data.draw(some.monitorings(wire))
    assert codec.decode_monitoring(codec.encode_monitoring(value, wire), wire) == value


@every_version
@given(data=st.data())
def test_command_round_trip(wire: Version, data: st.DataObject) -> None:
    value = data.draw(some.commands(wire))
    assert codec.decode_command(codec.encode_command(value, wire), wire) == value


@pytest.mark.slow
@every_version
@settings(max_examples=longer(80, 200))
@given(data=st.data(), raw=st.binary(max_size=200))
def test_any_bytes_only_raise_malformed(wire: Version, data: st.DataObject, raw: bytes) -> None:
    good = bytearray(codec.encode_monitoring(data.draw(some.monitorings(wire)), wire))
    for _ in range(data.draw(st.integers(1, 4))):
        good[data.draw(st.integers(0, len(good) - 1))] = data.draw(st.integers(0, 255))
    for candidate in (raw, bytes(good), bytes(good[: len(good) // 2])):
        for read in (codec.decode_monitoring, codec.decode_command):
            try:
                read(candidate, wire)
            except MalformedMessage:
                pass


@pytest.mark.parametrize("size", [0, 6, 8])
def test_joint_arrays_of_another_length_are_refused(size: int) -> None:
    body = put_bytes(1, put_unpacked(1, (0.5,) * size))
    message = COMMAND_1X[:12] + put_bytes(2, body)
    with pytest.raises(MalformedMessage, match=f"must have 7 values, got {size}"):
        codec.decode_command(message, Version.V1_15)


def test_packed_and_unpacked_are_read_and_unknown_fields_skipped() -> None:
    packed = (
        COMMAND_1X[:12]
        + put_bytes(2, put_bytes(1, put_packed(1, (0.5,) * 7)) + put_varint(99, 3))
        + put_bytes(14, b"later")
    )
    assert codec.decode_command(packed, Version.V1_15).q == (0.5,) * 7


def test_another_version_is_named_in_words() -> None:
    with pytest.raises(MalformedMessage, match="speaks FRI 2.7"):
        codec.decode_command(COMMAND_27, Version.V1_15)
    with pytest.raises(MalformedMessage, match="speaks FRI 1.x or 2.5"):
        codec.decode_command(COMMAND_1X, Version.V2_7)
    with pytest.raises(MalformedMessage, match="wrong CRC"):
        codec.decode_command(COMMAND_27[:-1] + b"\0", Version.V2_7)
    with pytest.raises(MalformedMessage, match="id must be 2380098, got 212993"):
        codec.decode_monitoring(COMMAND_1X, Version.V1_15)


@pytest.mark.parametrize("wire", [Version.V1_15, Version.V2_5, Version.V2_7])
def test_version_is_recognised_from_one_datagram(wire: Version) -> None:
    joints = (0.1,) * 7
    monitor = m.MonitorData(q=joints, q_cmd=None if wire.traits.quaternions else joints)
    raw = codec.encode_monitoring(m.Monitoring(m.Header(1, 0), monitor=monitor), wire)
    assert version.recognise(raw) is wire


def test_what_a_version_cannot_carry_is_refused_on_writing() -> None:
    header, joints = m.Header(1, 1), (0.0,) * 7
    signal = m.IoValue("A.b", m.IoType.BOOLEAN, m.IoDirection.OUTPUT, 1)
    for value, wire, text in (
        (m.Command(header, io=(signal,)), Version.V1_11, "IO"),
        (m.Command(header, io=(signal,) * 11), Version.V1_15, "at most 10"),
        (m.Command(header, pose=m.Transformation("p", joints)), Version.V1_15, "Cartesian pose"),
        (m.Command(header, q=(0.0,) * 6), Version.V1_15, "must have 7 values"),
        (m.Command(header, io=(replace(signal, name="x" * 64),)), Version.V1_15, "at most 63"),
    ):
        with pytest.raises(ValueError, match=text):
            codec.encode_command(value, wire)


def test_crc_is_the_plain_one() -> None:
    assert zlib.crc32(COMMAND_27[4:-4]) == int.from_bytes(COMMAND_27[-4:], "little")
