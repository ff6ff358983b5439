"""Cases of the action's conformance: what ros2_control's tests require of a server, and what an arm needs beyond that.

`CASES` has them by name, `UNFIT` those that do not apply to an execution.
"""

from __future__ import annotations

import importlib

from tests.conformance.case import CASES, UNFIT
from tests.long import longer

__all__ = ["CASES", "UNFIT", "part"]

#: Cases that every node runs: what no other test of the nodes covers.
_EVERYWHERE = (
    "points_streamed_at_100_hz_are_followed",
    "windows_of_moveit_servo_are_followed",
    "an_end_that_moves_succeeds_with_the_default_tolerances",
    "an_empty_trajectory_on_the_topic_does_as_upstreams_controller",
)

for _topic in (
    "refusals",
    "arrivals",
    "interruptions",
    "deviations",
    "surroundings",
    "instants",
    "streams",
    "lifetimes",
):
    importlib.import_module(f"tests.conformance.{_topic}")


def part(number: int) -> list[str]:
    """The cases that a node runs where not all of them have to: every twelfth one, from this number on.

    The long run has every third one. All of them run against the runner alone, in tests/ros/test_conformance.py.
    """
    names, step = list(CASES), longer(12, 3)
    return [name for index, name in enumerate(names) if index % step == number or name in _EVERYWHERE]
