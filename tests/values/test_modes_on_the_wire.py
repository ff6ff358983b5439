"""A control mode that a state reports is the mode that was commanded, for every kind of mode."""

from __future__ import annotations

import pytest

from heptarm.arm.translate.modes import mode_message, read_mode
from heptarm.modes import CartesianImpedance, JointImpedance, Position, SineImpedance
from heptarm.values.mode.mode import Mode


@pytest.mark.parametrize(
    "mode",
    [
        Position(),
        JointImpedance(0.0),
        JointImpedance(300.0, damping=0.4),
        CartesianImpedance(),
        SineImpedance(),
    ],
    ids=lambda mode: type(mode).__name__,
)
def test_a_mode_survives_its_message(mode: Mode) -> None:
    assert read_mode(mode_message(mode)) == mode
