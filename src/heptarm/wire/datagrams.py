"""Datagrams beside a session: which of them count, for either side; bytes in, frames out.

A datagram is the number of its session and one frame with a tag. Whatever else arrives is ignored and counted: it never
raises an error, and it never ends a session. The rules are on the page about the protocol.
"""

from __future__ import annotations

import hmac
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import count
from struct import Struct

from heptarm.errors import LocalProtocolError
from heptarm.wire.frames import Frame, pack, packer
from heptarm.wire.key import FrameTag
from heptarm.wire.messages import (
    DATAGRAMS,
    HEADER,
    MAGIC,
    MAJOR,
    MAX_DATAGRAM,
    MESSAGES,
    ONE_WAY,
    TAG,
    Message,
    OneWay,
)

#: The number of the session, before the frame.
PREFIX = Struct(">I")
_TAGGED = 1
_LEAST = PREFIX.size + HEADER.size + TAG
_SPENT = 1 << 32


def stream_of(kind: type[Message]) -> str:
    """The stream of a message: within one, only newer datagrams count."""
    return kind.KIND if kind.KIND in ("oneway", "request") else kind.__name__


@dataclass(slots=True)
class IgnoredDatagrams:
    """How many received datagrams counted, and why others did not.

    Attributes:
        accepted: received, in order and in time.
        old: repeated, or overtaken by a newer one of the same stream.
        late: older than allowed.
        forged: with a wrong tag.
        damaged: no frame of this session, or a message that no datagram may contain.
    """

    accepted: int = 0
    old: int = 0
    late: int = 0
    forged: int = 0
    damaged: int = 0


class Datagrams:
    """One side of the datagrams of a session. Several threads may send; one receives.

    Args:
        session: number of the session.
        source: "client" or "cabinet": this side.
        ours: tags of what this side sends.
        theirs: tags of what the other side sends.

    Attributes:
        ignored: counts of what was received.
    """

    def __init__(self, session: int, source: str, ours: FrameTag, theirs: FrameTag) -> None:
        self.ignored = IgnoredDatagrams()
        self._prefix = PREFIX.pack(session)
        self._ours, self._theirs = ours, theirs
        self._sent = count()
        self._newest: dict[str, int] = {}
        self._streams = {
            kind.TYPE: stream_of(kind) for kind in DATAGRAMS if kind.SOURCE == "both" or source != kind.SOURCE
        }
        self._packers = {kind: packer(kind, ours) for kind in ONE_WAY}

    def pack(self, message: Message, *, time: int, request: int = 0) -> bytes:
        """Pack a message.

        Args:
            message: one that a datagram may contain.
            time: the cabinet's clock [ns].
            request: of Stop and Cancel: the id of the request.

        Raises:
            LocalProtocolError: all sequence numbers are used; OpenDatagrams begins again.
        """
        frame = pack(
            message.TYPE, message.encode(), seq=self._number(), request=request, time=time, tag=self._ours
        )
        return self._prefix + frame

    def pack_numbers(self, kind: type[OneWay], numbers: Iterable[float], *, time: int, number: int) -> bytes:
        """Pack a servo target from the numbers of its fields; raises as `pack` does."""
        return self._prefix + self._packers[kind](self._number(), number, time, *numbers)

    def _number(self) -> int:
        seq = next(self._sent)
        if seq >= _SPENT:
            raise LocalProtocolError("all sequence numbers of the datagrams are used")
        return seq

    def receive(self, data: bytes, *, now: int, limit: int) -> Frame | None:
        """Take a received datagram; None: it is ignored and counted.

        Args:
            data: its bytes, whatever they are.
            now: the cabinet's clock [ns].
            limit: oldest that is accepted [ns].
        """
        frame = self._frame(data)
        if frame is None:
            return None
        ignored, stream = self.ignored, self._streams[frame.type]
        if frame.seq <= self._newest.get(stream, -1):
            ignored.old += 1
            return None
        if now - frame.time > limit:
            ignored.late += 1
            return None
        self._newest[stream] = frame.seq
        ignored.accepted += 1
        return frame

    def _frame(self, data: bytes) -> Frame | None:
        """The frame of a datagram with a right tag."""
        if len(data) < _LEAST or len(data) > MAX_DATAGRAM or data[: PREFIX.size] != self._prefix:
            self.ignored.damaged += 1
            return None
        frame, tag = data[PREFIX.size : -TAG], data[-TAG:]
        magic, version, flags, type_, length, seq, request, time = HEADER.unpack_from(frame)
        if (magic, version, flags, length) != (MAGIC, MAJOR, _TAGGED, len(frame) - HEADER.size):
            self.ignored.damaged += 1
            return None
        if not hmac.compare_digest(self._theirs.of(frame), tag):
            self.ignored.forged += 1
            return None
        if type_ not in self._streams or type_ not in MESSAGES:
            self.ignored.damaged += 1
            return None
        return Frame(version, type_, seq, request, time, frame[HEADER.size :])
