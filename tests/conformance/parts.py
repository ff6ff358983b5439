"""The two parts of a suite of a node, which run side by side: PART=shared or PART=own.

Most tests wait for an arm that moves. Those of the shared node use one cabinet; the others start nodes of their own on
another one, so two processes need no more cabinets than one.
"""

from __future__ import annotations

import os

import pytest

#: The fixture that only tests of the shared node use.
SHARED = "stage"


def select(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of the other part."""
    part = os.environ.get("PART")
    if part is None:
        return
    assert part in ("shared", "own"), part
    kept, left = [], []
    for item in items:
        uses = SHARED in getattr(item, "fixturenames", ())
        (kept if uses == (part == "shared") else left).append(item)
    items[:] = kept
    config.hook.pytest_deselected(items=left)
