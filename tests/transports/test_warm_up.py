"""The connection that warms up the send path."""

from __future__ import annotations

import resource
import socket

import pytest

from heptarm.io.tcp import WarmUpConnection


def test_it_never_fills_up() -> None:
    warm_up = WarmUpConnection()
    for _ in range(5000):  # bytes that are not received again would fill the buffers
        warm_up.send(bytes(1000))
    warm_up.close()
    warm_up.close()
    warm_up.send(b"nothing happens after close")


def test_nothing_is_sent_without_a_loopback(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> socket.socket:
        raise OSError("no loopback here")

    monkeypatch.setattr(socket, "create_server", refuse)
    warm_up = WarmUpConnection()
    warm_up.send(b"target")
    warm_up.close()


def test_without_a_file_descriptor_to_spare_nothing_is_sent() -> None:
    """A servo motion that could not have the connection had begun already, and went on without its stream."""
    limit, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, hard))
    try:
        warm_up = WarmUpConnection()
        warm_up.send(b"target")
        warm_up.close()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
