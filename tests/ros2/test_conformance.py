"""Cases of conformance against the node: messages, executor, driver, cabinet, plant.

Here every twelfth case; another twelfth runs against the node of ROS 1, and all of them against the runner alone.
`make conformance` runs all of them, with each path of execution.
"""

from __future__ import annotations

import os

import pytest

from tests.conformance.cases import CASES, UNFIT, part
from tests.ros2.peer import Client

TRAVEL = os.environ.get("EXECUTION", "servo")
NAMES = list(CASES) if os.environ.get("CONFORMANCE") == "all" else part(0)


@pytest.mark.parametrize("name", NAMES)
def test_case(client: Client, name: str) -> None:
    if name in UNFIT.get(TRAVEL, {}):
        pytest.skip(UNFIT[TRAVEL][name])
    CASES[name](client)
