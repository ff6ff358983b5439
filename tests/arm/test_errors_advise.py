"""Errors that recognise a slip: millimetres, degrees, another program on the port, a watchdog that is too short."""

from __future__ import annotations

import contextlib
import math
import socket
import threading

import pytest

import heptarm as ha
from heptarm.arm.translate.errors import error_of
from heptarm.arm.translate.motions import item
from heptarm.errors import (
    CommandRejected,
    ConnectFailed,
    HeptarmError,
    LimitError,
    MissingExtra,
    missing_extra,
    require_extra,
    without_java,
)
from heptarm.fri import Client
from heptarm.values.robot import robot
from heptarm.wire.codes import MEANINGS, Code

IIWA14 = robot("iiwa14")


def refused(motion: object) -> str:
    with pytest.raises(LimitError) as error:
        item(motion, IIWA14)  # type: ignore[arg-type]
    return str(error.value)


def test_degrees_for_joint_positions() -> None:
    assert "did you mean ha.deg(0, 30, 0, -90, 0, 60, 0)?" in refused(ha.ptp([0, 30, 0, -90, 0, 60, 0]))
    # radians beyond a limit, and degrees beyond it as well, are no slip of units
    assert "ha.deg" not in refused(ha.ptp([0, 2.6, 0, 0, 0, 0, 0]))
    assert "ha.deg" not in refused(ha.ptp([0, 150, 0, 0, 0, 0, 0]))


def test_degrees_for_an_angle() -> None:
    for call in (lambda: ha.lin_rel(a=30), lambda: ha.Pose.xyz_abc(0.5, 0, 0.5, 180, 0, 180)):
        with pytest.raises(LimitError, match=r"did you mean math\.radians\((30|180)\)\?"):
            call()
    assert ha.lin_rel(a=math.radians(30)) and ha.Pose.xyz_abc(a=2 * math.pi)
    with pytest.raises(LimitError, match=r"math\.radians\(90\)"):
        ha.lin_rel(z=0.1, speed_radps=90)


def test_millimetres() -> None:
    assert (
        "offset.z must be in [-4, 4] m, got 50 m (units are metres: did you mean 50 mm, which is 0.05 m?)"
        in refused(ha.lin_rel(z=50))
    )
    assert "target.x" in refused(ha.lin(ha.Pose.xyz_abc(500, 0, 400)))
    assert "did you mean 500 mm, which is 0.5 m?" in refused(ha.ptp(ha.Pose.xyz_abc(500, 0, 400)))
    with pytest.raises(LimitError, match=r"did you mean 250 mm/s, which is 0\.25 m/s\?"):
        ha.lin_rel(z=0.1, speed_mps=250)
    with pytest.raises(LimitError, match=r"did you mean 20 mm, which is 0\.02 m\?"):
        ha.lin_rel(z=0.1, blend_m=20)
    with pytest.raises(LimitError) as wrong:  # nor as millimetres is it right
        ha.lin_rel(z=0.1, speed_mps=-250)
    assert "did you mean" not in str(wrong.value)


@contextlib.contextmanager
def answering(answer: bytes):  # type: ignore[no-untyped-def]
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            with contextlib.suppress(OSError), server.accept()[0] as connection:
                connection.sendall(answer)
                connection.recv(4096)
                connection.recv(4096)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield f"127.0.0.1:{server.getsockname()[1]}"
        thread.join(10)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", r"a web server \(HTTP\) is on this port, not heptarm"),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "an SSH server is on this port, not heptarm"),
        (b"\x00\x01\x02", "a frame must begin with 4837, got 0001"),
    ],
)
def test_another_program_on_the_port_is_named(answer: bytes, words: str) -> None:
    with answering(answer) as address, pytest.raises(ConnectFailed, match=words):
        ha.connect(address, timeout=5)


def test_a_lost_controller_learns_how_to_raise_its_watchdog() -> None:
    assert "connect(..., watchdog=2.0)" in MEANINGS[Code.CONTROLLER_LOST].advice


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("java.lang.NullPointerException", ""),
        ("java.net.BindException: Address already in use", "Address already in use"),
        (
            "the stop failed: com.kuka.roboticsAPI.CommandInvalidException: not now",
            "the stop failed: not now",
        ),
        ("Can not plan motion: the target is at 1.2 m", "Can not plan motion: the target is at 1.2 m"),
    ],
)
def test_no_exception_of_java_reaches_the_user(text: str, left: str) -> None:
    assert without_java(text) == left
    assert "Exception" not in str(error_of(Code.INTERNAL, text))


def test_a_missing_extra_is_one_sentence_with_the_command() -> None:
    error = missing_extra("viser.transforms")
    assert str(error) == "this needs the package 'viser', which is not installed (pip install 'heptarm[viz]')"
    assert missing_extra("numpy") is None
    require_extra("sim")


def test_windows_gets_one_sentence_for_what_does_not_work_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heptarm.errors._PLATFORM", "win32")
    with pytest.raises(
        CommandRejected, match=r"the virtual cabinet runs on Linux, this is Windows \(use WSL"
    ):
        ha.connect("sim://iiwa14")
    with pytest.raises(CommandRejected, match="FRI runs on Linux"):
        Client(0)


def test_a_private_simulator_without_its_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heptarm.errors.EXTRAS", {"sim": ("no_such_package",)})
    with pytest.raises(MissingExtra, match=r"pip install 'heptarm\[sim\]'"):
        ha.connect("sim://iiwa14")
    with pytest.raises(HeptarmError):
        require_extra("sim")
