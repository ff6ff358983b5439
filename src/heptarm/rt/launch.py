"""Starting the loop's process: a fresh one where the law can be imported, else a fork of the user's."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import warnings
from importlib.machinery import PathFinder
from typing import Protocol

from heptarm.errors import CommandRejected
from heptarm.rt.cycle import Law


class Worker(Protocol):
    """A started process."""

    def is_alive(self) -> bool:
        """It runs."""
        ...

    def join(self, seconds: float) -> None:
        """Wait for its end."""
        ...

    def kill(self) -> None:
        """End it at once."""
        ...


def importable(law: Law | None) -> str | None:
    """The name "module:function" by which a fresh process finds a law; None if it cannot."""
    module, name = getattr(law, "__module__", None), getattr(law, "__qualname__", "<")
    if module is None or module == "__main__" or "<" in name:
        return None
    if PathFinder.find_spec(module.partition(".")[0]) is None:  # this process knows it, a fresh one would not
        return None
    found: object = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    return f"{module}:{name}" if found is law else None


def start(path: str, law: Law | None) -> Worker:
    """Start a loop on the shared memory at `path`.

    Raises:
        CommandRejected: the law cannot be imported and this system cannot fork.
    """
    if law is None or importable(law):
        return _Fresh(path)
    if "fork" not in multiprocessing.get_all_start_methods() or sys.platform == "darwin":
        raise CommandRejected(
            f"the law {getattr(law, '__qualname__', law)!r} cannot be imported by the loop's process",
            parameter="law",
            hint="put it at the top level of a module of its own; on this system the loop cannot take it over",
        )
    return _Fork(path, law)


class _Fresh:
    """A new interpreter that finds modules where this one does."""

    def __init__(self, path: str) -> None:
        folders = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "heptarm.rt.loop", path],
            env={**os.environ, "PYTHONPATH": folders, "OPENBLAS_NUM_THREADS": "1"},
            stdin=subprocess.DEVNULL,
        )

    def is_alive(self) -> bool:
        """It runs."""
        return self._process.poll() is None

    def join(self, seconds: float) -> None:
        """Wait for its end."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.wait()


class _Fork:
    """A copy of this process, for laws that exist only here."""

    def __init__(self, path: str, law: Law) -> None:
        from heptarm.rt.loop import main

        self._process = multiprocessing.get_context("fork").Process(
            target=main, args=(path, law), daemon=True
        )
        with (
            warnings.catch_warnings()
        ):  # 3.12 warns where there are threads; the copy uses none of their locks
            warnings.simplefilter("ignore", DeprecationWarning)
            self._process.start()

    def is_alive(self) -> bool:
        """It runs."""
        return self._process.is_alive()

    def join(self, seconds: float) -> None:
        """Wait for its end."""
        self._process.join(seconds)

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()
        self._process.join()
