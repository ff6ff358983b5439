"""Every case of conformance against the node: messages, actionlib, driver, cabinet, plant."""

from __future__ import annotations

import pytest

from tests.conformance.cases import CASES
from tests.ros1.peer import Client

#: The messages of ROS 1 have no field for these.
UNKNOWN = ("several_degrees_of_freedom",)


@pytest.mark.parametrize("name", [name for name in CASES if not name.endswith(UNKNOWN)])
def test_case(client: Client, name: str) -> None:
    CASES[name](client)
