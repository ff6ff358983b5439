"""Every method of an arm and its parts with every bad value: refused by name, before anything is sent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import pytest

import heptarm
from heptarm import Arm
from heptarm.arm.devices.operator import Operator
from heptarm.arm.link.local_simulator import PrivateCabinet
from heptarm.fri import Client
from heptarm.fri.loop import client as fri_client
from heptarm.io import tcp
from heptarm.wire import messages as wire
from tests.bad_values import Call, call_of, methods_of, wrong
from tests.conftest import RunningCabinet

#: Without parameters of a user's, or about the connection itself.
SKIPPED = ("open", "send", "on_accepted", "on_event", "on_lost", "on_fork")


class _NoCabinet:
    """A cabinet that nothing may reach."""

    def operate(self, words: str) -> NoReturn:
        raise AssertionError(f"sends {words!r}")


@pytest.fixture(scope="module")
def arm(cabinet: RunningCabinet) -> Iterator[Arm]:
    with heptarm.connect(cabinet.target, watchdog=5.0, timeout=30.0) as arm:
        yield arm


@contextmanager
def silence(arm: Arm) -> Iterator[None]:
    """A block in which any message to the cabinet but a ping is an error."""
    link = arm.connection.link
    send, stream = link._send, link.send_target

    def refuse(message: Any, *arguments: Any) -> Any:
        if isinstance(message, wire.Ping):
            return send(message, *arguments)
        raise AssertionError(f"sends {message}")

    def refuse_target(*_: Any, **__: Any) -> NoReturn:
        raise AssertionError("sends a target")

    link._send, link.send_target = refuse, refuse_target  # type: ignore[method-assign, assignment]
    try:
        yield
    finally:
        link._send, link.send_target = send, stream  # type: ignore[method-assign]


def settings_of(arm: Arm) -> tuple[object, ...]:
    """What a refused call must not change."""
    tooling, connection = arm._tooling, arm.connection
    return (
        arm.speed,
        arm._mode,
        arm._breaks,
        arm.groups,
        arm.state_rate,
        dict(tooling._defined),
        tooling._commanded,
        tooling._workpiece,
        list(connection.events.key_listeners),
    )


def calls(arm: Arm, handle: heptarm.MotionHandle) -> Iterator[Call]:
    """Every method of an arm, its parts, its servo motions, its handles."""
    yield from methods_of("Arm", arm, skip=SKIPPED)
    yield from methods_of("arm.io", arm.io, skip=("get", "items", "keys", "values"))
    yield from methods_of("arm.pad", arm.pad)
    yield from methods_of("arm.operator", Operator(_NoCabinet()))  # type: ignore[arg-type]
    yield from methods_of("JointServo", arm.servo())
    yield from methods_of("PoseServo", arm.servo("pose"))
    yield from methods_of("VelocityServo", arm.servo("velocity"))
    yield from methods_of("TwistServo", arm.servo("twist"))
    yield from methods_of("MotionHandle", handle, skip=SKIPPED)


def test_no_bad_value_reaches_the_cabinet(arm: Arm) -> None:
    arm.io["LEDBlue"]  # subscribes to the signals
    handle = arm.start(heptarm.hold(0.01))
    handle.wait()
    found: list[str] = []
    tested = 0
    for call in calls(arm, handle):
        before = settings_of(arm)
        with silence(arm):
            found += wrong(call, only_meaningless=True)
        if settings_of(arm) != before:
            found.append(f"{call.name} is half applied: {before} becomes {settings_of(arm)}")
        tested += len(call.parameters)
    assert not found, "\n".join(found)
    assert tested > 150, "the enumeration has lost most of the API"
    assert arm.connected and arm.in_control


def test_connecting_is_refused_before_anything_is_dialled_or_started(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object, **__: object) -> NoReturn:
        raise AssertionError("dials or starts a simulator")

    monkeypatch.setattr(tcp, "connect", never)
    monkeypatch.setattr(PrivateCabinet, "start", never)
    found = list(wrong(call_of("connect", heptarm.connect), only_meaningless=True))
    assert not found, "\n".join(found)


def test_an_fri_client_is_refused_before_its_process_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object, **__: object) -> NoReturn:
        raise AssertionError("starts a process")

    with Client(0, realtime=False) as client:
        found = [text for call in methods_of("Client", client) for text in wrong(call, only_meaningless=True)]
    monkeypatch.setattr(fri_client, "MemoryBlock", never)
    found += wrong(call_of("Client", _client), only_meaningless=True)
    assert not found, "\n".join(found)


_client: Callable[..., Client] = Client
