"""What every transport can do. `tcp` and `memory` are two; tests/transports/conformance.py is what each must pass."""

from __future__ import annotations

from typing import Protocol


class Transport(Protocol):
    """A reliable, ordered stream of octets in both directions.

    One thread may send while another one receives; two may not send, or receive, at the same time.
    """

    @property
    def peer(self) -> str:
        """The other end, for people."""
        ...

    def send(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            ConnectionLost: the other side is gone, or does not read within the time-out.
        """
        ...

    def receive_into(self, buffer: memoryview, *, wait: bool = True) -> int:
        """Put octets that came into the buffer; nothing is lost when the call is interrupted while it waits.

        Args:
            buffer: where to put them.
            wait: for up to the patience when there are none.

        Returns:
            How many came; 0 if none.

        Raises:
            ConnectionLost: the other side has closed, or was lost, or this side has closed.
        """
        ...

    def wait_readable(self, seconds: float) -> bool:
        """Wait until octets (or the end) can be received, without receiving them; one thread at a time."""
        ...

    def set_patience(self, seconds: float) -> None:
        """How long `receive_into` waits for octets."""
        ...

    def close(self) -> None:
        """End it; a waiting `receive_into` ends with ConnectionLost. Closing twice is legal."""
        ...
