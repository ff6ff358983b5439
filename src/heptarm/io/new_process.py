"""The code of this program in a new process: what that can import by its name, and what it must be sent by value."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.machinery import PathFinder

import cloudpickle


def module_path() -> str:
    """Where this program finds its modules, as PYTHONPATH of a new process."""
    return os.pathsep.join(entry or os.getcwd() for entry in sys.path)


def is_importable(module: str) -> bool:
    """Whether a new process finds a module; one that a program has loaded by itself only this process knows."""
    return module != "__main__" and PathFinder.find_spec(module.partition(".")[0]) is not None


@contextmanager
def by_value(owner: object) -> Iterator[None]:
    """While this block runs, cloudpickle writes a function or class by value if a new process cannot import it."""
    module = sys.modules.get(getattr(owner, "__module__", None) or "")
    if module is None or module.__name__ == "__main__" or is_importable(module.__name__):
        yield  # cloudpickle itself writes what is of __main__ by value
        return
    cloudpickle.register_pickle_by_value(module)
    try:
        yield
    finally:
        cloudpickle.unregister_pickle_by_value(module)
