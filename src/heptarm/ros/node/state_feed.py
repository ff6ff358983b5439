"""The states of an arm from one connection after the other: what a node publishes, whatever becomes of the network."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError
from heptarm.values.state import State

_log = logging.getLogger("heptarm.bridge")

#: Pauses between attempts to reconnect [s].
_BACK_OFF, _LONGEST_BACK_OFF = 0.2, 2.0
#: How long to wait for the thread at the end [s].
_PATIENCE = 5.0


class Feed:
    """Tells of every state, from a thread of its own, and connects again when the connection is lost.

    Args:
        arm: connected.
        on_state: told of a new state; it must not block.
        on_link: told that the connection came (empty) or went (why); it must not block.
    """

    def __init__(
        self, arm: Arm, *, on_state: Callable[[State], None], on_link: Callable[[str], None]
    ) -> None:
        self._arm = arm
        self._on_state, self._on_link = on_state, on_link
        self._ended = threading.Event()
        self._trouble = ""
        self._thread = threading.Thread(target=self._run, name="heptarm-states")
        self._thread.start()
        on_link("")

    @property
    def trouble(self) -> str:
        """Why there is no connection; empty: there is one."""
        return self._trouble

    @property
    def ended(self) -> bool:
        """Whether `end` was called."""
        return self._ended.is_set()

    def end(self) -> None:
        """From now on a loss of the connection is meant."""
        self._ended.set()

    def join(self) -> None:
        """Wait for the thread, once the arm's connection is closed."""
        self._thread.join(_PATIENCE)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                for state in self._arm.states(size=16):
                    self._on_state(state)
            except HeptarmError as error:
                if self._ended.is_set():
                    return
                self._lost(str(error))
            except Exception:
                _log.exception("publishing a state")
            if not self._ended.is_set():
                self._reconnect()

    def _lost(self, why: str) -> None:
        self._trouble = why
        _log.error("the connection is lost: %s", why)
        self._on_link(why)

    def _reconnect(self) -> None:
        pause = _BACK_OFF
        while not self._ended.is_set() and not self._arm.connected:
            try:
                self._arm.reconnect()
                _log.warning("reconnected; nothing moves until it is told to")
            except HeptarmError as error:
                self._trouble = str(error)
                self._ended.wait(pause)
                pause = min(2 * pause, _LONGEST_BACK_OFF)
        if self._arm.connected and self._trouble:
            self._trouble = ""
            self._on_link("")
