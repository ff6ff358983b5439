"""Transports a session over UDP from one fixed port, synchronous with the plant, without blocking."""

from __future__ import annotations

import contextlib
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace

from heptarm.errors import ConnectFailed, system_errors
from heptarm.fri.protocol.messages import DriveState
from heptarm.fri.protocol.version import MAX_DATAGRAM
from heptarm.io.udp import own_address
from heptarm.planning.seam import TICK_NS
from heptarm.sim.fri.controller_side import MOST_REFUSALS, Controller
from heptarm.sim.fri.faults import FaultScenario, FaultyLink
from heptarm.sim.fri.overlay import MotionOverlay, OverlayTarget, Reading
from heptarm.sim.fri.settings import Event, Refused, SessionConfiguration

#: The port of FRI on both sides; KUKA advises the next nine for further sessions and robots.
PORT = 30200
PORTS = range(PORT, PORT + 10)

Address = tuple[str, int]

#: After so long without an answer, a client on this machine is looked for in the system's table of sockets [ns].
DEAF = 1_000_000_000

#: Largest number of datagrams that one tick reads, so that a flood cannot delay the plant.
MOST = 64

# Linux: the kernel time-stamps datagrams (SO_TIMESTAMPNS), so that latency is not rounded up to the next tick
_STAMPS = 35 if sys.platform.startswith("linux") else None
_STAMP = struct.Struct("@qq")


def connected_to(port: int) -> int | None:
    """The remote port of a connected UDP socket on a port of this machine; None: there is none, or it is not Linux."""
    with contextlib.suppress(OSError), open("/proc/net/udp", encoding="ascii") as table:
        for line in list(table)[1:]:
            local, remote = (int(part.partition(":")[2], 16) for part in line.split()[1:3])
            if local == port and remote:
                return remote
    return None


def is_here(host: str) -> bool:
    """Whether an address is one of this machine's."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((host, 0))
        except OSError:
            return False
        return True


def source_port(client: Address) -> int:
    """The cabinet's port for a client: the client's own, as on a cabinet, unless both are on this machine.

    There the client needs its port, whichever of the two starts first.
    """
    host, port = client
    if not is_here(host):
        return port
    return port + 1 if port + 1 in PORTS or port not in PORTS else PORT


class Server:
    """One session, its socket, and the arm under its overlay.

    `tick` is called before each tick of the arm, in the same thread. `open`, `close`, `start` and
    `stop` may be called from any thread.

    Args:
        configuration: of the session.
        arm: the arm under the overlays.
        client: destination of the messages, IPv4.
        port: source port; None, or the client's own on this machine: see `source_port`; 0: any free one.
        bind: own address; empty: that of the interface to the client.
        speed: seconds of the arm's time per second; 0: the arm's time does not depend on the clock.
        clock: monotonic time [ns].
        scenario: faults to inject.
        listener: receives events, called by `tick`; must not block.

    Attributes:
        controller: the session.
        listener: see above.
        port: the own port.
        strangers: datagrams from other senders than the client.

    Raises:
        ConnectFailed: the port is in use, or the client's address does not resolve.
    """

    def __init__(
        self,
        configuration: SessionConfiguration,
        arm: OverlayTarget,
        *,
        client: Address,
        port: int | None = None,
        bind: str = "",
        speed: float = 1.0,
        clock: Callable[[], int] = time.monotonic_ns,
        scenario: FaultScenario | None = None,
        listener: Callable[[Event], None] | None = None,
    ) -> None:
        self._arm = arm
        self._client = _resolved(client)
        self._is_client_here = is_here(self._client[0])
        self._peers = {self._client}
        bind = bind or _towards(self._client)
        shared = port == client[1] and self._is_client_here
        self._socket = _beside(bind, client) if port is None or shared else _bound(bind, port)
        self.port: int = self._socket.getsockname()[1]
        self._stamped = _request_stamps(self._socket)
        self._clock, self._speed, self._origin = clock, speed, clock()
        self.listener = listener
        self._scenario = scenario or FaultScenario()
        self._there, self._back = FaultyLink(self._scenario.to_client), FaultyLink(self._scenario.from_client)
        self._lock = threading.Lock()
        self._ticks = 0
        self._before = 0  # time of the last tick
        self._deaf_at: int | None = DEAF if self._is_client_here else None
        self._refusals: list[Event] = []
        self._reported: set[str] = set()
        self.strangers = 0
        self.controller = Controller(
            configuration, arm.robot, epoch_ns=time.time_ns(), command_delay=arm.command_delay
        )

    def open(self) -> None:
        """Open the session and start to send.

        Raises:
            ModeConflict: it was opened before.
        """
        with self._lock:
            self.controller.open()

    def start(self, overlay: MotionOverlay) -> None:
        """Start an overlay with its motion.

        Raises:
            CommandRejected: this session cannot have such an overlay.
            ModeConflict: command and control mode do not match, or the session is not ready.
        """
        with self._lock:
            self.controller.start(overlay)

    def stop(self) -> None:
        """End the overlay after its motion."""
        with self._lock:
            self.controller.stop()

    def set(self, name: str, value: float) -> None:
        """Set a signal from the cabinet's side.

        Raises:
            CommandRejected: it is not registered, or cannot have that value.
        """
        with self._lock:
            self.controller.exchange.set(name, value)

    def close(self) -> None:
        """Close the session; the next tick sends its last message. `release` frees the port."""
        with self._lock:
            self.controller.close()

    def release(self) -> None:
        """Free the port, after the last tick."""
        self._socket.close()

    def tick(self) -> None:
        """Before a tick of the arm: take answers, send a message if one is due, set the overlay."""
        wall = self._clock()
        now = self._ticks * TICK_NS if self._speed == 0.0 else round((wall - self._origin) * self._speed)
        with self._lock:
            self._listen(wall, now)
            self._find_deaf_client(now)
            reading = self._reading(now)
            datagram = self.controller.tick(reading, now)
            if datagram is not None:
                said = self.controller.said
                assert said is not None
                self._there.send(self._scenario.sent(datagram, said, now * 1e-9), now)
            for message in self._there.arrived(now):
                self._send(message)
            action = self.controller.superposition
            events = self.controller.events() + self._refusals
            self._refusals = []
        self._arm.overlay(action)
        self._ticks, self._before = self._ticks + 1, now
        if self.listener is not None:
            for event in events:
                self.listener(event)

    def _reading(self, now: int) -> Reading:
        reading = self._arm.reading()
        stop = self._scenario.safety(now * 1e-9)
        return reading if stop is None else replace(reading, safety=stop, drives=DriveState.OFF)

    def _listen(self, wall: int, now: int) -> None:
        for _ in range(MOST):
            try:
                datagram, ancillary, _, address = self._socket.recvmsg(MAX_DATAGRAM + 1, 64)
            except BlockingIOError:
                break
            except OSError as error:
                self._report(f"receiving on port {self.port} failed: {error}")
                break
            if address not in self._peers and not self._answers_from(address):
                self.strangers += 1
                self._report(
                    f"a datagram from {address[0]}:{address[1]} was ignored; the session's client is "
                    f"{self._client[0]}:{self._client[1]}"
                )
                continue
            self._back.send(datagram, self._arrival(ancillary, wall, now))
        for answer, at in self._back.taken(now):
            self.controller.receive(answer, at)

    def _find_deaf_client(self, now: int) -> None:
        """Name a client on this machine that hears another port than this one, as a KUKA application with a host does.

        Its socket is connected to the port of a cabinet, which on one machine is its own; the system then drops every
        message from here, and neither side sees an error.
        """
        if self._deaf_at is None or now < self._deaf_at:
            return
        self._deaf_at = None
        heard = connected_to(self._client[1])
        if self.controller.traffic.taken or heard is None or heard == self.port:
            return
        self._report(
            f"the client on port {self._client[1]} only receives from port {heard}, and this cabinet sends from port "
            f"{self.port}: start the client without the address of the cabinet (with the SDK's connect(port, NULL))"
        )

    def _answers_from(self, address: Address) -> bool:
        """Whether an address is the client's, too: a client on this machine may answer from another one of its own."""
        known = address[1] == self._client[1] and self._is_client_here and is_here(address[0])
        if known:
            self._peers.add(address)
        return known

    def _arrival(self, ancillary: list[tuple[int, int, bytes]], wall: int, now: int) -> int:
        """Arrival time of a datagram: the kernel's time stamp, or else halfway between the last tick and this one."""
        if not self._stamped or self._speed == 0.0 or not ancillary:
            return (self._before + now) // 2
        seconds, nanoseconds = _STAMP.unpack(ancillary[0][2])
        age: int = time.time_ns() - (seconds * 1_000_000_000 + nanoseconds)
        at = now + round((self._clock() - age - wall) * self._speed)
        return max(self._before, min(at, now))

    def _send(self, datagram: bytes) -> None:
        try:
            self._socket.sendto(datagram, self._client)
        except OSError as error:
            self._report(f"sending to {self._client[0]}:{self._client[1]} failed: {error}")

    def _report(self, text: str) -> None:
        if text not in self._reported and len(self._reported) < MOST_REFUSALS:
            self._reported.add(text)
            self._refusals.append(Refused(text))


def _resolved(client: Address) -> Address:
    host, port = client
    if not 0 < port < 65536:
        raise ConnectFailed(
            f"the FRI client's port must be in [1, 65535], got {port}", hint=f"the default is {PORT}"
        )
    try:
        return socket.gethostbyname(host), port
    except (OSError, UnicodeError, TypeError) as error:  # a NUL is no character of a name
        raise ConnectFailed(f"the FRI client {host!r} has no IPv4 address: {error}") from error


def _towards(client: Address) -> str:
    """Own address towards the client; empty, which means all, while no interface reaches it."""
    try:
        return own_address(client[0])
    except ConnectFailed:
        return ""


def _bound(bind: str, port: int) -> socket.socket:
    with system_errors("the FRI controller has no UDP socket", kind=ConnectFailed):
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.bind((bind, port))
    except (OSError, OverflowError) as error:
        sock.close()
        raise ConnectFailed(
            f"UDP port {port} of the FRI controller is not available: {error}",
            hint=f"end the program that uses it, or choose another of {PORTS[0]} to {PORTS[-1]}",
        ) from error
    sock.setblocking(False)
    return sock


def _beside(bind: str, client: Address) -> socket.socket:
    """A socket on the port that belongs to a client; on another one if the client is on this machine.

    Several sessions on one machine use the same ten ports; a client answers to the source of the messages.
    """
    port = source_port(client)
    try:
        return _bound(bind, port)
    except ConnectFailed:
        return _bound(bind, source_port(("localhost", port)) if port == client[1] else 0)


def _request_stamps(sock: socket.socket) -> bool:
    if _STAMPS is None:
        return False
    with contextlib.suppress(OSError):
        sock.setsockopt(socket.SOL_SOCKET, _STAMPS, 1)
        return True
    return False
