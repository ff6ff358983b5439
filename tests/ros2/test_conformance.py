"""Every case of conformance against the node: messages, executor, driver, cabinet, plant."""

from __future__ import annotations

import pytest

from tests.conformance.cases import CASES
from tests.ros2.peer import Client


@pytest.mark.parametrize("name", CASES)
def test_case(client: Client, name: str) -> None:
    CASES[name](client)
