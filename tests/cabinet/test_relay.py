"""A relay without the key tampers with a session: nothing of it is executed, the session ends, the arm stops."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

import heptarm as ha
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from heptarm.wire.frames import pack
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer
from tests.relay import Attack, Relay

KEY = "a key that the relay does not have"
SLOW = 0.05
_FAST = wire.SetOverride(value=1.0).encode()


def _seq(frame: bytes) -> int:
    return int.from_bytes(frame[10:14], "big")


def _changed(frame: bytes, place: int, change: int = 1) -> bytes:
    return frame[:place] + bytes([frame[place] ^ change]) + frame[place + 1 :]


def _forged(frames: list[bytes]) -> bytes:
    """A frame as a client without a key would send it, or as one that guesses the tag."""
    return pack(wire.SetOverride.TYPE, _FAST, seq=_seq(frames[-1]), request=4711)


def _guessed(frames: list[bytes]) -> bytes:
    frame = _forged(frames)
    return frame[:3] + b"\1" + frame[4:] + bytes(16)


def _reordered(frames: list[bytes]) -> bytes:
    return b"" if len(frames) % 2 else frames[-1] + frames[-2]


ATTACKS: dict[str, Attack] = {
    "injected": lambda frames: _forged(frames) + frames[-1],
    "injected with a tag": lambda frames: _guessed(frames) + frames[-1],
    "changed": lambda frames: _changed(frames[-1], len(frames[-1]) - 17),
    "changed in its tag": lambda frames: _changed(frames[-1], len(frames[-1]) - 1),
    "renumbered": lambda frames: _changed(frames[-1], 13),
    "repeated": lambda frames: frames[-2] + frames[-1],
    "dropped": lambda frames: b"" if len(frames) % 2 else frames[-1],
    "reordered": _reordered,
    "lengthened": lambda frames: _changed(frames[-1], 8),  # then nothing more is a whole frame
    "all dropped": lambda _: b"",
}


@pytest.fixture(scope="module")
def keyed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FakeCabinet]:
    with FakeCabinet(log=tmp_path_factory.mktemp("relay") / "log", key=KEY, heartbeat=2.0) as cabinet:
        yield cabinet
        assert cabinet.errors() == []


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.parametrize("direction", ["up", "down"])
def test_an_attacked_line_stops_the_arm(keyed: FakeCabinet, direction: str, attack: str) -> None:
    address: dict[str, Any] = {
        "key": KEY,
        "name": "victim",
        "timeout": 30.0,
        "groups": ("joints",),
        "watchdog": 3.0,
    }
    with Relay(keyed.port) as relay, ExitStack() as stack:
        arm = ha.connect(f"127.0.0.1:{relay.port}", **address)
        watcher = stack.enter_context(Peer(keyed.port, key=KEY, name="watcher"))
        try:
            arm.set_override(1.0)
            arm.set_override(SLOW)
            motion = arm.start(ha.ptp([-2.5 if arm.state.q[0] > 0 else 2.5, 0, 0, 0, 0, 0, 0]))
            watcher.wait_for(wire.MotionStarted, lambda event: event.id == motion.id)
            watcher.ask(wire.Subscribe(groups=wire.Groups.MOTION, rate=200.0))
            watcher.wait_for(
                wire.State, lambda state: state.motion is not None and state.motion.motion == motion.id
            )
            relay.attack(direction, ATTACKS[attack])  # type: ignore[arg-type]
            with pytest.raises(ha.ConnectionLost) as error:
                motion.wait(timeout=30.0)
            ended = watcher.wait_for(wire.MotionFinished, lambda event: event.id == motion.id)
            assert ended.cause == wire.Cause.LOST
            watcher.wait(lambda _, message: isinstance(message, wire.State), since=len(watcher.seen))
            if direction == "down" and attack not in ("lengthened", "all dropped"):
                assert error.value.code == Code.FORGED_FRAME
        finally:
            arm.close()
        states = [state.motion for state in watcher.all(wire.State) if state.motion is not None]
        assert states and max(state.override for state in states) <= SLOW  # also after its end
        assert not [event for event in watcher.all(wire.MotionStarted) if event.id > motion.id]
    with Peer(keyed.port, key=KEY, name="next") as following:  # the cabinet serves the next client
        following.take_control()
        assert isinstance(following.ask(wire.SetOverride(value=1.0)), wire.Accepted)


def test_a_relay_that_changes_nothing_is_not_noticed(keyed: FakeCabinet) -> None:
    with Relay(keyed.port) as relay, ha.connect(f"127.0.0.1:{relay.port}", key=KEY, timeout=30.0) as arm:
        assert arm.move(ha.ptp([0.1, 0, 0, 0, 0, 0, 0])).arrived
        assert next(arm.states()).q[0] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize("message", [wire.Hello, wire.Welcome], ids=["hello", "welcome"])
def test_a_relay_cannot_change_a_hello(keyed: FakeCabinet, message: type[wire.Message]) -> None:
    direction, place = ("up", 3) if message is wire.Hello else ("down", 3)  # the minor version
    with Relay(keyed.port) as relay:
        relay.attack(
            direction,  # type: ignore[arg-type]
            lambda frames: (
                _changed(frames[-1], wire.HEADER.size + place)
                if int.from_bytes(frames[-1][4:6], "big") == message.TYPE
                else frames[-1]
            ),
        )
        with pytest.raises(ha.ConnectFailed, match="key") as error:
            ha.connect(f"127.0.0.1:{relay.port}", key=KEY, timeout=30.0)
        assert error.value.code == Code.WRONG_KEY


def test_without_a_key_a_relay_is_not_kept_out(tmp_path: Path) -> None:
    """What the key is for: the same injection, without it."""
    with (
        FakeCabinet(log=tmp_path / "log") as cabinet,
        Peer(cabinet.port) as watcher,
        Relay(cabinet.port) as relay,
    ):
        watcher.ask(wire.Subscribe(groups=wire.Groups.MOTION, rate=100.0))
        with ha.connect(f"127.0.0.1:{relay.port}", timeout=30.0) as arm:
            arm.set_override(SLOW)
            relay.attack("up", _forged)
            watcher.wait_for(
                wire.State, lambda state: state.motion is not None and state.motion.override == 1.0
            )
