"""Cases of conformance against the node: messages, actionlib, driver, cabinet, plant.

Here every twelfth case; another twelfth runs against the node of ROS 2, and all of them against the runner alone.
`make conformance` runs all of them, with each path of execution.
"""

from __future__ import annotations

import os

import pytest

from tests.conformance.cases import CASES, UNFIT, part
from tests.ros1.peer import Client

TRAVEL = os.environ.get("EXECUTION", "servo")
#: The messages of ROS 1 have no field for these.
UNKNOWN = ("rejects_several_degrees_of_freedom",)
NAMES = list(CASES) if os.environ.get("CONFORMANCE") == "all" else part(1)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in UNKNOWN])
def test_case(client: Client, name: str) -> None:
    if name in UNFIT.get(TRAVEL, {}):
        pytest.skip(UNFIT[TRAVEL][name])
    CASES[name](client)
