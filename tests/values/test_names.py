"""Names that a user gives: no control characters, no halves of surrogate pairs, whatever the name is of."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import heptarm as ha
from heptarm.do import Notify, SetOutput
from heptarm.errors import ShapeError
from heptarm.modes import CartesianImpedance
from heptarm.values.condition.signals import SignalIs
from heptarm.values.workspace import Workspace

POSE = ha.Pose.of((0.5, 0.0, 0.5))
NAMED: dict[str, Callable[[str], object]] = {
    "tool": ha.Tool,
    "workpiece": ha.Workpiece,
    "frame of a tool": lambda name: ha.Tool("gripper", frames={name: POSE}),
    "frame of a motion": lambda name: ha.lin(POSE, frame=name),
    "motion frame": lambda name: ha.ptp(POSE, moving=name),
    "frame of a mode": lambda name: CartesianImpedance(frame=name),
    "frame of a workspace": lambda name: Workspace(((0.3, -0.5, 0.1), (0.8, 0.5, 0.9)), frame=name),
    "signal": SignalIs,
    "output": lambda name: SetOutput(name, True),
    "label": Notify,
    "scene of a camera": lambda name: ha.Camera(scene=name),
    "client": lambda name: ha.connect("127.0.0.1:1", name=name, timeout=1.0),
}


@pytest.mark.parametrize("what", NAMED)
@pytest.mark.parametrize("name", ["a\0b", "a\x1b[2Jb", "a\nb", "\ud800", "a\u202eb"])
def test_a_name_that_cannot_be_printed_is_refused(what: str, name: str) -> None:
    with pytest.raises(ShapeError, match="must have printable characters only, got '"):
        NAMED[what](name)


@pytest.mark.parametrize("what", [what for what in NAMED if what != "client"])
def test_a_name_of_any_language_is_taken(what: str) -> None:
    assert NAMED[what]("Greifer №2 夹爪") is not None
