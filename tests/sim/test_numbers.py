"""Numbers that a client may send and no motion can have: refused before they are planned, never NaN in the plant."""

from __future__ import annotations

import tracemalloc
from math import isfinite, nan
from typing import Any

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from heptarm.planning.motion import FARTHEST, SLOWEST, PlanError
from heptarm.planning.planner import plan
from heptarm.planning.seam import PlantMotion
from heptarm.values.robot import robot
from tests.sim import motions
from tests.sim.driving import READY as HOME

ROBOT = robot("iiwa14")
READY = np.array(HOME)
#: What the wire lets through, the ends of the legal range above all.
fractions = st.sampled_from([5e-324, 1e-300, SLOWEST, 1e-3, 1.0])
speeds = fractions | st.sampled_from([nan, 10.0, 1e300])
numbers = st.sampled_from([0.0, 1e-300, 1e-9, 0.05, -0.2, FARTHEST, 1e154, -1e300, nan])
places = st.tuples(numbers, numbers, numbers).map(lambda xyz: (*xyz, 0.0, 0.0, 0.0, 1.0))


@st.composite
def moves(draw: st.DrawFn) -> PlantMotion:
    kind = draw(st.sampled_from(["lin_rel", "circ", "ptp_pose"]))
    given: dict[str, Any] = {
        name: (draw(fractions),) * 7 for name in ("joint_velocity", "joint_acceleration", "joint_jerk")
    }
    given |= {name: draw(speeds) for name in ("velocity", "acceleration", "jerk", "orientation_velocity")}
    given["blending"] = (draw(st.sampled_from([0.0, 1e-300, 1.0])), 0.0, 0.0)
    if kind == "lin_rel":
        return motions.lin_rel(draw(places), (0.0, 0.0, 0.0, 1.0), **given)
    if kind == "circ":
        return motions.circ(draw(places), draw(places), **given)
    return motions.ptp_pose(draw(places), **given)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(moves(), min_size=1, max_size=2))
@example([motions.lin_rel((0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0), velocity=5e-324)])
@example([motions.ptp((0.1,) * 7, joint_velocity=(5e-324,) * 7)])
@example([motions.lin_rel((1e300, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))])
def test_every_plan_is_finite(parts: list[PlantMotion]) -> None:
    """A refusal, or a plan without NaN; NumPy's warnings are errors in tests."""
    motion = parts[0] if len(parts) == 1 else motions.batch(*parts)
    try:
        made = plan(ROBOT, motion, READY)
    except PlanError:
        return
    assert isfinite(made.duration)
    if made.timing is not None:
        times = np.linspace(0.0, made.duration, 5)
        assert np.isfinite([made.timing.profile.at(time) for time in times.tolist()]).all()


def test_a_tiny_jerk_needs_no_large_memory() -> None:
    """The acceleration then takes minutes to come and go; that must not be sampled every millisecond."""
    turn = np.array([0.3, 0.0, 0.0, 0.2, 0.0, 0.4, 0.0])
    line = motions.lin_rel(
        (0.0, 0.2, -0.1, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), acceleration=100.0, joint_jerk=(1e-4,) * 7
    )
    tracemalloc.start()
    try:
        assert isfinite(plan(ROBOT, line, READY + turn).duration)
        assert tracemalloc.get_traced_memory()[1] < 1e8
    finally:
        tracemalloc.stop()
