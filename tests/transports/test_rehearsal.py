"""Sending to oneself before sending in earnest."""

from __future__ import annotations

import socket

import pytest

from heptarm.io.rehearsal import Rehearsal


def test_as_much_can_be_rehearsed_as_one_likes() -> None:
    rehearsal = Rehearsal()
    for _ in range(5000):  # what was not taken back would fill the buffers
        rehearsal.send(bytes(1000))
    rehearsal.close()
    rehearsal.close()
    rehearsal.send(b"after the end nothing happens")


def test_where_there_is_no_loopback_nothing_is_rehearsed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> socket.socket:
        raise OSError("no loopback here")

    monkeypatch.setattr(socket, "create_server", refuse)
    rehearsal = Rehearsal()
    rehearsal.send(b"target")
    rehearsal.close()
