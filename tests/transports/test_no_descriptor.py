"""Without a free file descriptor: one error with its remedy, nothing half open, and no process left."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

import heptarm as ha
from heptarm.arm.connect import connect
from heptarm.cli.sim.child import Child
from heptarm.errors import require, shortage
from heptarm.fri import Client
from heptarm.fri.loop.echo import floor
from heptarm.fri.loop.native import library
from heptarm.io import tcp
from heptarm.io.shared import MemoryBlock
from heptarm.io.udp import UdpSocket, own_address
from heptarm.panel.guard import free_port
from heptarm.values.files import read_bytes
from tests import forks
from tests.descriptors import refused_with_fewer, spare


@pytest.mark.parametrize(
    ("number", "attempt"),
    [
        pytest.param(1, lambda: tcp.connect("127.0.0.1", 9, timeout=1.0), id="connection"),
        pytest.param(1, tcp.TcpListener, id="listener"),
        pytest.param(1, lambda: UdpSocket(0), id="UDP"),
        pytest.param(1, lambda: own_address("127.0.0.1"), id="own address"),
        pytest.param(1, lambda: MemoryBlock(64), id="shared memory"),
        pytest.param(1, lambda: free_port("127.0.0.1", 8080), id="panel"),
        pytest.param(1, lambda: read_bytes(Path(__file__)), id="file"),
        pytest.param(5, lambda: Client(0, realtime=False), id="FRI client"),
        pytest.param(3, lambda: floor(0.01, period=1e-3), id="echo"),
        pytest.param(5, lambda: Child(["true"], None), id="process of the command line"),
        pytest.param(7, lambda: connect("sim://iiwa14"), id="simulator"),
    ],
)
def test_what_cannot_be_opened_names_the_remedy(
    number: int, attempt: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(forks, "_owner", None)  # a process of its own, as users start it
    library()  # a program that has used FRI before
    refused_with_fewer(number, attempt)


def test_a_simulator_that_does_not_start_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder of its file of positions is made before its process."""
    monkeypatch.setattr(forks, "_owner", None)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with spare(3), pytest.raises(ha.ConnectFailed, match="did not start: too many open files"):
        connect("sim://iiwa14?scene=table")
    assert not list(tmp_path.iterdir())


def test_a_package_that_cannot_be_read_is_not_to_be_installed_again() -> None:
    importlib.invalidate_caches()  # else the listing of its folder may be known already
    with spare(0), pytest.raises(ha.MissingExtra, match="cannot be imported") as caught:
        require("mcap.no_such_part", extra="record")
    assert "pip" not in caught.value.hint and shortage(caught.value.__cause__ or ValueError())
