"""One fake cabinet for all tests that restore its state, and a factory for those that need their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer

Maker = Callable[..., FakeCabinet]


@pytest.fixture(scope="session")
def shared_cabinet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FakeCabinet]:
    with FakeCabinet(log=tmp_path_factory.mktemp("fake") / "log") as cabinet:
        yield cabinet


@pytest.fixture
def cabinet(shared_cabinet: FakeCabinet) -> Iterator[FakeCabinet]:
    yield shared_cabinet
    assert shared_cabinet.is_alive()
    assert shared_cabinet.errors() == []


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Maker]:
    with ExitStack() as stack:
        yield lambda **options: stack.enter_context(FakeCabinet(log=tmp_path / "log", **options))


@pytest.fixture
def connect(cabinet: FakeCabinet) -> Iterator[Callable[..., Peer]]:
    with ExitStack() as stack:
        yield lambda **options: stack.enter_context(Peer(cabinet.port, **options))
