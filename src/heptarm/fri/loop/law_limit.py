"""Time limit of a call of a law in Python: an endless law is interrupted, and one that cannot be is killed.

A signal interrupts Python code and waits. It does not interrupt a long call into C, nor a law that swallows the
exception; the user's process sees in the shared memory since when the law runs, and ends the loop's process.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable

from heptarm.errors import HeptarmError
from heptarm.fri.loop import shared_memory as at

#: A call of a law in Python that takes this long is interrupted [s]; the cabinet has stopped the arm by then.
LAW_LIMIT = 1.0
#: After this long the user's process ends the loop's [s]; after twice as long the loop ends itself.
KILL_LIMIT = 2.5
#: Texts of what happened.
INTERRUPTED = f"a call did not return within {LAW_LIMIT:g} s: look for an endless loop or a wait in it"
KILLED = (
    f"a call of the law did not return within {LAW_LIMIT:g} s and could not be interrupted: the loop's process was "
    "ended, and the cabinet stops the arm"
)


class EndlessLaw(HeptarmError):
    """A call of a law did not return in time."""


class LawLimit:
    """Interrupts calls of a law in the main thread of the loop's process.

    Args:
        header: of the shared memory, where the user's process sees since when the law runs.
    """

    def __init__(self, header: memoryview) -> None:
        self._header = header
        self._armed = 0
        signal.signal(signal.SIGALRM, self._expired)

    def begin(self, now: int) -> None:
        """A call begins at `now` [ns]."""
        if (
            now - self._armed > LAW_LIMIT * 0.25e9
        ):  # not in every call: a system call takes longer than a short law
            signal.setitimer(signal.ITIMER_REAL, LAW_LIMIT, LAW_LIMIT)
            self._armed = now
        self._header[at.LAW_SINCE] = now

    def end(self) -> None:
        """The call has ended."""
        self._header[at.LAW_SINCE] = 0

    def _expired(self, number: int, frame: object) -> None:
        """Raise in the law, if it still runs; give up if it goes on in spite of that."""
        since = self._header[at.LAW_SINCE]
        if not since:  # between two calls
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            self._armed = 0
            return
        lasted = (time.monotonic_ns() - since) * 1e-9
        if lasted > 2.0 * KILL_LIMIT:  # nobody is left who would end this process
            os._exit(1)
        if lasted > 0.5 * LAW_LIMIT:
            raise EndlessLaw(INTERRUPTED)


class LawWatch:
    """Thread of the user's process that ends a loop whose law cannot be interrupted.

    Args:
        layout: the shared memory.
        kill: ends the loop's process.
    """

    def __init__(self, layout: at.Layout, kill: Callable[[], None]) -> None:
        self._layout, self._kill = layout, kill
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="heptarm-fri-law", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        header = self._layout.header
        while not self._ended.wait(0.25 * LAW_LIMIT):
            since = header[at.LAW_SINCE]
            if since and time.monotonic_ns() - since > KILL_LIMIT * 1e9:
                self._layout.trouble.write(KILLED)
                header[at.STATUS] = at.Status.FAILED
                self._kill()
                return

    def close(self) -> None:
        """End the thread."""
        self._ended.set()
        self._thread.join()
