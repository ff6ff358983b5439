"""Programs that have used up their file descriptors."""

from __future__ import annotations

import contextlib
import gc
import os
import resource
from collections.abc import Callable, Iterator

import pytest

from heptarm.errors import HeptarmError

#: As many files as a process may have open meanwhile, at most.
_MOST = 512


@contextlib.contextmanager
def spare(number: int) -> Iterator[None]:
    """Leave so many file descriptors to this process."""
    usual, highest = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(usual, _MOST), highest))
    taken: list[int] = []
    try:
        with contextlib.suppress(OSError):
            while True:
                taken.append(os.open(os.devnull, os.O_RDONLY))
        for _ in range(number):
            os.close(taken.pop())
        yield
    finally:
        for one in taken:
            os.close(one)
        resource.setrlimit(resource.RLIMIT_NOFILE, (usual, highest))


def refused_with_fewer(number: int, attempt: Callable[[], object]) -> None:
    """Check that an attempt with fewer descriptors than so many ends in an error of heptarm that names the remedy.

    Whatever it has opened is closed again after each attempt.
    """
    for left in range(number):
        gc.collect()  # else it might close something meanwhile
        before = _open_files()
        with spare(left), pytest.raises(HeptarmError) as caught:
            attempt()
        assert "ulimit -n" in caught.value.hint, f"{left} left: {caught.value!r}"
        del caught  # its traceback holds what was mapped
        gc.collect()
        assert _open_files() <= before, f"{left} left"


def _open_files() -> set[tuple[str, str]]:
    """The open files of this process: number and name."""
    found = set()
    for number in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):  # the folder itself
            found.add((number, os.readlink(f"/proc/self/fd/{number}")))
    return found
