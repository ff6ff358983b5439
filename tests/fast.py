"""A pytest plugin for `make test-fast`: MuJoCo and the JVM stay out, so that nobody waits for them at every save.

What imports them, or starts a virtual cabinet or a Java program, fails with a text that says where it belongs.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

#: Packages that start a simulator or a JVM.
LEFT_OUT = frozenset(("mujoco", "jpype", "torch"))
#: Words in the command line of a program that does.
PROGRAMS = ("heptarm.sim.runtime", "/java", "javac", "ecj")


class NotFast(RuntimeError):
    """This test takes too long for `make test-fast`."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"{what} does not belong to make test-fast: leave this test out of FAST in the Makefile"
        )


class _Finder(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname in LEFT_OUT:
            raise NotFast(fullname)
        return None


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "subprocess.Popen":
        words = " ".join(map(str, arguments[1]))
        for one in PROGRAMS:
            if one in words:
                raise NotFast(one.strip("/"))


def pytest_configure() -> None:
    """Keep them out."""
    sys.meta_path.insert(0, _Finder())
    sys.addaudithook(_audit)
