"""One process from which the commands of all tests here are started."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from tests.cli import running
from tests.cli.forks import Forks


@pytest.fixture(scope="session", autouse=True)
def _forks(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    if sys.platform != "linux":  # elsewhere a fork of a process with libraries of the system is not safe
        yield
        return
    running.forks = Forks(tmp_path_factory.mktemp("forks"))
    yield
    running.forks.close()
    running.forks = None
