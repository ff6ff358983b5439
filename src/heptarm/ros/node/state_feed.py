"""Robot states across reconnections: what a node publishes, even if the network fails for a while."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.values.state import State

_log = logging.getLogger("heptarm.ros")

#: First and longest pause between attempts to reconnect [s].
_BACK_OFF, _LONGEST_BACK_OFF = 0.2, 2.0
#: How long to wait for the thread when closing [s].
_JOIN_TIMEOUT = 5.0


class ReconnectingStates:
    """Forwards every state from its own thread, and reconnects when the connection is lost.

    Args:
        arm: connected.
        on_state: receives each new state; it must not block.
        on_link: receives "" when connected, otherwise why the connection was lost; it must not block.
    """

    def __init__(
        self, arm: Arm, *, on_state: Callable[[State], None], on_link: Callable[[str], None]
    ) -> None:
        self._arm = arm
        self._on_state, self._on_link = on_state, on_link
        self._ended = threading.Event()
        self._link_error = ""
        self._thread = threading.Thread(target=self._run, name="heptarm-states")
        self._thread.start()
        on_link("")

    @property
    def link_error(self) -> str:
        """Why there is no connection; empty: connected."""
        return self._link_error

    @property
    def ended(self) -> bool:
        """Whether `end` was called."""
        return self._ended.is_set()

    def end(self) -> None:
        """Stop reconnecting: from now on the connection is closed on purpose."""
        self._ended.set()

    def join(self) -> None:
        """Wait for the thread, once the arm's connection is closed."""
        self._thread.join(_JOIN_TIMEOUT)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                for state in self._arm.states(size=16):
                    self._on_state(state)
            except HeptarmError as error:
                if self._ended.is_set():
                    return
                self._lose(str(error))
            except Exception:
                _log.exception("publishing a state")
            if not self._ended.is_set():
                self._reconnect()

    def _lose(self, why: str) -> None:
        self._link_error = why
        self._on_link(why)

    def _reconnect(self) -> None:
        pause = _BACK_OFF
        while not self._ended.is_set() and not self._arm.connected:
            try:
                self._arm.reconnect()
                _log.warning("reconnected; nothing moves until the next command")
            except HeptarmError as error:
                self._link_error = str(error)
                self._ended.wait(pause)
                pause = min(2 * pause, _LONGEST_BACK_OFF)
        if self._arm.connected and self._link_error:
            self._link_error = ""
            self._on_link("")
