"""Targets as text."""

from __future__ import annotations

import socket

import pytest

import heptarm as ha
from heptarm.arm.link.target import Target, parse_target


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("172.31.1.147", Target(host="172.31.1.147", port=30001)),
        ("172.31.1.147:30005", Target(host="172.31.1.147", port=30005)),
        ("cabinet.lab", Target(host="cabinet.lab")),
        ("[fe80::1]:4", Target(host="fe80::1", port=4)),
        ("sim://localhost:30001", Target(host="localhost", port=30001)),
        ("sim://iiwa14", Target(model="iiwa14")),
        ("sim://iiwa7?speed=5", Target(model="iiwa7", options=(("speed", "5"),))),
    ],
)
def test_targets(text: str, target: Target) -> None:
    assert parse_target(text) == target
    assert parse_target(str(target)) == target


@pytest.mark.parametrize(
    "text",
    [
        "",
        "http://robot",
        "sim://",
        "sim://kr6",
        "sim://localhost",
        "sim://localhost:",
        "sim://iiwa14?colour=red",
        "sim://iiwa14?speed=fast",
        "sim://iiwa14?speed=0",
        "sim://iiwa14/view",
        "sim://localhost:1?speed=2",
        "robot:port",
        "robot:70000",
        "robot:0",
        "a robot",
        "robot/1",
        "me@robot",
    ],
)
def test_bad_targets_show_good_ones(text: str) -> None:
    with pytest.raises(ha.ConnectFailed, match="target must be") as error:
        ha.connect(text)
    assert "sim://iiwa14" in str(error.value) and "172.31.1.147" in str(error.value)


def test_the_environment_names_the_default(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HEPTARM_TARGET", " sim://iiwa7 ")
    assert ha.target_from_env() == "sim://iiwa7"
    monkeypatch.delenv("HEPTARM_TARGET")
    with pytest.raises(ha.ConnectFailed, match="HEPTARM_TARGET"):
        ha.connect()


def test_nobody_at_the_address() -> None:
    with pytest.raises(ha.ConnectFailed, match="127.0.0.1:1"):
        ha.connect("127.0.0.1:1", timeout=1.0)


def test_wrong_options_are_refused_before_anything_is_tried() -> None:
    with pytest.raises(ha.ShapeError):
        ha.connect("127.0.0.1:1", on_disconnect="dance")  # type: ignore[arg-type]
    for options in ({"watchdog": 0.01}, {"state_rate": 5000.0}, {"timeout": 0.0}):
        with pytest.raises(ha.LimitError):
            ha.connect("127.0.0.1:1", **options)  # type: ignore[arg-type]


def test_the_name_of_a_robot_alone_is_no_host(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror  # without a network a look-up may take long

    monkeypatch.setattr(socket, "create_connection", unknown)
    with pytest.raises(
        ha.ConnectFailed, match=r'no host has that name \("sim://iiwa14" starts a simulator\)'
    ):
        ha.connect("iiwa14")
