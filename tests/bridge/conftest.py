"""One virtual cabinet for the programs of all bridges."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.conftest import RunningCabinet, start_cabinet


@pytest.fixture(scope="package")
def cabinet() -> Iterator[RunningCabinet]:
    """It runs in real time: a servo motion lives by targets."""
    yield from start_cabinet(1.0)
