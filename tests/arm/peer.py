"""A cabinet that follows a script, over a transport in memory or TCP. `close` fails if a step was not consumed."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from heptarm.arm.arm import Arm
from heptarm.arm.link.connection import Connection, Options
from heptarm.errors import ConnectionLost
from heptarm.io.clock import RealClock
from heptarm.io.transport import MemoryTransport, Transport, memory_pair
from heptarm.wire import messages as wire
from heptarm.wire.session import Received, Session, Side
from heptarm.wire.states import SessionState
from tests.wire.pairs import ROBOT, welcome

Reply = wire.Message | Callable[["Served", int], None]


@dataclass
class Step:
    kind: type[Any]
    replies: tuple[Reply, ...]
    check: Callable[[Any], object] | None = None


@dataclass
class Served:
    """One client's connection."""

    peer: Peer
    transport: Transport
    session: Session
    lock: threading.Lock = field(default_factory=threading.Lock)
    rate: float = 0.0
    is_mute: bool = False

    def say(self, message: wire.Message, request: int = 0) -> None:
        with self.lock:
            data = self.session.send(message, request=request, time=time.monotonic_ns())
            self.transport.send(data)


class Peer:
    """A scripted cabinet; it answers harmless requests that are not in the script as a cabinet does."""

    def __init__(self, *, chunk: int | None = None, key: bytes | None = None, **changes: object) -> None:
        self.chunk, self.key, self.changes = chunk, key, {"robot": ROBOT} | changes
        self.steps: deque[Step] = deque()
        self.seen: list[wire.Message] = []
        self.problems: list[str] = []
        self.clients: list[Served] = []
        self.threads: list[threading.Thread] = []
        self.dials = 0
        self.refuses_dials = 0
        self.motion = 0
        self.pushed = 0
        self.progress = 0.5
        self.safety = wire.SafetyBits.READY_TO_MOVE
        self.override = 1.0
        self.clock_rate = 1.0  # of the clock that answers pings, in seconds per second of ours
        self.q = (0.1,) * 7
        self.dq = (0.0,) * 7
        self.is_open = True

    # -- script

    def expect(self, kind: type[Any], *replies: Reply, check: Callable[[Any], object] | None = None) -> Peer:
        self.steps.append(Step(kind, replies, check))
        return self

    def runs(self, number: int, *more: Reply, check: Callable[[Any], object] | None = None) -> Peer:
        """Accept a Run with this id."""
        return self.expect(wire.Run, wire.Accepted(id=number), *more, check=check)

    def finished(
        self, number: int, cause: wire.Cause = wire.Cause.FINISHED, **more: Any
    ) -> wire.MotionFinished:
        fields: dict[str, Any] = {
            "item": 0,
            "fired": -1,
            "residual": 1e-5,
            "duration": 1.5,
            "q": self.q,
            "code": 0,
            "text": "",
        }
        return wire.MotionFinished(id=number, cause=cause, **(fields | more))

    def tell(self, message: wire.Message) -> None:
        """To every client."""
        for client in self.clients:
            if client.session.state is SessionState.OPEN:
                client.say(message)

    # -- connections

    def dial(self) -> MemoryTransport:
        self.dials += 1
        if self.refuses_dials:
            self.refuses_dials -= 1
            raise ConnectionLost("nobody there")
        ours, theirs = memory_pair(chunk=self.chunk)
        self.serve(theirs)
        return ours

    def serve(self, transport: Transport) -> Served:
        """Begin to serve a client."""
        client = Served(self, transport, Session(Side.CABINET, key=self.key))
        self.clients.append(client)
        thread = threading.Thread(target=self._serve, args=(client,), name=f"peer-{len(self.clients)}")
        self.threads.append(thread)
        thread.start()
        return client

    def drop(self) -> None:
        """Break all connections."""
        for client in self.clients:
            client.transport.close()

    def arm(self, *, control: bool = True, **options: Any) -> Arm:
        settings = {"timeout": 20.0, "rate": 200.0, "groups": ("joints", "motion", "safety")} | options
        arm = Arm(Connection(self.dial, Options(**settings), clock=RealClock()))  # type: ignore[arg-type]
        try:
            arm.open(control=control)
        except BaseException:
            arm.close()
            raise
        return arm

    def close(self) -> None:
        self.is_open = False
        self.drop()
        for thread in self.threads:
            thread.join(20.0)
            assert not thread.is_alive()
        assert not self.problems, self.problems
        assert not self.steps, f"never consumed: {[step.kind.__name__ for step in self.steps]}"

    # -- serving

    def _serve(self, client: Served) -> None:
        buffer = memoryview(bytearray(65536))
        client.transport.set_patience(0.002)
        due = 0.0
        try:
            while self.is_open and client.session.state is not SessionState.CLOSED:
                size = client.transport.receive_into(buffer)
                if size:
                    client.session.receive_data(buffer[:size])
                    for event in client.session.events():
                        assert isinstance(event, Received)
                        self._answer(client, event)
                now = time.monotonic()
                is_open = client.session.state is SessionState.OPEN  # it may just have sent Goodbye
                if client.rate and now >= due and is_open and not client.is_mute:
                    due = now + 1.0 / client.rate
                    client.say(self.state())
                    self.pushed += 1
        except ConnectionLost:
            pass
        except BaseException as error:
            self.problems.append(repr(error))
            raise
        finally:
            client.transport.close()

    def clock(self) -> int:
        return round(self.clock_rate * time.monotonic_ns())

    def state(self) -> wire.State:
        now = time.monotonic_ns()
        return wire.State(
            joints=wire.JointState(stamp=now, q=self.q, q_cmd=self.q, dq=self.dq),
            motion=wire.MotionState(
                stamp=now,
                motion=self.motion,
                item=0,
                queued=0,
                progress=self.progress,
                remaining=1.0,
                override=self.override,
            ),
            safety=wire.SafetyState(stamp=now, bits=self.safety, mode=wire.OperationMode.AUT),
        )

    def _answer(self, client: Served, event: Received) -> None:
        message, request = event.message, event.request
        if client.is_mute:
            return
        if isinstance(message, wire.Ping):
            client.say(wire.Pong(sent=message.sent, received=self.clock()))
            return
        if isinstance(message, wire.Pong):
            self.seen.append(message)
            return
        self.seen.append(message)
        if self.steps and isinstance(message, self.steps[0].kind):
            step = self.steps.popleft()
            if step.check is not None and step.check(message) is False:
                self.problems.append(f"check failed for {message}")
            for reply in step.replies:
                if callable(reply):
                    reply(client, request)
                else:
                    client.say(reply, request if reply.KIND == "answer" else 0)
            return
        if isinstance(message, wire.Hello):
            client.say(welcome(**self.changes))
        elif isinstance(message, wire.Subscribe):
            client.say(wire.Accepted(id=0), request)
            client.rate = message.rate
        elif isinstance(message, wire.TakeControl | wire.ReleaseControl | wire.Stop):
            client.say(wire.Accepted(id=0), request)
        elif isinstance(message, wire.Halt):
            client.say(wire.Halted())
        elif not isinstance(message, wire.Goodbye):
            self.problems.append(f"nobody expected {message}")
