"""What tests of the arm share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.arm.peer import Peer


@pytest.fixture
def peer() -> Iterator[Peer]:
    """A scripted cabinet in memory; nothing of its script may be left."""
    peer = Peer()
    yield peer
    peer.close()
