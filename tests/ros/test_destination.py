"""Destinations: the target is repeated until the arm is there, and by nothing that could move it again."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any, cast

import pytest

from heptarm.errors import NotReady
from heptarm.ros.node.destination import Destination, DestinationKeeper


class FakeStream:
    """Counts repetitions; open until a test changes that."""

    def __init__(self) -> None:
        self.count, self.open, self.broken = 0, True, False

    def repeat(self) -> bool:
        self.count += 1
        if self.broken:
            raise NotReady("blocked")
        return self.open


class Scene:
    """A keeper with a stream and the position of an arm."""

    def __init__(self) -> None:
        self.stream, self.position = FakeStream(), 0.0
        self.arrivals = 0
        state: Callable[[], Any] = lambda: SimpleNamespace(position=self.position)  # noqa: E731
        self.keeper = DestinationKeeper(cast(Any, self.stream), state, period=1e-3, arrived=self._arrived)

    def _arrived(self) -> None:
        self.arrivals += 1

    def go(self, position: float, *, stays: bool = False) -> None:
        self.keeper.go(Destination(lambda state: cast(Any, state).position == position, stays))

    def until(self, what: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 30.0
        while not what():
            assert time.monotonic() < deadline
            time.sleep(1e-3)

    def ends(self) -> None:
        """No more repetitions come."""
        time.sleep(0.01)
        before = self.stream.count
        time.sleep(0.03)
        assert self.stream.count == before


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene()
    yield made
    made.keeper.close()
    made.keeper.close()
    assert "heptarm-destination" not in {thread.name for thread in threading.enumerate()}


def test_the_target_is_repeated_until_the_arm_is_there_and_that_is_reported_once(scene: Scene) -> None:
    scene.go(1.0)
    scene.until(lambda: scene.stream.count > 3)
    assert scene.arrivals == 0
    scene.position = 1.0
    scene.until(lambda: scene.arrivals == 1)
    scene.ends()
    scene.go(1.0)
    scene.until(lambda: scene.arrivals == 2)


def test_a_compliant_arm_stays_and_is_reported_once(scene: Scene) -> None:
    scene.go(0.0, stays=True)
    scene.until(lambda: scene.stream.count > 20)
    assert scene.arrivals == 1


@pytest.mark.parametrize("how", ["open", "broken"])
def test_what_ends_the_servo_motion_ends_the_repetitions(scene: Scene, how: str) -> None:
    scene.go(1.0)
    scene.until(lambda: scene.stream.count > 3)
    setattr(scene.stream, how, how == "broken")
    scene.ends()
    scene.position = 1.0
    assert scene.arrivals == 0
