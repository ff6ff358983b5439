"""Making the robot ready again: what software may do, and what it has to leave to a person, in words."""

from __future__ import annotations

from contextlib import suppress

from heptarm.arm.connection import Connection
from heptarm.errors import ConnectFailed, ConnectionLost, HeptarmError, NeedsOperator, NotInControl, Timeout
from heptarm.values.recovery import Recovery
from heptarm.values.state import State
from heptarm.wire import messages as wire

#: Pause between two attempts while a person is waited for [s].
_PAUSE = 0.2
#: How long the first state that shows the recovered robot may take [s].
_LOOK = 2.0


def recover(connection: Connection, *, timeout: float) -> Recovery:
    """Connect, take control, acknowledge and resume, as far as is needed; again until a time has passed [s].

    Raises:
        ConnectionLost: the arm was closed.
        CommandRejected: the cabinet does not know what recovering is.
    """
    deadline = connection.clock.nanos() + round(timeout * 1e9)
    did: list[str] = []
    while True:
        remaining = _attempt(connection, did)
        if not remaining:
            return Recovery(done=True, did=tuple(did))
        if connection.clock.nanos() >= deadline or connection.closed.is_set():
            return Recovery(done=False, did=tuple(did), remaining=remaining)
        connection.clock.sleep(_PAUSE)


def _attempt(connection: Connection, did: list[str]) -> tuple[str, ...]:
    """One attempt; returns what is left to a person."""
    connection.check_open()
    try:
        if not connection.stands:
            try:
                connection.reopen()
            finally:
                if connection.stands:
                    did.append("made a new connection")
        if not connection.controls:
            connection.take_control()
            did.append("took control")
    except NotInControl:
        who = connection.controller or "another client"
        return (f"let {who} release control",)
    except (ConnectFailed, ConnectionLost) as error:
        return (f"see that the cabinet application runs and can be reached: {error.text}",)
    before = connection.newest()
    try:
        connection.request(wire.Recover())
    except NeedsOperator as error:
        return tuple(error.text.split("; "))
    except (ConnectionLost, Timeout) as error:
        return (f"see that the cabinet application runs and can be reached: {error.text}",)
    did += _words(before)
    if connection.options.rate > 0 and "safety" in connection.options.groups:
        with suppress(HeptarmError):  # the cabinet has said that it is ready: a late state changes nothing
            connection.wait_for(lambda seen: seen.status is not None and seen.status.ready_to_move, _LOOK)
    return ()


def _words(before: State | None) -> list[str]:
    """What recovering meant for a robot in that state."""
    if before is None or before.status is None:
        return []
    words = []
    if before.status.protective_stop:
        words.append("acknowledged an error")
    if before.status.paused:
        motion = before.motion
        running = motion is not None and motion.active
        words.append(f"let motion {motion.id} go on" if motion and running else "ended the pause")
    return words
