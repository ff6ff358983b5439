"""Arcs: from three points, and three points from a centre, a plane and an angle."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.motion.circle import Circ, arc, circ, circle_through
from heptarm.values.motion.line import lin
from heptarm.values.motion.orientation import Orientation
from heptarm.values.pose import Pose, Redundancy, deg

START = Pose.xyz_abc(0.6, 0.0, 0.4, *deg(180, 0, 180))
VIA, END = Pose.at(0.65, 0.05, 0.4), Pose.at(0.6, 0.1, 0.4)


def test_an_arc_is_a_value() -> None:
    motion = circ(VIA, END, speed_mps=0.1, reference="path")
    assert motion == circ(VIA, END, speed_mps=0.1, reference="path") != circ(VIA, END, speed_mps=0.1)
    assert pickle.loads(pickle.dumps(motion)) == motion and hash(motion) == hash(
        pickle.loads(pickle.dumps(motion))
    )
    assert isinstance(motion, Circ) and motion.orientation == Orientation("variable", "path")
    assert motion.limited_to(0.3).dynamics.joint_speed.tolist() == [0.3] * 7


@given(
    angle=st.floats(0.05, 6.0) | st.floats(-6.0, -0.05),
    normal=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1),
    centre=st.tuples(*[st.floats(-0.5, 0.5)] * 3),
)
def test_an_arc_keeps_its_distance_from_the_axis(
    angle: float, normal: tuple[float, ...], centre: tuple[float, ...]
) -> None:
    axis = np.array(normal) / np.linalg.norm(normal)
    lever = START.xyz - centre
    flat = lever - (lever @ axis) * axis
    if np.linalg.norm(flat) * abs(angle) < 1e-3:
        return
    motion = arc(START, angle, centre=centre, plane=normal)
    for fraction, pose in ((0.5, motion.via), (1.0, motion.end)):
        at = pose.xyz - centre
        assert at @ axis == pytest.approx(lever @ axis, abs=1e-9)
        across = np.cross(axis, flat)
        wanted = flat * math.cos(fraction * angle) + across * math.sin(fraction * angle)
        assert at - (at @ axis) * axis == pytest.approx(wanted, abs=1e-9)
    assert motion.end.angle_to(START) < 1e-9
    circle = circle_through(START, motion.via, motion.end)
    assert circle.angle == pytest.approx(abs(angle), abs=1e-6)
    assert circle.radius == pytest.approx(float(np.linalg.norm(flat)), rel=1e-6)
    assert circle.length == pytest.approx(circle.radius * circle.angle)
    assert circle.normal == pytest.approx(math.copysign(1.0, angle) * axis, abs=1e-6)
    assert (circle.centre - centre) @ (START.xyz - circle.centre) == pytest.approx(0.0, abs=1e-6)


def test_planes_turn_by_the_right_hand() -> None:
    quarter = math.pi / 2
    assert arc(Pose.at(1, 0, 0), quarter, centre=(0, 0, 0)).end.xyz == pytest.approx([0, 1, 0])
    assert arc(Pose.at(0, 1, 0), quarter, centre=(0, 0, 0), plane="yz").end.xyz == pytest.approx([0, 0, 1])
    assert arc(Pose.at(1, 0, 0), quarter, centre=(0, 0, 0), plane="xz").end.xyz == pytest.approx([0, 0, 1])
    along = arc(START, quarter, centre=(0.5, 0, 0.4), reference="path")
    assert along.end.angle_to(START) == pytest.approx(quarter)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: circ(VIA, VIA), CommandRejected, "via and end 0 m apart .give a point"),
        (lambda: circ(VIA, [1, 2, 3]), ShapeError, "end"),  # type: ignore[arg-type]
        (lambda: circ(VIA, END, orientation="sideways"), CommandRejected, "sideways"),
        (lambda: circ(VIA, END, orientation="ignore"), CommandRejected, "spline"),
        (
            lambda: circ(VIA, END, orientation="joint", reference="path"),
            CommandRejected,
            "has no reference",
        ),
        (lambda: lin(END, reference="tool"), CommandRejected, "'base', 'path', got 'tool'"),
        (lambda: circ(VIA, END, speed_mps=-1.0), LimitError, "speed_mps"),
        (lambda: circ(VIA, END, near=np.zeros(7), redundancy=Redundancy(0.1, 2)), CommandRejected, "near"),
        (lambda: arc(START, 6.28, centre=(0.5, 0, 0.4)), LimitError, "6.1"),
        (lambda: arc(START, 0.0, centre=(0.5, 0, 0.4)), CommandRejected, "no length"),
        (lambda: arc(START, 1.0, centre=START.xyz), CommandRejected, "no length"),
        (lambda: arc(START, 1.0, centre=(0, 0, 0), plane="zz"), CommandRejected, "zz"),
        (lambda: arc(START, 1.0, centre=(0, 0, 0), plane=(0, 0, 0)), ShapeError, "direction"),
        (lambda: arc(START, math.nan, centre=(0, 0, 0)), LimitError, "angle"),
    ],
)
def test_what_makes_no_arc_is_refused(make: object, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()  # type: ignore[operator]


#: Start, via and end that define no circle, the parameter that is refused, and words of the error.
NO_CIRCLES = {
    "start and via": ((0.1, 0, 0), (0.1, 0, 5e-6), (0.2, 0, 0), "via", "start and via .* m apart"),
    "via and end": ((0, 0, 0), (0.2, 0, 0), (0.2, 0, 0), "via", "via and end .* m apart"),
    "start and end": ((0, 0, 0), (0.2, 0, 0), (0, 0, 0), "end", "a full circle is two arcs"),
    "between": ((0, 0, 0), (0.1, 0, 0), (0.2, 0, 0), "via", "on a line"),
    "before": ((0, 0, 0), (-0.1, 0, 0), (0.2, 0, 0), "via", "on a line"),
    "almost": (
        (0, 0, 0),
        (0.1, 9e-6, 0),
        (0.2, 0, 0),
        "via",
        "on a line: .* beside the direction to the end, got 9",
    ),
}


@pytest.mark.parametrize("name", NO_CIRCLES)
def test_points_without_a_circle_are_refused(name: str) -> None:
    *points, parameter, words = NO_CIRCLES[name]
    with pytest.raises(CommandRejected, match=words) as refused:
        circle_through(*(Pose.at(*one) for one in points))
    assert refused.value.parameter == parameter and refused.value.allowed and refused.value.hint


def test_flat_arcs_are_arcs() -> None:
    circle = circle_through(Pose.at(), Pose.at(0.1, 2e-5), Pose.at(0.2))
    assert circle.radius == pytest.approx(250.0, rel=1e-3) and circle.length == pytest.approx(0.2, rel=1e-6)
