"""Frames: a header of fixed layout, then a body. The stream of bytes may be split or merged anywhere."""

from __future__ import annotations

import hmac
from collections.abc import Callable
from functools import partial
from struct import Struct
from typing import NamedTuple

from heptarm.errors import LocalProtocolError, RemoteProtocolError
from heptarm.wire.codes import Code
from heptarm.wire.key import FrameTag
from heptarm.wire.messages import HEADER, MAGIC, MAJOR, MAX_BODY, TAG, OneWay

#: Largest number of unread bytes; feeding more is a bug of the caller.
MAX_UNREAD = 2 * MAX_BODY
#: Flag of a frame that ends with a tag.
_TAGGED = 1


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


def pack(
    type: int, body: bytes, *, seq: int, request: int = 0, time: int = 0, tag: FrameTag | None = None
) -> bytes:
    """Pack one frame; with `tag` it ends with its tag.

    Raises:
        LocalProtocolError: the body is longer than the protocol allows.
    """
    if len(body) > MAX_BODY:
        raise LocalProtocolError(f"a body must have at most {MAX_BODY} bytes, got {len(body)}")
    flags = 0 if tag is None else _TAGGED
    frame = HEADER.pack(MAGIC, MAJOR, flags, type, len(body), seq, request, time) + body
    return frame if tag is None else frame + tag.of(frame)


def packer(kind: type[OneWay], tag: FrameTag | None) -> Callable[..., bytes]:
    """Make a function that packs frames of a oneway message from seq, 0, time [ns] and the numbers of its body."""
    body = kind.LAYOUT
    frame = Struct(HEADER.format + body.format.removeprefix(">"))
    if tag is None:
        return partial(frame.pack, MAGIC, MAJOR, 0, kind.TYPE, body.size)
    pack, of = partial(frame.pack, MAGIC, MAJOR, _TAGGED, kind.TYPE, body.size), tag.of

    def tagged(*numbers: float) -> bytes:
        data = pack(*numbers)
        return data + of(data)

    return tagged


class FrameReader:
    """Split a stream of bytes into frames, in bounded memory.

    Attributes:
        tag: of the other side's frames from the next one on; None: they have none.
    """

    __slots__ = ("_buffer", "_start", "tag")

    def __init__(self) -> None:
        self.tag: FrameTag | None = None
        self._buffer = b""
        self._start = 0

    def __len__(self) -> int:
        """Number of unread bytes."""
        return len(self._buffer) - self._start

    def feed(self, data: bytes | bytearray | memoryview) -> None:
        """Append received bytes.

        Raises:
            LocalProtocolError: too many bytes are unread.
        """
        unread = self._buffer[self._start :]
        if len(unread) + len(data) > MAX_UNREAD:
            raise LocalProtocolError(f"more than {MAX_UNREAD} bytes are unread: read frames between feeds")
        self._buffer, self._start = unread + data, 0

    def read(self) -> Frame | None:
        """Read the next complete frame; None until more bytes arrive.

        Raises:
            RemoteProtocolError: the bytes are not a frame; the stream cannot be used any more.
        """
        buffer, start = self._buffer, self._start
        if start == len(buffer):
            return None
        body = start + HEADER.size
        if len(buffer) < body:
            # refuse a wrong magic at once: a peer of another protocol may never send a complete header
            if len(buffer) >= start + 2 and int.from_bytes(buffer[start : start + 2], "big") != MAGIC:
                raise _stranger(buffer[start:])
            return None
        magic, version, flags, type_, length, seq, request, time = HEADER.unpack_from(buffer, start)
        if magic != MAGIC:
            raise _stranger(buffer[start : start + HEADER.size])
        if flags > _TAGGED:
            raise _bad(f"the flags of a frame must be 0 or 1, got {flags:#04x}")
        if length > MAX_BODY:
            raise _bad(f"a frame announces {length} bytes; at most {MAX_BODY} are allowed")
        tag = self.tag
        if (tag is not None) != (flags == _TAGGED):
            raise forged(
                "a frame has no tag" if tag is not None else "a frame has a tag, but the session no key"
            )
        rest = body + length
        end = rest if tag is None else rest + TAG
        if len(buffer) < end:
            return None
        if tag is not None and not hmac.compare_digest(tag.of(buffer[start:rest]), buffer[rest:end]):
            raise forged("a frame has a wrong tag")
        self._start = end
        # not Frame(...), which calls a function of Python: a state comes a thousand times a second
        return tuple.__new__(Frame, (version, type_, seq, request, time, buffer[body:rest]))


def forged(text: str) -> RemoteProtocolError:
    """The error of a frame that is not the next one of the other side."""
    return RemoteProtocolError(
        f"{text}: it was forged, changed, repeated, reordered or lost in transit",
        code=int(Code.FORGED_FRAME),
        hint="check who else is on the network, then connect again",
    )


#: How others begin, and what they are.
_STRANGERS = {b"HTTP/": "a web server (HTTP)", b"SSH-": "an SSH server", b"GET ": "a web browser (HTTP)"}


def _stranger(begin: bytes) -> RemoteProtocolError:
    """The error of a peer that does not speak heptarm, named where its first bytes show what it is."""
    for mark, name in _STRANGERS.items():
        if begin[: len(mark)] == mark[: len(begin)]:
            return _bad(f"{name} is on this port, not heptarm")
    return _bad(f"a frame must begin with {MAGIC:04x}, got {begin[:2].hex()}")


def _bad(text: str) -> RemoteProtocolError:
    return RemoteProtocolError(
        text, code=int(Code.BAD_FRAME), hint="check that the other side speaks heptarm"
    )
