"""A pytest plugin for `make test-fast`: tests that need MuJoCo, torch or a JVM are skipped when they reach for it.

So each save of a file can be followed by all tests that are over in milliseconds, and no list of them has to be kept.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

import pytest

#: Packages that bring a simulator or a JVM, or take seconds to import.
LEFT_OUT = frozenset(("mujoco", "jpype", "torch", "pinocchio", "numba", "viser"))
#: Words in the command lines of programs that do: virtual cabinets, Java and its compilers, C++ compilers, commands.
PROGRAMS = ("heptarm.sim.", "heptarm.cli", "java", "ecj", "g++", "sphinx", "pytest", "roscore")


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname in LEFT_OUT:
            pytest.skip(f"imports {fullname}", allow_module_level=True)
        return None


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "subprocess.Popen":
        command = arguments[1]
        words = command if isinstance(command, str) else " ".join(map(str, command))
        for program in PROGRAMS:
            if program in words:
                pytest.skip(f"starts {program}", allow_module_level=True)


def pytest_configure(config: pytest.Config) -> None:
    """Watch imports and processes from now on."""
    # who is skipped in the middle of starting something leaves its folder to the garbage collector
    unclosed = "ignore:Exception ignored in. <finalize object:pytest.PytestUnraisableExceptionWarning"
    config.addinivalue_line("filterwarnings", unclosed)
    sys.meta_path.insert(0, _Finder())
    sys.addaudithook(_audit)
