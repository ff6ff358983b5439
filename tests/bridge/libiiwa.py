"""What libiiwa's class is on the wire, by a program of our own: waits, then sends one request after the other."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable

PATIENCE = 60.0


class LibiiwaProgram:
    """A program that one bridge, or libiiwa's application, may connect to; numbers are of struct's format `letter`."""

    def __init__(self, letter: str) -> None:
        self.letter = letter
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(PATIENCE)
        self.port: int = self.listener.getsockname()[1]
        self.connection: socket.socket | None = None

    def accept(self) -> None:
        self.connection = self.listener.accept()[0]
        self.connection.settimeout(PATIENCE)

    def send(self, code: float, *arguments: float) -> None:
        assert self.connection is not None
        numbers = [code, *arguments, *[0.0] * (7 - len(arguments))]
        self.connection.sendall(struct.pack(f"!8{self.letter}", *numbers))

    def receive(self) -> tuple[float, ...]:
        assert self.connection is not None
        layout = struct.Struct(f"!38{self.letter}")
        data = b""
        while len(data) < layout.size:
            more = self.connection.recv(layout.size - len(data))
            assert more, "the bridge has closed the connection"
            data += more
        return layout.unpack(data)

    def ask(self, code: float, *arguments: float) -> tuple[float, ...]:
        self.send(code, *arguments)
        return self.receive()

    def command(self, code: float, *arguments: float) -> tuple[float, ...]:
        answer = self.ask(code, *arguments)
        assert answer[0] == 1.0, f"{code} is refused with {answer[34]}"
        return answer

    def until(self, holds: Callable[[tuple[float, ...]], bool]) -> tuple[float, ...]:
        deadline = time.monotonic() + PATIENCE
        while not holds(answer := self.ask(0)):
            assert time.monotonic() < deadline, answer
            time.sleep(0.005)
        return answer

    def rest(self) -> tuple[float, ...]:
        return self.until(lambda answer: answer[37] == 0.0)

    def close(self) -> None:
        if self.connection is not None:
            self.connection.close()
        self.listener.close()
