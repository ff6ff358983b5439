"""A request and its answer over TCP in one call of C, which Ctrl-C cannot cut; a state is received in another."""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Literal, Protocol, TypeVar, cast

from heptarm.io.compiled import Unavailable, compiled_library, with_headers
from heptarm.wire.messages import Message
from heptarm.wire.session import Session

_SOURCE = Path(__file__).with_name("exchange.c")


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

    None: no socket, no compiler, no libcrypto for a session with a key, or a system or Python that is not supported.

    Args:
        session: it sends `simple_requests` of this session.
        socket: gets the descriptor of the connected socket; negative: there is none.
        left: receives bytes that the caller has to read before all others.
        pending: receives the requests whose answers have to be waited for, by their ids.
        spare: what is put there; without any, nothing is sent.
        reading: lock of the thread that reads the socket.
        sending: lock of the thread that writes to it.
    """
    library = _library() if socket() >= 0 else None
    if library is None or (session.has_key and not _takes_hash(library)):
        return None
    locks = reading.acquire, reading.release, sending.acquire, sending.release
    made = library.he_functions(
        (session.counts, session.waiting, session.tags, left, pending, spare, socket, *locks)
    )
    return cast("tuple[Exchange[P], ReceiveState]", made)


@functools.cache
def _library() -> ctypes.CDLL | None:
    if not getattr(sys, "_is_gil_enabled", lambda: True)():
        return None  # Python's lock protects the counts
    source = with_headers(_SOURCE, _SOURCE.with_name("frame_layout.h"))
    try:
        made = compiled_library("exchange", source, holds_gil=True)
    except Unavailable:
        return None
    made.he_functions.argtypes, made.he_functions.restype = (ctypes.py_object,), ctypes.py_object
    return made


def _takes_hash(library: ctypes.CDLL) -> bool:
    """Give a library the SHA-256 of libcrypto: of Python's own, or of the system's where Python's is not visible."""
    pythons = importlib.util.find_spec("_hashlib")
    names = [pythons.origin] if pythons else []
    for name in (*names, "libcrypto.so.3", "libcrypto.so.1.1"):
        try:
            crypto = ctypes.CDLL(name)
            library.he_hash(crypto.SHA256_Init, crypto.SHA256_Update, crypto.SHA256_Final)
            return True
        except (OSError, AttributeError):
            continue
    return False
