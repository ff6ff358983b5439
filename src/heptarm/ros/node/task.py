"""A function that moves the arm several times, such as a touch, in a thread of its own so that it can be ended."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError

#: Pause between two stops [s]: a stop between two motions of the function stops neither.
_STOP_PERIOD = 0.1
#: How long the function may take to return after the first stop [s].
_END_TIMEOUT = 10.0


class ArmTask:
    """Runs a function that moves the arm several times; it starts immediately.

    Args:
        arm: in control, at rest.
        name: what it does, for messages, such as "the touch".
        work: the function.

    Attributes:
        name: see above.
        end_reason: why it was ended early; empty: it was not.
    """

    def __init__(self, arm: Arm, name: str, work: Callable[[], object]) -> None:
        self.name = name
        self.end_reason = ""
        self._arm, self._work = arm, work
        self._ending = (
            threading.Lock()
        )  # after the function returned the arm is free, and must not be stopped by us
        self._done = threading.Event()
        self._future: Future[Any] = Future()
        self._thread = threading.Thread(target=self._run, name="heptarm-task")
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether the function has returned."""
        return self._done.is_set()

    def wait(self, timeout: float) -> bool:
        """Wait until the function has returned; False: not within `timeout` [s]."""
        return self._done.wait(timeout)

    def result(self) -> Any:
        """Return what the function returned, or raise what it raised."""
        return self._future.result()

    def expect_end(self, reason: str) -> None:
        """Note why the function ends, before something else stops the arm.

        Args:
            reason: why.
        """
        if not self.done:
            self.end_reason = self.end_reason or reason

    def end(self, reason: str) -> None:
        """End the function early, if it still runs; returns when it has returned and the arm rests.

        Args:
            reason: why.
        """
        if self.done:
            return
        self.expect_end(reason)
        for _ in range(round(_END_TIMEOUT / _STOP_PERIOD)):
            with (
                self._ending,
                contextlib.suppress(HeptarmError),
            ):  # a lost connection ends the function by itself
                if not self.done and self._arm.connected:
                    self._arm.stop()
            if self._done.wait(_STOP_PERIOD):
                return

    def _run(self) -> None:
        try:
            self._future.set_result(self._work())
        except Exception as error:  # `result` raises it
            self._future.set_exception(error)
        with self._ending:
            self._done.set()
