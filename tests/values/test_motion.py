"""Motions are values: checked when made, equal by their numbers, frozen."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.limits import Blending, CartesianDynamics, JointDynamics
from heptarm.values.motion import (
    BASE,
    Hold,
    Lin,
    LinRel,
    Motion,
    Ptp,
    PtpPose,
    hold,
    lin,
    lin_rel,
    ptp,
    ptp_home,
)
from heptarm.values.pose import Pose, deg
from heptarm.values.redundancy import Redundancy

Q = deg(0, 30, 0, -90, 0, 60, 0)
POSE = Pose.xyz_abc(0.5, 0.0, 0.3, *deg(180, 0, 180))
NAN = math.nan

MAKERS: list[Callable[[], Motion]] = [
    lambda: ptp(Q),
    lambda: ptp(Q, speed=0.2, acceleration=[0.1] * 7, jerk=1.0, blend_rel=0.1),
    lambda: ptp(POSE, near=Q),
    lambda: ptp_home(speed=0.3, blend_rel=0.2),
    lambda: ptp(POSE, redundancy=Redundancy(0.2, 2, 10), moving="flange"),
    lambda: lin(POSE, speed_mps=0.1, acceleration_mps2=1.0, jerk_mps3=10.0, near=Q),
    lambda: lin(POSE, speed_radps=0.5, joint_speed=0.3, blend_m=0.02, blend_rad=0.1),
    lambda: lin_rel(z=-0.1, frame=BASE, speed_mps=0.05),
    lambda: lin_rel(c=0.3),
    lambda: hold(2.0),
    hold,
]


@pytest.mark.parametrize("make", MAKERS)
def test_equal_hashed_and_pickled_by_value(make: Callable[[], Motion]) -> None:
    motion = make()
    assert motion == make()
    assert hash(motion) == hash(make())
    assert pickle.loads(pickle.dumps(motion)) == motion
    with pytest.raises(AttributeError):
        setattr(motion, fields(motion)[0].name, None)


def test_all_differ() -> None:
    motions = [make() for make in MAKERS]
    assert len(set(motions)) == len(motions)
    assert ptp(Q) != ptp(Q, speed=0.5)
    assert ptp(Q) != Q.tolist()


def test_types() -> None:
    assert isinstance(ptp(Q), Ptp)
    assert isinstance(ptp(POSE), PtpPose)
    assert isinstance(lin(POSE), Lin)
    assert isinstance(lin_rel(), LinRel)
    assert isinstance(hold(), Hold)


def test_what_is_not_given_keeps_the_default() -> None:
    motion = lin(POSE)
    assert motion.path == CartesianDynamics()
    assert motion.joints == JointDynamics()
    assert motion.blending == Blending()
    assert np.isnan(motion.joints.velocity).all()
    assert math.isnan(motion.path.velocity)
    assert motion.near is None


def test_arrays_are_copied_and_frozen() -> None:
    target = Q.copy()
    motion = ptp(target)
    target[0] = 1.0
    assert isinstance(motion, Ptp)
    assert motion.q[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        motion.q[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        motion.joints.velocity[0] = 1.0


def test_units_of_the_factories() -> None:
    motion = lin(
        POSE,
        speed_mps=1.0,
        acceleration_mps2=2.0,
        jerk_mps3=3.0,
        speed_radps=4.0,
        acceleration_radps2=5.0,
        jerk_radps3=6.0,
        joint_speed=0.1,
        joint_acceleration=0.2,
        joint_jerk=0.3,
        blend_rel=0.4,
        blend_m=0.5,
        blend_rad=0.6,
    )
    assert motion.path == CartesianDynamics(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert motion.blending == Blending(0.4, 0.5, 0.6)
    assert motion.joints.velocity.tolist() == [0.1] * 7
    assert motion.joints.acceleration.tolist() == [0.2] * 7
    assert motion.joints.jerk.tolist() == [0.3] * 7
    relative = lin_rel(1.0, 2.0, 3.0, 0.1, 0.2, 0.3, frame="table", moving="gripper", jerk_radps3=7.0)
    assert relative.offset == Pose.xyz_abc(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    assert (relative.frame, relative.moving, relative.path.orientation_jerk) == ("table", "gripper", 7.0)


@given(st.one_of(st.none(), st.floats(0.01, 1.0)), st.floats(0.01, 1.0))
def test_a_ceiling_only_slows_down(speed: float | None, ceiling: float) -> None:
    joints = (ptp(Q, speed=speed), ptp_home(speed=speed))
    for motion in (*joints, lin(POSE, joint_speed=speed), lin_rel(z=0.1, joint_speed=speed)):
        expected = ceiling if speed is None else min(speed, ceiling)
        limited = motion.under(ceiling)
        assert not isinstance(limited, Hold)
        if ceiling < 1.0:
            assert limited.joints.velocity.tolist() == [expected] * 7
        assert type(limited) is type(motion)
    assert hold(1.0).under(ceiling) == hold(1.0)


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: ptp([1, 2]), ShapeError, r"q has shape \(2,\); \(7,\) is wanted"),
        (lambda: ptp([[0.0] * 7]), ShapeError, r"q has shape \(1, 7\)"),
        (lambda: ptp("home"), ShapeError, "7 numbers are wanted"),
        (lambda: ptp(None), ShapeError, "7 numbers are wanted"),
        (lambda: ptp([None] * 7), ShapeError, "7 numbers are wanted"),
        (lambda: ptp([True] * 7), ShapeError, "7 numbers are wanted"),
        (lambda: ptp([0.0] * 6 + [NAN]), LimitError, r"q\[6\] is nan"),
        (lambda: ptp([math.inf] + [0.0] * 6), LimitError, r"q\[0\] is inf"),
        (lambda: ptp(Q, speed=0), LimitError, r"speed\[0\] is 0; allowed is \(0, 1\]"),
        (lambda: ptp(Q, speed=1.1), LimitError, r"speed\[0\] is 1.1; allowed is \(0, 1\]"),
        (lambda: ptp(Q, speed=NAN), LimitError, r"speed\[0\] is nan"),
        (lambda: ptp(Q, speed=[0.1] * 6), ShapeError, r"speed has shape \(6,\)"),
        (lambda: ptp(Q, acceleration=[0.1] * 6 + [2]), LimitError, r"acceleration\[6\] is 2"),
        (lambda: ptp(Q, jerk=-1), LimitError, r"jerk\[0\] is -1"),
        (lambda: ptp(Q, blend_rel=1.5), LimitError, r"blend_rel is 1.5; allowed is \[0, 1\]"),
        (lambda: ptp(Q, blend_m=-0.1), LimitError, r"blend_m is -0.1; allowed is \[0, 2\] m"),
        (lambda: ptp(Q, blend_rad="much"), ShapeError, "blend_rad is 'much'; one number is wanted"),
        (lambda: ptp(Q, near=Q), CommandRejected, "belong to a pose"),
        (lambda: ptp(Q, redundancy=Redundancy(0.1)), CommandRejected, "belong to a pose"),
        (lambda: ptp(Q, moving="flange"), CommandRejected, "belong to a pose"),
        (lambda: ptp(POSE, near=[0.0] * 3), ShapeError, r"near has shape \(3,\)"),
        (lambda: ptp(POSE, near=Q, redundancy=Redundancy(0.1)), CommandRejected, "give one of them"),
        (lambda: ptp(POSE, redundancy=0.3), ShapeError, "a Redundancy is wanted"),
        (lambda: lin(Q), ShapeError, r"a Pose is wanted .build one"),
        (lambda: lin(POSE, speed_mps=0), LimitError, r"speed_mps is 0; allowed is \(0, 10\] m/s"),
        (lambda: lin(POSE, speed_mps=NAN), LimitError, "speed_mps is nan"),
        (lambda: lin(POSE, speed_mps=math.inf), LimitError, "speed_mps is inf"),
        (lambda: lin(POSE, speed_mps=True), ShapeError, "one number is wanted"),
        (lambda: lin(POSE, acceleration_mps2=101), LimitError, "acceleration_mps2 is 101"),
        (lambda: lin(POSE, jerk_mps3=-1), LimitError, "jerk_mps3 is -1"),
        (lambda: lin(POSE, speed_radps=21), LimitError, r"speed_radps is 21; allowed is \(0, 20\] rad/s"),
        (lambda: lin(POSE, acceleration_radps2=201), LimitError, "acceleration_radps2 is 201"),
        (lambda: lin(POSE, jerk_radps3=2e5), LimitError, "jerk_radps3 is 200000"),
        (lambda: lin(POSE, moving=""), ShapeError, "moving is ''; the name of a frame is wanted"),
        (lambda: lin(POSE, moving="x" * 129), ShapeError, "up to 128 octets"),
        (lambda: lin(POSE, moving=3), ShapeError, "the name of a frame is wanted"),
        (lambda: lin_rel(z="down"), ShapeError, "6 numbers are wanted"),
        (lambda: lin_rel(z=NAN), LimitError, r"offset\[2\] is nan"),
        (lambda: lin_rel(frame=""), ShapeError, "frame is ''"),
        (lambda: LinRel(Q), ShapeError, "(?s)offset is .* a Pose is wanted"),
        (lambda: hold(0), LimitError, r"seconds is 0; allowed is \(0, 1e\+06\] s"),
        (lambda: hold(-1), LimitError, "seconds is -1"),
        (lambda: hold(NAN), LimitError, "seconds is nan"),
        (lambda: hold(2e6), LimitError, "seconds is 2e"),
        (lambda: hold("long"), ShapeError, "one number is wanted"),
        (lambda: ptp(Q).under(0.0), LimitError, r"speed is 0; allowed is \(0, 1\]"),
        (lambda: hold().under(2.0), LimitError, "speed is 2"),
        (lambda: CartesianDynamics(velocity=11.0), LimitError, "velocity is 11"),
        (lambda: JointDynamics(velocity=Q), LimitError, r"velocity\[0\] is 0"),
        (lambda: Blending(relative=2.0), LimitError, "relative is 2"),
        (lambda: Redundancy(math.inf), LimitError, "e1 is inf"),
        (lambda: Redundancy(status=8), LimitError, "status is 8; allowed is 0 to 7, or -1 for not given"),
        (lambda: Redundancy(status=-2), LimitError, "status is -2"),
        (lambda: Redundancy(turn=128), LimitError, "turn is 128"),
        (lambda: Redundancy(turn=1.5), LimitError, "turn is 1.5"),
    ],
)
def test_refuses_with_value_range_and_remedy(
    make: Callable[[], object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        make()
