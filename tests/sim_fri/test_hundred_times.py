"""Each fault many times in a row: it ends in a designed state with its cause as text, and commanding works again.

A few times here, a hundred times in `make test-long`.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.long import longer
from tests.sim_fri import kills, scenarios
from tests.sim_fri.pair import Pair


@pytest.mark.parametrize("fault", scenarios.FAULTS)
def test_again_and_again(fault: Callable[[Pair], str]) -> None:
    times = longer(10, 100)
    assert scenarios.again(fault, times) == times


def test_duplicates_count_once() -> None:
    assert scenarios.duplicates(30) == 30


def test_garbage_between_the_datagrams() -> None:
    assert scenarios.garbage(50) == 50


@pytest.mark.parametrize("kill", [kills.clients, kills.controllers])
def test_processes_that_are_killed(kill: Callable[[int], int]) -> None:
    times = longer(2, 20)
    assert kill(times) == times
