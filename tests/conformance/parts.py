"""The parts of a suite of a node, which run side by side: PART=shared, PART=surface or PART=own.

Most tests wait for an arm that moves. Those of the shared node use one cabinet; the others use another one, with one
node for services, actions and topics, or with nodes that each test starts for itself. These are apart, so that no part
takes much longer than another.
"""

from __future__ import annotations

import os

import pytest

#: The fixture that only tests of the shared node use.
SHARED = "stage"
#: The module with a node of its own for all its tests.
SURFACE = "test_surface"
PARTS = ("shared", "surface", "own")


def select(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of the other parts."""
    part = os.environ.get("PART")
    if part is None:
        return
    assert part in PARTS, part
    kept: list[pytest.Item] = []
    left: list[pytest.Item] = []
    for item in items:
        (kept if _part(item) == part else left).append(item)
    items[:] = kept
    config.hook.pytest_deselected(items=left)


def _part(item: pytest.Item) -> str:
    if SHARED in getattr(item, "fixturenames", ()):
        return "shared"
    return "surface" if item.path.stem == SURFACE else "own"
