"""A call that moves the arm several times, such as a touch, in a thread of its own, so that it can be ended."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from heptarm.arm.arm import Arm
from heptarm.errors import HeptarmError

#: Pause between two stops, for a stop between two motions of a call hits none of them [s].
_PAUSE = 0.1
#: How long a call may take to give up [s].
_PATIENCE = 10.0


class Task:
    """A call that moves the arm several times; it begins at once.

    Args:
        arm: in control, at rest.
        what: what it is, in words.
        work: the call.

    Attributes:
        what: see above.
        why: why it was ended early; empty: it was not.
    """

    def __init__(self, arm: Arm, what: str, work: Callable[[], object]) -> None:
        self.what = what
        self.why = ""
        self._arm, self._work = arm, work
        self._over = threading.Lock()  # after the call the arm is others', and no stop of ours may hit them
        self._ended = threading.Event()
        self._future: Future[Any] = Future()
        self._thread = threading.Thread(target=self._run, name="heptarm-task")
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether the call has returned."""
        return self._ended.is_set()

    def wait(self, timeout: float) -> bool:
        """Wait until the call has returned; False if it has not in time [s]."""
        return self._ended.wait(timeout)

    def result(self) -> Any:
        """What the call returned; raises what it raised."""
        return self._future.result()

    def end(self, why: str) -> None:
        """End it early, if it is under way; returns when the call has given up, and the arm rests.

        Args:
            why: in words.
        """
        if self.done:
            return
        self.why = self.why or why
        for _ in range(round(_PATIENCE / _PAUSE)):
            with self._over, contextlib.suppress(HeptarmError):  # a lost link ends the call by itself
                if not self.done and self._arm.connected:
                    self._arm.stop()
            if self._ended.wait(_PAUSE):
                return

    def _run(self) -> None:
        try:
            self._future.set_result(self._work())
        except Exception as error:  # raised again for the one who asks
            self._future.set_exception(error)
        with self._over:
            self._ended.set()
