"""Frames: a header of fixed layout, then a body. Any split or merge of the octets is legal."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from struct import Struct
from typing import NamedTuple

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codes import Code
from heptarm.wire.messages import HEADER, MAGIC, MAJOR, MAX_BODY, OneWay

#: Octets that may wait unread before feeding more counts as a bug of the caller.
MAX_WAITING = 2 * MAX_BODY
#: Consumed octets are dropped from the front once there are this many.
_COMPACT_AT = 65536


class Frame(NamedTuple):
    """One frame.

    Attributes:
        version: major version of its sender.
        type: message id.
        seq: its number in its direction.
        request: id of the request that it is or answers; 0 elsewhere.
        time: sender's clock [ns].
        body: octets of the message.
    """

    version: int
    type: int
    seq: int
    request: int
    time: int
    body: bytes


def pack(type: int, body: bytes, *, seq: int, request: int = 0, time: int = 0) -> bytes:
    """One frame as octets.

    Raises:
        LocalProtocolError: the body is longer than the protocol carries.
    """
    if len(body) > MAX_BODY:
        raise LocalProtocolError(f"a body of {len(body)} octets; the protocol carries {MAX_BODY}")
    return HEADER.pack(MAGIC, MAJOR, 0, type, len(body), seq, request, time) + body


def packer(kind: type[OneWay]) -> Callable[..., bytes]:
    """Packs whole frames of a one-way message at once: called with seq, 0, time [ns] and the numbers of its body."""
    body = kind.LAYOUT
    frame = Struct(HEADER.format + body.format.removeprefix(">"))
    return partial(frame.pack, MAGIC, MAJOR, 0, kind.TYPE, body.size)


class FrameReader:
    """Octets in, frames out. Memory is bounded whatever the other side sends."""

    __slots__ = ("_buffer", "_start")

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._start = 0

    def __len__(self) -> int:
        """Octets that wait."""
        return len(self._buffer) - self._start

    def feed(self, data: bytes | bytearray | memoryview) -> None:
        """Append what came from the other side.

        Raises:
            LocalProtocolError: the caller feeds without reading.
        """
        if len(self) + len(data) > MAX_WAITING:
            raise LocalProtocolError(f"more than {MAX_WAITING} octets wait: read frames between feeds")
        self._buffer += data

    def read(self) -> Frame | None:
        """The next whole frame, or None until more octets come.

        Raises:
            RemoteProtocolError: the octets are not a frame; the stream cannot be trusted any more.
        """
        buffer, start = self._buffer, self._start
        body = start + HEADER.size
        if len(buffer) < body:
            # a wrong magic is refused at once: a peer of another protocol may never send a whole header
            if len(buffer) >= start + 2 and int.from_bytes(buffer[start : start + 2], "big") != MAGIC:
                raise _bad(f"a frame begins with {bytes(buffer[start : start + 2]).hex()}")
            return None
        magic, version, flags, type_, length, seq, request, time = HEADER.unpack_from(buffer, start)
        if magic != MAGIC:
            raise _bad(f"a frame begins with {magic:#06x}")
        if flags != 0:
            raise _bad(f"the flags of a frame are {flags:#04x}; 0 is legal")
        if length > MAX_BODY:
            raise _bad(f"a frame announces {length} octets; {MAX_BODY} are legal")
        end = body + length
        if len(buffer) < end:
            return None
        octets = bytes(buffer[body:end])
        if end == len(buffer):
            buffer.clear()
            self._start = 0
        elif end >= _COMPACT_AT:
            del buffer[:end]
            self._start = 0
        else:
            self._start = end
        return Frame(version, type_, seq, request, time, octets)


def _bad(text: str) -> RemoteProtocolError:
    return RemoteProtocolError(
        text, code=int(Code.BAD_FRAME), hint="check that the other side speaks heptarm"
    )
