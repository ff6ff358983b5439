"""Order of the whole suite: fast tests first, then slow ones, then those that need a browser."""

from __future__ import annotations

import pytest

_LATE = ("slow", "browser")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sorts the tests; the sort is stable, so files keep their own order."""
    items.sort(key=_rank)


def _rank(item: pytest.Item) -> int:
    return max((1 + _LATE.index(mark.name) for mark in item.iter_markers() if mark.name in _LATE), default=0)
