"""The heartbeat of a link, sans IO: when a ping is due, and when the cabinet has been silent for too long."""

from __future__ import annotations

from heptarm.errors import ConnectionLost
from heptarm.wire.codes import Code

#: A link is not given up before so long a silence [s].
_PATIENCE = 1.0


class Heartbeat:
    """Pings often enough for what the cabinet tolerates; the cabinet's pings and answers prove that it lives.

    Attributes:
        tolerated: how long the cabinet tolerates silence [s].
        watchdog: how long its watchdog over the controller does [s]; infinite: there is none.
        heard: our clock when octets came last [ns].
    """

    __slots__ = ("heard", "tolerated", "watchdog")

    def __init__(self, now: int) -> None:
        self.tolerated = 1.0
        self.watchdog = float("inf")
        self.heard = now

    @property
    def interval(self) -> int:
        """Pause between pings [ns]: a quarter of what the cabinet tolerates."""
        return round(min(self.tolerated, self.watchdog) / 4 * 1e9)

    def check(self, now: int, peer: str) -> None:
        """Judge the silence so far.

        Raises:
            ConnectionLost: it has lasted for two heartbeats, and for a second.
        """
        silence = (now - self.heard) * 1e-9
        if silence > max(2 * self.tolerated, _PATIENCE):
            raise ConnectionLost(
                f"nothing heard from {peer} for {silence:.1f} s",
                code=int(Code.SILENT),
                hint="check the network and the load of both machines",
            )
