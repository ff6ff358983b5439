"""Recovery: what software may do to make the robot ready again, and the steps that it leaves to a person."""

from __future__ import annotations

from contextlib import suppress

from heptarm.arm.link.connection import Connection
from heptarm.errors import ConnectFailed, ConnectionLost, HeptarmError, NeedsOperator, NotInControl, Timeout
from heptarm.values.result import Recovery
from heptarm.values.state import State
from heptarm.wire import messages as wire

#: Pause between two attempts [s].
_PAUSE = 0.2
#: Longest wait for the first state that shows the recovered robot [s].
_STATE_TIMEOUT = 2.0


class RecoveryAttempts:
    """Attempts to make the robot ready: connect, take control, acknowledge errors and resume, as far as needed.

    Args:
        connection: to the cabinet.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._done: list[str] = []

    def run(self, timeout: float) -> Recovery:
        """Try until the robot is ready or a time has passed [s]; at least once.

        Raises:
            ConnectionLost: the arm was closed.
            CommandRejected: the cabinet does not support recovery.
        """
        connection = self._connection
        deadline = connection.clock.nanos() + round(timeout * 1e9)
        while True:
            remaining = self._attempt()
            if not remaining:
                return Recovery(done=True, did=tuple(self._done))
            if connection.clock.nanos() >= deadline or connection.closed.is_set():
                return Recovery(done=False, did=tuple(self._done), remaining=remaining)
            connection.clock.sleep(_PAUSE)

    def _attempt(self) -> tuple[str, ...]:
        """Try once; returns the steps that remain for a person."""
        connection = self._connection
        connection.check_open()
        try:
            self._connect()
        except NotInControl:
            return (f"let {connection.controller or 'another client'} release control",)
        except (ConnectFailed, ConnectionLost) as error:
            return (_unreachable(error),)
        before = connection.newest()
        try:
            connection.request(wire.Recover())
        except NeedsOperator as error:
            return tuple(error.text.split("; "))
        except (ConnectionLost, Timeout) as error:
            return (_unreachable(error),)
        self._done += _recovered(before)
        if connection.options.rate > 0 and "safety" in connection.options.groups:
            with suppress(
                HeptarmError
            ):  # the cabinet reported that it is ready: a late state changes nothing
                connection.wait_for(
                    lambda state: state.groups.safety is not None and bool(state.groups.safety.ready_to_move),
                    _STATE_TIMEOUT,
                )
        return ()

    def _connect(self) -> None:
        """Connect and take control, if this client is not connected or not in control."""
        connection = self._connection
        if not connection.is_connected:
            try:
                connection.reopen()
            finally:
                if connection.is_connected:
                    self._done.append("made a new connection")
        if not connection.in_control:
            connection.take_control()
            self._done.append("took control")


def _unreachable(error: HeptarmError) -> str:
    return f"check that the cabinet application runs and can be reached: {error.text}"


def _recovered(before: State | None) -> list[str]:
    """What recovery did to a robot in this state, in words."""
    if before is None or before.groups.safety is None:
        return []
    words = []
    if before.groups.safety.protective_stop:
        words.append("acknowledged an error")
    if before.groups.safety.paused:
        motion = before.motion
        is_running = motion is not None and motion.active
        words.append(f"let motion {motion.id} go on" if motion and is_running else "ended the pause")
    return words
