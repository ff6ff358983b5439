"""Connections that nobody needs, made by a process of its own: many held open, and new ones that keep coming."""

from __future__ import annotations

import resource
import selectors
import socket
import subprocess
import sys
import time
from collections import deque
from types import TracebackType

from heptarm.wire import messages
from heptarm.wire.frames import pack


class Flood:
    """Sockets against 127.0.0.1, until the block is left.

    Args:
        port: of the cabinet.
        held: sockets that are opened at once and never closed.
        rate: new connections per second, each closed by the cabinet or after five seconds [Hz].
        greets: each connection sends a valid Hello, so that without a key it becomes an observer.
    """

    def __init__(self, port: int, *, held: int, rate: float, greets: bool) -> None:
        arguments = [str(port), str(held), str(rate), "1" if greets else "0"]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "bench.trust.flood", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        self.is_ready = self._process.stdout.readline().strip() == "ready"

    def __enter__(self) -> Flood:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()  # it ends with its standard input
        try:
            self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _open(port: int, greeting: bytes) -> socket.socket | None:
    one = socket.socket()
    one.setblocking(False)
    one.connect_ex(("127.0.0.1", port))
    if greeting:
        one.setblocking(True)
        one.settimeout(2.0)
        try:
            one.sendall(greeting)
        except OSError:
            one.close()
            return None
        one.setblocking(False)
    return one


def main(port: int, held: int, rate: float, greets: bool) -> None:
    """Open the sockets, then new ones until standard input ends."""
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    hello = messages.Hello(major=messages.MAJOR, minor=0, name="flood", nonce=bytes(messages.NONCE))
    greeting = pack(messages.Hello.TYPE, hello.encode(), seq=0) if greets else b""
    kept = [_open(port, greeting) for _ in range(held)]
    coming: deque[tuple[float, socket.socket]] = deque()
    with selectors.DefaultSelector() as selector:
        selector.register(sys.stdin, selectors.EVENT_READ)
        print("ready", flush=True)
        due = time.monotonic()
        while not selector.select(max(0.0, due - time.monotonic())):
            due = max(due + 1.0 / rate, time.monotonic() - 0.1)
            one = _open(port, greeting)
            if one is not None:
                coming.append((due, one))
            while coming and coming[0][0] < due - 5.0:
                coming.popleft()[1].close()
    for last in (*kept, *(one for _, one in coming)):
        if last is not None:
            last.close()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4] == "1")
