"""Splines: values of segments and points, and refused members."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.motion.circle import circ
from heptarm.values.motion.line import lin
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import ellipse, spl, spline, spline_joints
from heptarm.values.pose import Pose, deg

A, B, C = Pose.at(0.6, 0.0, 0.4), Pose.at(0.65, 0.05, 0.4), Pose.at(0.6, 0.1, 0.4)
Q = deg(0, 30, 0, -90, 0, 60, 0)


def test_a_spline_is_a_value_and_a_pose_alone_is_a_curved_segment() -> None:
    motion = spline([A, spl(B, speed_mps=0.1, orientation="ignore"), lin(C), circ(B, A)], speed_mps=0.2)
    assert motion.segments[0] == spl(A) and motion.segments[1] != spl(B)
    assert motion == pickle.loads(pickle.dumps(motion)) and hash(motion) == hash(
        pickle.loads(pickle.dumps(motion))
    )
    assert motion.limited_to(0.3).dynamics.joint_speed.tolist() == [0.3] * 7
    assert motion.dynamics.speed_mps == 0.2 and math.isnan(motion.segments[0].dynamics.speed_mps)


def test_points_of_a_joint_spline_keep_their_own_speed_under_the_ceiling() -> None:
    motion = spline_joints([Q, ptp(Q + 0.1, speed=0.3), ptp(Q, acceleration=0.2)], speed=0.8)
    slow = motion.limited_to(0.5)
    assert [point.dynamics.joint_speed[0] for point in slow.points] == [0.5, 0.3, 0.5]
    assert slow.points[2].dynamics.joint_acceleration[0] == 0.2 and slow.dynamics.joint_speed[0] == 0.5
    assert motion == pickle.loads(pickle.dumps(motion))


@given(
    other=st.floats(0.01, 0.5),
    angle=st.floats(0.5, 12.0) | st.floats(-12.0, -0.5),
    normal=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1),
)
def test_the_points_of_an_ellipse_lie_on_it(other: float, angle: float, normal: tuple[float, ...]) -> None:
    axis, centre = np.array(normal) / np.linalg.norm(normal), np.array([0.5, 0.1, 0.3])
    lever = A.xyz - centre
    first = lever - (lever @ axis) * axis
    radius = float(np.linalg.norm(first))
    if radius < 1e-3:
        return
    motion = ellipse(A, other, centre=centre, plane=normal, angle=angle)
    across = np.cross(axis, first) / radius
    for segment in motion.segments:
        at = segment.target.xyz - centre
        assert at @ axis == pytest.approx(lever @ axis, abs=1e-9)
        assert (at @ first / radius**2) ** 2 + (at @ across / other) ** 2 == pytest.approx(1.0, abs=1e-9)
    end = motion.segments[-1].target.xyz - centre - (lever @ axis) * axis
    assert end == pytest.approx(math.cos(angle) * first + math.sin(angle) * other * across, abs=1e-9)
    assert len(motion.segments) == round(abs(angle) / (2 * math.pi) * 36)


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: spline([]), ShapeError, "1 to 1000"),
        (lambda: spline("AB"), ShapeError, "list"),  # type: ignore[arg-type]
        (lambda: spline([A] * 1001), ShapeError, "1000"),
        (lambda: spline([A, ptp(Q)]), ShapeError, r"segments\[1\]"),  # type: ignore[list-item]
        (lambda: spline([lin(A, blend_m=0.1)]), CommandRejected, "blending"),
        (lambda: spline([lin(A, joint_speed=0.1)]), CommandRejected, "joint limits"),
        (lambda: spline([lin(A, near=Q)]), CommandRejected, "near"),
        (lambda: spline([lin(A, moving="flange")]), CommandRejected, "moving"),
        (lambda: spline([A], moving=""), ShapeError, "moving"),
        (lambda: spline([A], speed_mps=math.nan), LimitError, "speed_mps"),
        (lambda: spl([1, 2, 3]), ShapeError, "pose"),  # type: ignore[arg-type]
        (lambda: spl(A, orientation="sideways"), CommandRejected, "sideways"),
        (lambda: spline_joints([]), ShapeError, "points"),
        (lambda: spline_joints([Q, [1, 2]]), ShapeError, r"points\[1\]"),
        (lambda: spline_joints([ptp(Q, blend_rel=0.2)]), CommandRejected, "blending"),
        (lambda: spline_joints([Q], speed=1.5), LimitError, "speed"),
        (lambda: ellipse(A, 0.0, centre=(0.5, 0, 0.4)), LimitError, "other"),
        (lambda: ellipse(A, 0.1, centre=A.xyz), CommandRejected, "no length"),
        (lambda: ellipse(A, 0.1, centre=(0.5, 0, 0.4), angle=0.0), CommandRejected, "no length"),
        (lambda: ellipse(A, 0.1, centre=(0.5, 0, 0.4), points=5), LimitError, r"\[12, 360\], got 5"),
        (lambda: ellipse(A, 0.1, centre=(0.5, 0, 0.4), plane="zz"), CommandRejected, "zz"),
    ],
)
def test_what_makes_no_spline_is_refused(make: object, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()  # type: ignore[operator]
