"""The whole suite: its order, and one virtual cabinet for all.

In one process fast tests come first, then slow ones, then those with a browser. Workers of pytest-xdist begin with the
folders whose tests take long, and fill up with the many short files of the rest: so no worker is left alone with
something long at the end. Tests that mostly compute run beside them, in the time in which those wait: those of some
folders, and modules that say so. Nothing in them may depend on its pace, for they have what the others leave.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest
from hypothesis import Phase, settings

from tests.long import LONG, longer
from tests.simulators import FASTER

if TYPE_CHECKING:
    from heptarm import Arm

pytest_plugins = [
    "tests.forks",
    "tests.processes",
    "tests.hangs",
    "tests.retry",
    "tests.postponed",
    "tests.browser",
    "tests.doubled",
]

_LATE = ("slow", "browser")
#: Folders with what takes long.
_LONG_FIRST = (
    "docs",
    "strangers",
    "arm",
    "examples",
    "cli",
    "trust",
    "scenarios",
    "doubles",
    "ros",
    "cabinet",
    "cpp",
    "record",
)
#: Folders whose tests mostly compute.
_COMPUTING = ("fri", "house", "laws", "model", "rl", "schema", "sim", "values", "wire")

# no timing assertions, above all on a busy machine
settings.register_profile("heptarm", deadline=None, max_examples=longer(25, 200))
settings.load_profile("heptarm")
# a mutant is to be noticed, not to be explained
settings.register_profile(
    "mutation", deadline=None, derandomize=True, database=None, phases=(Phase.explicit, Phase.generate)
)


def pytest_configure(config: pytest.Config) -> None:
    """Black boxes of the tests, and of the programs that they start, go to a folder that is deleted at the end."""
    folder = tempfile.mkdtemp(prefix="heptarm-black-box-")
    os.environ["HEPTARM_BLACK_BOX"] = folder
    config.add_cleanup(lambda: shutil.rmtree(folder, ignore_errors=True))


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Sorts the tests, and leaves out the long ones; the sort is stable, so files keep their own order."""
    for item in items:
        if item.path.parent.name in _COMPUTING:
            item.add_marker("computing")
    items.sort(key=_folder if hasattr(config, "workerinput") else _rank)
    if not LONG and (long := [item for item in items if item.get_closest_marker("long")]):
        config.hook.pytest_deselected(items=long)
        items[:] = [item for item in items if item not in long]


def _rank(item: pytest.Item) -> int:
    return max((1 + _LATE.index(mark.name) for mark in item.iter_markers() if mark.name in _LATE), default=0)


def _folder(item: pytest.Item) -> int:
    name = item.path.parent.name
    return _LONG_FIRST.index(name) if name in _LONG_FIRST else len(_LONG_FIRST)


# ------------------------------------------------------------------------------- a virtual cabinet for all


@dataclass(frozen=True)
class RunningCabinet:
    """A virtual cabinet shared by several tests."""

    host: str
    port: int
    pid: int

    @property
    def target(self) -> str:
        """The target to connect to."""
        return f"sim://{self.host}:{self.port}"


@pytest.fixture(scope="module")
def cabinet(request: pytest.FixtureRequest) -> Iterator[RunningCabinet]:
    """One virtual iiwa 14 for a module, at rest and without a controller after each test.

    It runs faster than time, or at the SPEED of the module: 1.0 where time is the subject.
    """
    yield from start_cabinet(getattr(request.module, "SPEED", FASTER))


def start_cabinet(speed: float) -> Iterator[RunningCabinet]:
    """The body of a fixture: a virtual iiwa 14 that runs so much faster than time."""
    from heptarm.arm.link.local_simulator import PrivateCabinet
    from heptarm.arm.link.target import Target

    running = PrivateCabinet.start(Target(model="iiwa14", options=(("speed", f"{speed:g}"),)))
    yield RunningCabinet(running.host, running.port, running.pid)
    running.close()


@pytest.fixture
def arm(cabinet: RunningCabinet) -> Iterator[Arm]:
    """An arm in control of the shared cabinet, at its home position."""
    import heptarm

    with heptarm.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:  # patient, for busy machines
        home = heptarm.deg(0, 30, 0, -90, 0, 60, 0)
        if abs(arm.state.q - home).max() > 1e-3:
            arm.move(heptarm.ptp(home))
        yield arm


@pytest.fixture
def private_target() -> str:
    """A target that starts a private virtual cabinet, faster than real time."""
    return f"sim://iiwa14?speed={FASTER:g}"
