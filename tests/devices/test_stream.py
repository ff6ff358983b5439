"""Devices without hardware: functions of time, recordings and their replay."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from heptarm import devices
from heptarm.devices.device import without_dead_zone
from heptarm.devices.virtual import RecordedDevice, RecordingDevice, SyntheticDevice
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.io.clock import StepClock

FORWARD = [1.0, 0, 0, 0, 0, 0]


@pytest.mark.parametrize("make", [devices.DeviceInput.of, devices.DeviceInput])
def test_an_input_is_clipped_and_checked(make: Callable[..., devices.DeviceInput]) -> None:
    one = make([2.0, -3.0, 0.5, 0, 0, 0], ["LB"])
    assert one.twist.tolist() == [1, -1, 0.5, 0, 0, 0] and one.buttons == {"LB"}
    assert one == make([1, -1, 0.5, 0, 0, 0], {"LB"})
    with pytest.raises(ShapeError, match="twist"):
        make([0.0] * 5)
    with pytest.raises(LimitError, match="finite"):
        make([float("nan")] * 6)
    with pytest.raises(ShapeError, match="buttons"):
        make([0.0] * 6, "LB")


def test_a_dead_zone_ends_without_a_step() -> None:
    assert without_dead_zone(0.1, 0.1) == without_dead_zone(-0.05, 0.1) == 0.0
    assert 0.0 < without_dead_zone(0.101, 0.1) < 0.01
    assert without_dead_zone(-1.5, 0.1) == -1.0


def test_a_function_of_time_is_a_device() -> None:
    clock = StepClock(5_000_000_000)

    def play(seconds: float) -> object:
        return None if seconds > 1.0 else [seconds, 0, 0, 0, 0, 0]

    device = SyntheticDevice(play, clock=clock)  # type: ignore[arg-type]
    assert device.read().twist[0] == 0.0
    clock.step(0.5)
    assert device.read().twist[0] == 0.5
    clock.step(1.0)
    assert not device.read().twist.any()
    with pytest.raises(ShapeError, match="function"):
        devices.synthetic("w")  # type: ignore[arg-type]


def test_a_recording_replays_with_its_times_buttons_and_roles(tmp_path: Path) -> None:
    clock, file = StepClock(), tmp_path / "person.jsonl"
    roles = devices.Roles(dead_man="LB", gripper="A", quit="START")
    source = SyntheticDevice(
        lambda t: devices.DeviceInput.of(FORWARD if t >= 1.0 else [0.0] * 6, ["LB"] if t >= 0.5 else []),
        roles=roles,
        clock=clock,
    )
    with RecordingDevice(source, file, clock=clock) as recording:
        assert recording.roles == roles
        for _ in range(20):
            seen = recording.read()
            clock.step(0.1)
    assert seen.twist[0] == 1.0

    replayed = devices.recorded(file)
    assert replayed.roles == roles and replayed.duration == pytest.approx(1.9)
    again = RecordedDevice(replayed.inputs, clock=clock)
    states = []
    for _ in range(25):
        states.append(again.read())
        clock.step(0.1)
    forward = [state.twist[0] for state in states]
    np.testing.assert_allclose(forward, [0.0] * 10 + [1.0] * 10 + [0.0] * 5, atol=1e-9)
    assert states[7].buttons == {"LB"} and not states[2].buttons and not states[-1].buttons


@pytest.mark.parametrize(
    "text",
    ["", "{}", "[1]", '{"format": "other", "roles": []}', '{"format": "heptarm input 1", "roles": []}'],
)
def test_what_is_no_recording_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "wrong.jsonl"
    file.write_text(text)
    with pytest.raises(CommandRejected, match="wrong.jsonl"):
        devices.recorded(file)
    with pytest.raises(CommandRejected, match="no such file"):
        devices.recorded(tmp_path / "missing.jsonl")
    with pytest.raises(CommandRejected, match="no such file"):
        devices.recording(devices.synthetic(lambda t: None), tmp_path / "no" / "file.jsonl")
