"""A request and its answer over TCP in one call of C, which Ctrl-C cannot cut; a state is received in another."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Literal, Protocol, TypeVar, cast

from heptarm._library import Unavailable, extension_file
from heptarm.wire.messages import Message
from heptarm.wire.session import Session

P = TypeVar("P", covariant=True)


class Exchange(Protocol[P]):
    """Sends a request and waits for what comes next."""

    def __call__(
        self, kind: type[Message], type: int, time: int, body: bytes
    ) -> tuple[int, bytes] | P | None:
        """Send a request and wait for what comes next, for up to the time-out of the socket.

        Args:
            kind: class of the request.
            type: its number.
            time: our clock [ns].
            body: of the request.

        Returns:
            Type and body of the answer. An entry of `pending`: the request was sent, but something else came first,
            which is in `left` now, or nothing came in time. None: nothing was sent, since another thread sends or
            reads, a frame has been read in part, the request is long, or the socket takes nothing now.

        Raises:
            OSError: the connection is lost.
        """
        ...


class ReceiveState(Protocol):
    """Receives the next state."""

    def __call__(self, type: int, flags: int) -> tuple[int, bytes] | Literal[False] | None:
        """Receive a state; the caller holds the lock of the thread that reads.

        Args:
            type: number of the message State.
            flags: of recv(2); 0: wait for up to the time-out of the socket.

        Returns:
            The sender's clock [ns] and the body of a state, if that and nothing else has come. None: nothing has come.
            False: something else, which is in `left`, or there is something to be read first, or the connection ends.

        Raises:
            OSError: the connection is lost.
        """
        ...


def compiled_link(
    session: Session,
    socket: Callable[[], int],
    *,
    left: list[bytes],
    pending: dict[int, P],
    spare: list[P],
    reading: threading.Lock,
    sending: threading.Lock,
) -> tuple[Exchange[P], ReceiveState] | None:
    """The functions of a connection.

    None: no socket, no compiled part (Windows), or a Python without its lock, which protects the counts; then
    `heptarm.wire.session` alone writes and reads the frames, as it does in every case but the usual one.

    Args:
        session: it sends `simple_requests` of this session.
        socket: gets the descriptor of the connected socket; negative: there is none.
        left: receives bytes that the caller has to read before all others.
        pending: receives the requests whose answers have to be waited for, by their ids.
        spare: what is put there; without any, nothing is sent.
        reading: lock of the thread that reads the socket.
        sending: lock of the thread that writes to it.
    """
    if socket() < 0 or not getattr(sys, "_is_gil_enabled", lambda: True)():
        return None
    try:
        extension_file()
    except Unavailable:
        return None
    from heptarm._native import exchange_functions

    locks = reading.acquire, reading.release, sending.acquire, sending.release
    made = exchange_functions(
        (session.counts, session.waiting, session.tags, left, pending, spare, socket, *locks)
    )
    return cast("tuple[Exchange[P], ReceiveState]", made)
