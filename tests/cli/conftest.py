"""One process from which the commands of all tests here are started."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.cli.running import Command


@pytest.fixture(scope="session", autouse=True)
def _forks() -> Iterator[None]:
    yield
    for forks in Command.forks.values():
        forks.close()
