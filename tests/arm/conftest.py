"""Fixtures of the tests of the arm."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.arm.peer import Peer


@pytest.fixture
def peer() -> Iterator[Peer]:
    """A scripted cabinet in memory, whose script must be finished at the end."""
    peer = Peer()
    yield peer
    peer.close()
