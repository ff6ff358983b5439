"""Stop the arm without a session: for anyone, with or without a key, however many clients are connected."""

from __future__ import annotations

from collections.abc import Callable

from heptarm.errors import ConnectFailed, ConnectionLost, HeptarmError
from heptarm.io.clock import Clock
from heptarm.io.transport import Transport
from heptarm.wire.codes import MEANINGS, Code
from heptarm.wire.messages import Halt, Halted, Refusal, StopKind
from heptarm.wire.session import Received, Session, Side

_BUFFER = 4096
#: Refusals after which another attempt may succeed at once.
BUSY = (Code.TOO_MANY_CLIENTS, Code.SILENT)
#: Pause before another attempt [s].
PAUSE = 0.01


def halt(dial: Callable[[], Transport], kind: StopKind, *, clock: Clock, timeout: float) -> None:
    """Stop the arm over a connection of its own; returns when the cabinet has commanded the stop.

    Args:
        dial: makes a connection to the cabinet.
        kind: how to stop.
        clock: this side's clock.
        timeout: how long to try [s].

    Raises:
        ConnectFailed: no cabinet answers there, or it refuses the stop.
        ConnectionLost: the connection broke at every attempt.
    """
    deadline = clock.nanos() + round(timeout * 1e9)
    while True:
        transport = dial()
        try:
            _halt_once(transport, kind, clock, deadline)
            return
        except ConnectionLost:
            if clock.nanos() > deadline:
                raise
        except ConnectFailed as error:
            if error.code not in BUSY or clock.nanos() > deadline:
                raise
        finally:
            transport.close()
        clock.sleep(PAUSE)


def _halt_once(transport: Transport, kind: StopKind, clock: Clock, deadline: int) -> None:
    session = Session(Side.CLIENT)
    transport.send(session.send(Halt(kind=kind), time=clock.nanos()))
    view = memoryview(bytearray(_BUFFER))
    while clock.nanos() <= deadline:
        size = transport.receive_into(view)
        session.receive_data(view[:size])
        for event in session.events():
            message = event.message if isinstance(event, Received) else None
            if isinstance(message, Halted):
                return
            if message is not None:
                raise _refused(transport.peer, message)
    raise ConnectFailed(
        f"{transport.peer} accepted the connection but does not answer a stop",
        hint="press the emergency stop; then check that heptarm's application runs on the cabinet",
    )


def _refused(peer: str, message: object) -> HeptarmError:
    code = getattr(message, "code", 0)
    text = getattr(message, "text", "") if isinstance(message, Refusal) else f"it answered {message}"
    meaning = MEANINGS.get(code)
    return ConnectFailed(
        f"{peer} refuses the stop: {text}",
        code=code,
        hint="press the emergency stop"
        if meaning is None
        else f"press the emergency stop, or: {meaning.advice}",
    )
