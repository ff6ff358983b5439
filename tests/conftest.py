"""Order of the whole suite: fast tests first, then slow ones, then those that need a browser."""

from __future__ import annotations

import pytest

_LATE = ("slow", "browser")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sorts the tests; the sort is stable, so files keep their own order."""
    items.sort(key=lambda item: max((1 + _LATE.index(m.name) for m in item.iter_markers() if m.name in _LATE), default=0))
