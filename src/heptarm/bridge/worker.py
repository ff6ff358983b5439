"""The thread of an execution: it carries out goals, tells how they end, and survives whatever happens on the way."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Sequence

from heptarm.arm.arm import Arm
from heptarm.bridge.execution import Listener
from heptarm.bridge.goal import End
from heptarm.bridge.runner import Feedback
from heptarm.errors import HeptarmError
from heptarm.io.clock import Clock, RealClock

_log = logging.getLogger("heptarm.bridge")

#: How long to wait for the thread at the end [s].
_PATIENCE = 10.0


class Worker(ABC):
    """What all ways of execution share.

    Args:
        arm: in control.
        listener: hears of goals.
        clock: the arm's; None: the real one.

    Whoever inherits starts the thread when there is all that it needs.
    """

    def __init__(self, arm: Arm, listener: Listener, clock: Clock | None) -> None:
        self._arm = arm
        self._listener = listener
        self._clock = clock or RealClock()
        self._changed = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="heptarm-execution")

    @property
    def now(self) -> float:
        """The time on the clock that goals start by [s]."""
        return self._clock.nanos() * 1e-9

    @abstractmethod
    def abort(self, text: str) -> None:
        """End the goal under way, if there is one, because of something outside; the arm brakes."""

    def close(self) -> None:
        """End the goal under way and leave the arm at rest."""
        with self._changed:
            self._closing = True
        self.abort("the driver closes")
        self._thread.join(_PATIENCE)

    # ------------------------------------------------------------------------------------ thread

    @abstractmethod
    def _wait(self) -> bool:
        """Wait for a goal; False: there is none any more, and the driver closes."""

    @abstractmethod
    def _work(self) -> None:
        """Carry it out."""

    @abstractmethod
    def _lose(self, text: str) -> None:
        """It cannot be carried out."""

    def _run(self) -> None:
        while self._wait():
            try:
                self._work()
            except HeptarmError as error:
                self._lose(str(error))
            except Exception as error:
                _log.exception("executing a goal")
                self._lose(f"{type(error).__name__}: {error}")

    def _tell(self, feedback: Feedback | None, ends: Sequence[End]) -> None:
        try:
            if feedback is not None:
                self._listener.on_feedback(feedback)
            for end in ends:
                self._listener.on_end(end)
        except Exception:
            _log.exception("telling of a goal")
