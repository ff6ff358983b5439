"""What arrives over TCP and by datagram alike: states, of which the newest counts, and answers to pings."""

from __future__ import annotations

import threading
from collections.abc import Callable

from heptarm.wire.clock_sync import ClockOffset, PingDeparture


class Arrivals:
    """States and answers to pings of a link, over TCP or by datagram.

    Two threads call it, so each call takes a lock; the callback runs under it, and states reach it in order.

    Args:
        on_state: called with (body, our clock at its receipt [ns]) of each state that is newer than all before.

    Attributes:
        offset: estimate of the cabinet's clock.
        departure: of the last ping over TCP.
    """

    __slots__ = ("_lock", "_newest", "departure", "offset", "on_state")

    def __init__(self, on_state: Callable[[bytes, int], None]) -> None:
        self.offset = ClockOffset()
        self.on_state = on_state
        self.departure = PingDeparture()
        self._lock = threading.Lock()
        self._newest = -(1 << 63)

    def state(self, body: bytes, time: int, now: int) -> None:
        """Pass a state on, unless a newer one came by the other path.

        Args:
            body: of the message.
            time: of the sender [ns].
            now: our clock at its receipt [ns].
        """
        with self._lock:
            if time < self._newest:
                return
            self._newest = time
            self.on_state(body, now)

    def pong(self, sent: int, received: int, now: int) -> None:
        """Improve the estimate: our clock when a ping left, the cabinet's when it came, ours at the answer [ns]."""
        with self._lock:
            self.offset.feed(self.departure.of(sent), received, now)
