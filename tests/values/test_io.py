"""Values of signals are found by their short and full names."""

from __future__ import annotations

import pickle

import pytest

from heptarm.errors import CommandRejected, StaleState
from heptarm.values.io import Signal, SignalValues
from heptarm.values.state import Groups, State

SEEN = SignalValues(5, {"MediaFlange.UserButton": True, "MediaFlange.InputX3Pin3": False, "Cell.Level": 2.5})


def test_by_full_name_by_part_and_as_attribute() -> None:
    assert SEEN["MediaFlange.UserButton"] is True and SEEN["user_button"] is True and SEEN.user_button is True
    assert SEEN.input_x3_pin_3 is False and SEEN.level == 2.5
    assert (
        list(SEEN) == ["MediaFlange.UserButton", "MediaFlange.InputX3Pin3", "Cell.Level"] and len(SEEN) == 3
    )
    with pytest.raises(CommandRejected, match="no signal 'lamp'") as error:
        _ = SEEN.lamp
    assert "Cell.Level" in error.value.hint
    assert "user_button" in SEEN and "lamp" not in SEEN and 3 not in SEEN
    assert SEEN.get("lamp", 0.5) == 0.5 and SEEN.get("user_button") is SEEN["user_button"]


def test_a_value_of_a_state() -> None:
    state = State(Groups(io=SEEN))
    assert state.io.user_button and state.stamp == 5
    assert state == State(Groups(io=SignalValues(5, dict(SEEN)))) and hash(state) == hash(
        pickle.loads(pickle.dumps(state))
    )
    assert state != State(Groups(io=SignalValues(6, dict(SEEN))))
    with pytest.raises(StaleState, match="io"):
        _ = State().io


def test_a_signal_knows_its_kind() -> None:
    assert Signal("A.B", True, "boolean").value(1.0) is True
    assert Signal("A.C", True, "unsigned", 0, 255).value(7) == 7.0
