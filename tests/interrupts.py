"""Ctrl-C in tests, also where the tests run in the background.

A shell starts a background job (`make test &`) with SIGINT ignored; Python then installs no handler, and every
process that a test starts inherits that. Tests restore it where they mean Ctrl-C, and nowhere else: a Ctrl-C at the
terminal is not for a background job.
"""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def ctrl_c_interrupts() -> Iterator[None]:
    """Let SIGINT raise KeyboardInterrupt here, and end the processes that are started meanwhile.

    Only the main thread may set handlers; in another one nothing changes. The garbage collector calls nobody meanwhile:
    Python loses an interrupt in such a callback, and Hypothesis has one.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    callbacks = gc.callbacks[:]
    gc.callbacks.clear()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a handler becomes the default on exec
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        gc.callbacks.extend(callbacks)
