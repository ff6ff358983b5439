"""Triggers as values."""

from __future__ import annotations

import numpy as np
import pytest

import heptarm as ha
from heptarm.do import notify, set_output
from heptarm.values.condition.force import force
from heptarm.values.condition.signals import path
from heptarm.values.motion.motion import Triggered
from heptarm.values.result import MotionEvent

HERE = ha.Pose.at(0.5, 0.0, 0.4)
THERE = ha.Pose.at(0.5, 0.1, 0.4)
MOTIONS: list[Triggered] = [
    ha.ptp(np.zeros(7)),
    ha.ptp(HERE),
    ha.lin(HERE),
    ha.lin_rel(z=0.1),
    ha.circ(HERE, THERE),
    ha.spline([HERE, THERE]),
    ha.spline_joints([np.zeros(7), np.ones(7)]),
    ha.hold(1.0),
]


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: type(motion).__name__)
def test_every_motion_takes_triggers_and_stays_what_it_was(motion: Triggered) -> None:
    one = motion.trigger(force > 10, notify("touch"))
    two = one.trigger(path.after(0.1), set_output("LEDBlue", True))
    assert motion.triggers == () and len(one.triggers) == 1
    assert [trigger.action for trigger in two.triggers] == [notify("touch"), set_output("LEDBlue")]
    assert two == motion.trigger(force > 10, notify("touch")).trigger(path.after(0.1), set_output("LEDBlue"))
    assert one not in (motion, two) and hash(one) != hash(two)
    assert two.limited_to(0.5).triggers == two.triggers


def test_sixteen_are_enough() -> None:
    motion = ha.hold(1.0)
    for _ in range(16):
        motion = motion.trigger(force > 10, notify())
    with pytest.raises(ha.ShapeError, match="at most 16"):
        motion.trigger(force > 10, notify())


def test_what_is_no_trigger_is_refused() -> None:
    with pytest.raises(ha.ShapeError, match="must be a condition"):
        ha.hold(1.0).trigger(5.0, notify())  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="must be an action"):
        ha.hold(1.0).trigger(force > 10, "notify")  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError, match="128"):
        notify("x" * 129)
    with pytest.raises(ha.ShapeError, match="number"):
        set_output("LEDBlue", "on")  # type: ignore[arg-type]
    with pytest.raises(ha.ShapeError):
        set_output("")


def test_of_a_spline_only_the_whole_has_triggers() -> None:
    with pytest.raises(ha.CommandRejected, match=r"segments\[1\] has triggers"):
        ha.spline([HERE, ha.lin(THERE).trigger(path.after(0.1), notify())])
    with pytest.raises(ha.CommandRejected, match=r"points\[0\] has triggers"):
        ha.spline_joints([ha.ptp(np.zeros(7)).trigger(path.after(0.1), notify())])


def test_only_a_notice_has_a_label() -> None:
    notice = ha.Trigger(force > 10, notify("touch"))
    assert MotionEvent("trigger", 0, trigger=notice).label == "touch"
    assert MotionEvent("trigger", 0, trigger=ha.Trigger(force > 10, set_output("LEDBlue"))).label == ""
    assert MotionEvent("begun", 0).label == ""
