"""Control modes in the core: values that a client refuses are refused here as well, with the same code."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from heptarm.errors import HeptarmError
from heptarm.values.mode import mode as values
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run

NAN = math.nan
OFF = (NAN,) * 6
SPRING = wire.CartesianImpedance(
    stiffness=(2000.0,) * 3 + (200.0,) * 3,
    damping=(0.7,) * 6,
    nullspace_stiffness=100.0,
    nullspace_damping=0.7,
    additional_force=(0.0,) * 6,
    frame="",
)
WAVE = wire.SineImpedance(
    base=SPRING,
    amplitude=(0.0, 10.0, 0.0, 0.0, 0.0, 0.0),
    frequency=(2.0,) * 6,
    phase=(0.0,) * 6,
    bias=(0.0,) * 6,
)
#: Contradicting fields, the parameter in the refusal, and the error that a client raises.
CONTRADICTIONS: dict[str, tuple[dict[str, Any], str]] = {
    "too stiff about x": ({"stiffness": (0.0,) * 3 + (301.0, 0.0, 0.0)}, "stiffness[3]"),
    "too stiff about z": ({"stiffness": (5000.0,) * 3 + (0.0, 0.0, 5000.0)}, "stiffness[5]"),
    "stops without a force": ({"max_force_stops": True}, "max_force_stops"),
}
ENDLESS: dict[str, tuple[dict[str, Any], str]] = {
    "ramps longer than the whole": ({"rise_time": 0.6, "fall_time": 0.5, "total_time": 1.0}, "total_time"),
    "waits for no end": ({"stay_active": True}, "stay_active"),
}
BAD: dict[str, tuple[Any, str]] = {
    **{name: (replace(SPRING, **fields), field) for name, (fields, field) in CONTRADICTIONS.items()},
    **{
        f"base {name}": (replace(WAVE, base=replace(SPRING, **fields)), f"base.{field}")
        for name, (fields, field) in CONTRADICTIONS.items()
    },
    **{name: (replace(WAVE, **fields), field) for name, (fields, field) in ENDLESS.items()},
}
#: Close to the limit, on the allowed side.
GOOD = (
    SPRING,
    replace(SPRING, stiffness=(5000.0,) * 3 + (300.0,) * 3),
    replace(SPRING, max_force_stops=True, max_force=(NAN,) * 5 + (0.0,)),
    WAVE,
    replace(WAVE, rise_time=0.5, fall_time=0.5, total_time=1.0, stay_active=True),
    replace(WAVE, hold_time=1.0, stay_active=True),
    wire.SpiralPattern(plane=wire.Plane.XZ, frequency=1.0, amplitude=5.0, stiffness=500.0, total_time=3.0),
)


@pytest.fixture
def peer(cabinet: FakeCabinet) -> Iterator[Peer]:
    with Peer(cabinet.port) as peer:
        peer.take_control()
        yield peer
        peer.ask(wire.Stop())


def under(mode: Any) -> wire.Run:
    return run(ptp(), replace(ptp(), mode=mode))


@pytest.mark.parametrize("name", BAD)
def test_contradictions_are_refused_when_the_client_is_bypassed(peer: Peer, name: str) -> None:
    mode, field = BAD[name]
    refused = peer.ask(under(mode))
    assert isinstance(refused, wire.Rejected)
    assert (refused.code, refused.parameter) == (Code.OUT_OF_RANGE, f"items[1].mode.{field}")
    refused = peer.ask(wire.ServoOpen(watchdog=1.0, mode=mode))
    assert (refused.code, refused.parameter) == (Code.OUT_OF_RANGE, f"mode.{field}")


@pytest.mark.parametrize("fields", [fields for fields, _ in CONTRADICTIONS.values()])
def test_the_client_refuses_the_same_with_the_same_code(fields: dict[str, Any]) -> None:
    with pytest.raises(HeptarmError) as refused:
        values.CartesianImpedance(**fields)
    assert refused.value.code == Code.OUT_OF_RANGE


@pytest.mark.parametrize("fields", [fields for fields, _ in ENDLESS.values()])
def test_the_client_refuses_the_same_patterns(fields: dict[str, Any]) -> None:
    with pytest.raises(HeptarmError) as refused:
        values.SineImpedance(**fields)
    assert refused.value.code == Code.OUT_OF_RANGE


def test_what_is_just_allowed_runs(peer: Peer) -> None:
    for mode in GOOD:
        accepted = peer.ask(under(mode))
        assert isinstance(accepted, wire.Accepted), accepted
        end = peer.wait_for(wire.MotionFinished, lambda event, id=accepted.id: event.id == id)  # type: ignore[misc]
        assert end.cause is wire.Cause.FINISHED


def test_a_servo_motion_keeps_the_frame_of_its_mode_and_refuses_contradictions(peer: Peer) -> None:
    servo = peer.ask(wire.ServoOpen(watchdog=2.0, mode=SPRING)).id
    peer.wait_for(wire.MotionStarted, lambda event: event.id == servo)
    for mode, code in (
        (replace(SPRING, frame="tool", nullspace_stiffness=0.0), None),
        (replace(SPRING, frame="base"), Code.MODE_CONFLICT),
        (WAVE, Code.MODE_CONFLICT),
        (replace(SPRING, max_force_stops=True), Code.OUT_OF_RANGE),
    ):
        answer = peer.ask(wire.ServoSettings(servo=servo, mode=mode))
        assert getattr(answer, "code", None) == code, answer
    peer.ask(wire.ServoClose(servo=servo))
    peer.wait_for(wire.MotionFinished, lambda event: event.id == servo)
