"""When a link pings, and when the cabinet counts as lost."""

from __future__ import annotations

from heptarm.errors import ConnectionLost
from heptarm.wire.codes import Code

#: Shortest silence after which a link counts as lost [s].
_MIN_SILENCE = 1.0
#: Longest silence of TCP while datagrams arrive [s]: it is slow on a bad network, but answers and events need it.
_MAX_TCP_SILENCE = 10.0


class Heartbeat:
    """Ping interval towards the cabinet, and the check that the cabinet is still alive.

    Attributes:
        timeout: silence after which the cabinet ends the session [s].
        watchdog: silence after which the cabinet counts a controller as lost [s]; infinite: not in control.
        received: our clock when a frame last arrived over TCP [ns].
        datagram: our clock when a datagram last arrived [ns].
        due: our clock when the next ping is due [ns].
    """

    __slots__ = ("_looked", "datagram", "due", "received", "timeout", "watchdog")

    def __init__(self, now: int) -> None:
        self.timeout = 1.0
        self.watchdog = float("inf")
        self.received = self.datagram = self.due = self._looked = now

    @property
    def interval(self) -> int:
        """Time between pings [ns]: a quarter of the shorter timeout, so that one late ping costs nothing."""
        return round(min(self.timeout, self.watchdog) / 4 * 1e9)

    def pinged(self, now: int) -> None:
        """Note that a ping leaves."""
        self.due = now + self.interval

    def look(self, now: int) -> None:
        """Note that the link is looked after now, as it is at least once per interval while this process runs.

        If it was not for longer, this process or its machine stood still: then nobody could have heard anything, and
        that time is no silence.
        """
        still = now - self._looked - self.interval
        if still > 0:
            self.received = min(now, self.received + still)
            self.datagram = min(now, self.datagram + still)
        self._looked = now

    def check(self, now: int, peer: str) -> None:
        """Check the silence so far.

        Raises:
            ConnectionLost: the cabinet has been silent for two timeouts, and for at least a second; or TCP has been
                silent for much longer while datagrams arrive.
        """
        self.look(now)
        allowed = max(2 * self.timeout, _MIN_SILENCE)
        silence = (now - max(self.received, self.datagram)) * 1e-9
        over_tcp = (now - self.received) * 1e-9
        if silence <= allowed < over_tcp:
            silence, allowed = over_tcp, max(allowed, _MAX_TCP_SILENCE)
        if silence > allowed:
            raise ConnectionLost(
                f"the connection to {peer} is lost: nothing received for {silence:.1f} s, allowed are {allowed:g} s",
                code=int(Code.SILENT),
                hint="check the network and the load of both machines",
            )
