"""Frames: a header of fixed layout, then a body. The stream of bytes may be split or merged anywhere."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from struct import Struct
from typing import NamedTuple

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codes import Code
from heptarm.wire.messages import HEADER, MAGIC, MAJOR, MAX_BODY, OneWay

#: Largest number of unread bytes; feeding more is a bug of the caller.
MAX_UNREAD = 2 * MAX_BODY
#: Consumed bytes are deleted from the front once there are this many.
_COMPACT_AT = 65536


class Frame(NamedTuple):
    """Header and body of one frame.

    Attributes:
        version: major version of its sender.
        type: message id.
        seq: counter of the frames in its direction.
        request: id of the request that it is or answers; 0 elsewhere.
        time: sender's clock [ns].
        body: bytes of the message.
    """

    version: int
    type: int
    seq: int
    request: int
    time: int
    body: bytes


def pack(type: int, body: bytes, *, seq: int, request: int = 0, time: int = 0) -> bytes:
    """Pack one frame.

    Raises:
        LocalProtocolError: the body is longer than the protocol allows.
    """
    if len(body) > MAX_BODY:
        raise LocalProtocolError(f"a body must have at most {MAX_BODY} bytes, got {len(body)}")
    return HEADER.pack(MAGIC, MAJOR, 0, type, len(body), seq, request, time) + body


def packer(kind: type[OneWay]) -> Callable[..., bytes]:
    """Make a function that packs frames of a oneway message from seq, 0, time [ns] and the numbers of its body."""
    body = kind.LAYOUT
    frame = Struct(HEADER.format + body.format.removeprefix(">"))
    return partial(frame.pack, MAGIC, MAJOR, 0, kind.TYPE, body.size)


class FrameReader:
    """Split a stream of bytes into frames, in bounded memory."""

    __slots__ = ("_buffer", "_start")

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._start = 0

    def __len__(self) -> int:
        """Number of unread bytes."""
        return len(self._buffer) - self._start

    def feed(self, data: bytes | bytearray | memoryview) -> None:
        """Append received bytes.

        Raises:
            LocalProtocolError: too many bytes are unread.
        """
        if len(self) + len(data) > MAX_UNREAD:
            raise LocalProtocolError(f"more than {MAX_UNREAD} bytes are unread: read frames between feeds")
        self._buffer += data

    def read(self) -> Frame | None:
        """Read the next complete frame; None until more bytes arrive.

        Raises:
            RemoteProtocolError: the bytes are not a frame; the stream cannot be used any more.
        """
        buffer, start = self._buffer, self._start
        body = start + HEADER.size
        if len(buffer) < body:
            # refuse a wrong magic at once: a peer of another protocol may never send a complete header
            if len(buffer) >= start + 2 and int.from_bytes(buffer[start : start + 2], "big") != MAGIC:
                raise _bad(
                    f"a frame must begin with {MAGIC:04x}, got {bytes(buffer[start : start + 2]).hex()}"
                )
            return None
        magic, version, flags, type_, length, seq, request, time = HEADER.unpack_from(buffer, start)
        if magic != MAGIC:
            raise _bad(f"a frame must begin with {MAGIC:04x}, got {magic:04x}")
        if flags != 0:
            raise _bad(f"the flags of a frame must be 0, got {flags:#04x}")
        if length > MAX_BODY:
            raise _bad(f"a frame announces {length} bytes; at most {MAX_BODY} are allowed")
        end = body + length
        if len(buffer) < end:
            return None
        content = bytes(buffer[body:end])
        if end == len(buffer):
            buffer.clear()
            self._start = 0
        elif end >= _COMPACT_AT:
            del buffer[:end]
            self._start = 0
        else:
            self._start = end
        return Frame(version, type_, seq, request, time, content)


def _bad(text: str) -> RemoteProtocolError:
    return RemoteProtocolError(
        text, code=int(Code.BAD_FRAME), hint="check that the other side speaks heptarm"
    )
