"""Goals in messages: their start is of the right moment, however long it takes to read them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from heptarm.ros.interface.messages import trajectory_goal


class Machine:
    """Two clocks that are 2 s apart, and a machine that takes 3 ms to read a point, and for chosen readings of a clock.

    Attributes:
        time: of the clock of the execution [s].
        slow: numbers of the readings of that clock that are slow.
    """

    def __init__(self, *, slow: tuple[int, ...] = ()) -> None:
        self.time, self.slow, self._readings = 10.0, slow, 0

    def now(self) -> float:
        """Read the clock of the execution, and be held up then if this reading is slow."""
        here, number = self.time, self._readings
        self._readings += 1
        self.time += 3e-3 if number in self.slow else 1e-6
        return here

    def seconds(self, value: float) -> float:
        """Read a time of a message, which is slow."""
        self.time += 3e-3
        return value


@pytest.mark.parametrize("slow", [(), (0,), (0, 1, 3)])
def test_a_start_does_not_depend_on_how_long_the_points_take(slow: tuple[int, ...]) -> None:
    machine = Machine(slow=slow)
    ros: Any = SimpleNamespace(now=lambda: round((machine.time + 2.0) * 1e9), seconds=machine.seconds)
    point = SimpleNamespace(
        time_from_start=1.0, positions=(0.0,) * 7, velocities=(), accelerations=(), effort=()
    )
    message = SimpleNamespace(
        header=SimpleNamespace(stamp=20.0), joint_names=("A1",) * 7, points=[point] * 100
    )
    goal = trajectory_goal(ros, message, now=machine.now)
    assert goal.start == pytest.approx(18.0, abs=2e-6)
    message.header.stamp = 0.0
    assert trajectory_goal(ros, message, now=machine.now).start is None
