"""The whole suite: fast tests first, then slow ones, then those with a browser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from heptarm import Arm

pytest_plugins = ["tests.processes", "tests.retry"]

_LATE = ("slow", "browser")

# no timing assertions, above all on a busy machine
settings.register_profile("heptarm", deadline=None)
settings.load_profile("heptarm")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sorts the tests; the sort is stable, so files keep their own order."""
    items.sort(key=_rank)


def _rank(item: pytest.Item) -> int:
    return max((1 + _LATE.index(mark.name) for mark in item.iter_markers() if mark.name in _LATE), default=0)


# ------------------------------------------------------------------------------- a virtual cabinet for all


@dataclass(frozen=True)
class RunningCabinet:
    """A virtual cabinet that several tests share."""

    host: str
    port: int
    pid: int

    @property
    def target(self) -> str:
        """The target to connect to."""
        return f"sim://{self.host}:{self.port}"


@pytest.fixture(scope="module")
def cabinet() -> Iterator[RunningCabinet]:
    """One virtual iiwa 14 for a module, in real time; tests leave it at rest and without a controller."""
    from heptarm.arm.link.local_simulator import PrivateCabinet
    from heptarm.arm.link.target import Target

    running = PrivateCabinet.start(Target(model="iiwa14"))
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
    """A target that starts a private virtual cabinet, five times as fast as real time."""
    return "sim://iiwa14?speed=5"
