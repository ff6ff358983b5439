"""What makes a process real-time as far as the system lets it, and a plain word where it does not."""

from __future__ import annotations

import ctypes
import gc
import os
import sys

PRIORITY = 60
_PR_SET_TIMERSLACK = 29
_MCL_CURRENT_FUTURE = 3


def ask(*, cpu: int | None = None, priority: int = PRIORITY, lock: bool = True) -> list[str]:
    """Ask for real-time priority, locked memory, short timer slack and one processor; no more garbage collection.

    Args:
        cpu: processor to stay on; None for any.
        priority: of SCHED_FIFO.
        lock: keep the process' memory out of swap.

    Returns:
        What was refused, each in words with its remedy.
    """
    refused = []
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except (OSError, AttributeError) as error:
        refused.append(
            f"no real-time priority ({_reason(error)}): answers may be late while the machine is busy; allow it with "
            "`rtprio` in /etc/security/limits.conf, or run as root"
        )
    if cpu is not None:
        try:
            os.sched_setaffinity(0, {cpu})
        except (OSError, AttributeError) as error:
            refused.append(f"not on processor {cpu} ({_reason(error)})")
    if sys.platform == "linux":
        libc = ctypes.CDLL(None, use_errno=True)
        libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0)
        if lock and libc.mlockall(_MCL_CURRENT_FUTURE) != 0:
            refused.append(
                f"memory not locked ({os.strerror(ctypes.get_errno()).lower()}): a page fault may delay an answer; "
                "allow it with `memlock` in /etc/security/limits.conf"
            )
    elif lock:
        refused.append(f"memory not locked: this is not done on {sys.platform}")
    sys.setswitchinterval(2e-4)
    gc.collect()
    gc.freeze()
    gc.disable()
    return refused


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return f"{sys.platform} has none"
