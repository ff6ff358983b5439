"""A minimal controller: sends monitoring messages through the states of a session and records the answers."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from heptarm.fri.protocol import codec
from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.messages import CommandMode, Quality, SessionState
from heptarm.fri.protocol.version import Version

IPO = (0.1, 0.4, -0.1, -1.2, 0.2, 0.9, 0.0)


@dataclass
class Controller:
    """Sends to a client on this machine; `state` and the other fields may be changed while it runs."""

    port: int
    wire: Version = Version.V1_15
    state: SessionState = SessionState.MONITORING_WAIT
    quality: Quality = Quality.GOOD
    mode: CommandMode = CommandMode.POSITION
    period_ms: int = 2
    sequence: int = 0
    ipo: tuple[float, ...] = IPO
    io: tuple[m.IoValue, ...] = ()
    requested: tuple[m.Transformation, ...] = ()
    redundancy: m.Redundancy | None = None
    mangle: Callable[[bytes], bytes | None] = bytes
    answers: list[m.Command] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sock.bind(("127.0.0.1", 0))
        self._sock.setblocking(False)
        self._reflected = 0
        self._stop = False
        self.longest_pause = 0.0  # between two messages [s]
        self._thread = threading.Thread(target=self._run)

    def datagram(self) -> bytes:
        quaternions = self.wire.traits.quaternions
        pose = m.Transformation("ipo", (100.0, 200.0, 300.0, 1.0, 0.0, 0.0, 0.0)) if quaternions else None
        commanding = self.state >= SessionState.COMMANDING_WAIT
        value = m.Monitoring(
            m.Header(self.sequence, self._reflected),
            m.RobotInfo(
                7,
                m.Safety.NORMAL_OPERATION,
                (m.DriveState.ACTIVE,) * 7,
                m.OperationMode.AUT,
                m.ControlMode.POSITION,
            ),
            m.MonitorData(
                q=self.position(),
                tau=(1.0,) * 7,
                q_cmd=None if quaternions else self.position(),
                tau_ext=(0.5,) * 7,
                io=self.io,
                pose=pose,
                stamp=m.TimeStamp(1_700_000_000, self.sequence),
            ),
            m.ConnectionInfo(self.state, self.quality, self.period_ms, 1),
            m.IpoData(
                q=self.ipo,
                pose=pose,
                redundancy=self.redundancy,
                command_mode=self.mode,
                overlay=m.Overlay.JOINT,
                tracking=1.0,
            )
            if commanding
            else None,
            self.requested,
        )
        return codec.encode_monitoring(value, self.wire)

    def position(self) -> tuple[float, ...]:
        """The arm is where it was commanded last."""
        last = self.answers[-1] if self.answers else None
        commanding = self.state is SessionState.COMMANDING_ACTIVE
        return last.q if commanding and last is not None and last.q is not None else self.ipo

    def step(self) -> None:
        """Send one message and record the answers received so far."""
        with contextlib.suppress(BlockingIOError, ConnectionRefusedError):
            while True:
                raw = self._sock.recv(2048)
                self.answers.append(codec.decode_command(raw, self.wire))
                self._reflected = self.answers[-1].header.sequence
        sent = self.mangle(self.datagram())
        if sent is not None:
            with contextlib.suppress(ConnectionRefusedError):
                self._sock.sendto(sent, ("127.0.0.1", self.port))
        self.sequence += 1

    def _run(self) -> None:
        before = time.monotonic()
        while not self._stop:
            self.step()
            time.sleep(self.period_ms * 1e-3)
            now = time.monotonic()
            self.longest_pause, before = max(self.longest_pause, now - before), now

    @contextlib.contextmanager
    def running(self) -> Iterator[Controller]:
        self._thread.start()
        try:
            yield self
        finally:
            self._stop = True
            self._thread.join()
            self._sock.close()

    def settle(self) -> None:
        """Wait for answers to three more messages."""
        count, deadline = len(self.answers), time.monotonic() + 30.0
        while len(self.answers) < count + 3:
            assert time.monotonic() < deadline, "the client answers no more"
            time.sleep(self.period_ms * 1e-3)

    def walk(self, *states: SessionState, pause: float = 0.05) -> None:
        """Pass through states, with some messages in each."""
        for state in states:
            self.state = state
            time.sleep(pause)

    def active(self) -> None:
        """Up to COMMANDING_ACTIVE."""
        self.walk(SessionState.MONITORING_READY, SessionState.COMMANDING_WAIT, SessionState.COMMANDING_ACTIVE)
