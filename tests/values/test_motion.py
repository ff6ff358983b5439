"""Motions are values: checked when created, equal by their numbers, frozen."""

from __future__ import annotations

import inspect
import math
import pickle
from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.frames import BASE
from heptarm.values.motion.circle import circ
from heptarm.values.motion.dynamics import Blending, Dynamics
from heptarm.values.motion.line import Lin, LinRel, lin, lin_rel
from heptarm.values.motion.motion import Hold, Motion, hold
from heptarm.values.motion.ptp import Ptp, PtpPose, ptp, ptp_home, ptp_transport
from heptarm.values.motion.spline import spl, spline, spline_joints
from heptarm.values.pose import PartialPose, Pose, Redundancy, deg
from heptarm.values.robot import robot

Q = deg(0, 30, 0, -90, 0, 60, 0)
POSE = Pose.xyz_abc(0.5, 0.0, 0.3, *deg(180, 0, 180))
NAN = math.nan

MAKERS: list[Callable[[], Motion]] = [
    lambda: ptp(Q),
    lambda: ptp(Q, speed=0.2, acceleration=[0.1] * 7, jerk=1.0, blend_rel=0.1),
    lambda: ptp(POSE, near=Q),
    lambda: ptp_home(speed=0.3, blend_rel=0.2),
    lambda: ptp_transport(speed=0.3, blend_rel=0.2),
    lambda: ptp(POSE, redundancy=Redundancy(0.2, 2, 10), moving="flange"),
    lambda: lin(PartialPose(z=0.3, a=0.1), frame=POSE),
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


def test_the_transport_position_is_folded() -> None:
    assert np.degrees(ptp_transport().q) == pytest.approx([0, 25, 0, 90, 0, 0, 0])


def test_nan_keeps_a_joint() -> None:
    motion = ptp([NAN] * 6 + [0.3])
    assert isinstance(motion, Ptp) and motion.keeps and motion.q[6] == 0.3 and not ptp(Q).keeps


def test_what_is_not_given_keeps_the_default() -> None:
    motion = lin(POSE)
    assert motion.dynamics == Dynamics()
    assert motion.blending == Blending()
    assert np.isnan(motion.dynamics.joint_speed).all()
    assert math.isnan(motion.dynamics.speed_mps)
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
        motion.dynamics.joint_speed[0] = 1.0


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
    dynamics = motion.dynamics
    assert (dynamics.speed_mps, dynamics.acceleration_mps2, dynamics.jerk_mps3) == (1.0, 2.0, 3.0)
    assert (dynamics.speed_radps, dynamics.acceleration_radps2, dynamics.jerk_radps3) == (4.0, 5.0, 6.0)
    assert motion.blending == Blending(0.4, 0.5, 0.6)
    assert motion.dynamics.joint_speed.tolist() == [0.1] * 7
    assert motion.dynamics.joint_acceleration.tolist() == [0.2] * 7
    assert motion.dynamics.joint_jerk.tolist() == [0.3] * 7
    relative = lin_rel(1.0, 2.0, 3.0, 0.1, 0.2, 0.3, frame="table", moving="gripper", jerk_radps3=7.0)
    assert relative.offset == Pose.xyz_abc(1.0, 2.0, 3.0, 0.1, 0.2, 0.3)
    assert (relative.frame, relative.moving, relative.dynamics.jerk_radps3) == ("table", "gripper", 7.0)


@given(st.one_of(st.none(), st.floats(0.01, 1.0)), st.floats(0.01, 1.0))
def test_a_ceiling_only_slows_down(speed: float | None, ceiling: float) -> None:
    joints = (ptp(Q, speed=speed), ptp_home(speed=speed))
    for motion in (*joints, lin(POSE, joint_speed=speed), lin_rel(z=0.1, joint_speed=speed)):
        expected = ceiling if speed is None else min(speed, ceiling)
        limited = motion.limited_to(ceiling)
        assert not isinstance(limited, Hold)
        if ceiling < 1.0:
            assert limited.dynamics.joint_speed.tolist() == [expected] * 7
        assert type(limited) is type(motion)
    assert hold(1.0).limited_to(ceiling) == hold(1.0)


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: ptp([1, 2]), ShapeError, r"q must have shape \(7,\), got \(2,\)"),
        (lambda: ptp([[0.0] * 7]), ShapeError, r"q must have shape .*got \(1, 7\)"),
        (lambda: ptp("home"), ShapeError, "must be 7 numbers"),
        (lambda: ptp(None), ShapeError, "must be 7 numbers"),  # type: ignore[arg-type]
        (lambda: ptp([None] * 7), ShapeError, "must be 7 numbers"),  # type: ignore[arg-type]
        (lambda: ptp([True] * 7), ShapeError, "must be 7 numbers"),
        (lambda: ptp([NAN] * 7), LimitError, "q must have .* one joint at least"),
        (lambda: spline_joints([[0.0] * 6 + [NAN]]), LimitError, r"points\[0\]\[6\] must .*got nan"),
        (lambda: spline_joints([ptp([0.0] * 6 + [NAN])]), LimitError, r"points\[0\]\[6\] must .*got nan"),
        (lambda: ptp([math.inf] + [0.0] * 6), LimitError, r"q\[0\] must .*got inf"),
        (lambda: ptp(Q, speed=0), LimitError, r"speed must be in \(0, 1\], got 0"),
        (lambda: ptp(Q, speed=1.1), LimitError, r"speed must be in \(0, 1\], got 1.1"),
        (lambda: ptp(Q, speed=NAN), LimitError, r"speed\[0\] must .*got nan"),
        (lambda: ptp(Q, speed=[0.1] * 6), ShapeError, r"speed must have shape .*got \(6,\)"),
        (lambda: ptp(Q, acceleration=[0.1] * 6 + [2]), LimitError, r"acceleration\[6\] must .*got 2"),
        (lambda: ptp(Q, jerk=-1), LimitError, r"jerk must .*got -1"),
        (lambda: ptp(Q, blend_rel=1.5), LimitError, r"blend_rel must be in \[0, 1\], got 1.5"),
        (lambda: ptp(Q, blend_m=-0.1), LimitError, r"blend_m must be in \[0, 2\] m, got -0.1"),
        (lambda: ptp(Q, blend_rad="much"), ShapeError, "blend_rad must be a number, got 'much'"),  # type: ignore[arg-type]
        (lambda: ptp(Q, near=Q), CommandRejected, "near given with joint positions"),
        (lambda: ptp(Q, redundancy=Redundancy(0.1)), CommandRejected, "leave no choice"),
        (lambda: ptp(Q, moving="flange"), CommandRejected, "leave no choice"),
        (lambda: ptp(POSE, near=[0.0] * 3), ShapeError, r"near must have shape .*got \(3,\)"),
        (lambda: ptp(POSE, near=Q, redundancy=Redundancy(0.1)), CommandRejected, "give one of them"),
        (lambda: ptp(POSE, redundancy=0.3), ShapeError, "must be a Redundancy"),  # type: ignore[arg-type]
        (lambda: lin(Q), ShapeError, r"(?s)must be a Pose.*build one"),  # type: ignore[arg-type]
        (lambda: lin(POSE, speed_mps=0), LimitError, r"speed_mps must be in \(0, 10\] m/s, got 0"),
        (lambda: lin(POSE, speed_mps=NAN), LimitError, "speed_mps must .*got nan"),
        (lambda: lin(POSE, speed_mps=math.inf), LimitError, "speed_mps must .*got inf"),
        (lambda: lin(POSE, speed_mps=True), ShapeError, "must be a number"),
        (lambda: lin(POSE, acceleration_mps2=101), LimitError, "acceleration_mps2 must .*got 101"),
        (lambda: lin(POSE, jerk_mps3=-1), LimitError, "jerk_mps3 must .*got -1"),
        (lambda: lin(POSE, speed_radps=21), LimitError, r"speed_radps must be in \(0, 20\] rad/s, got 21"),
        (lambda: lin(POSE, acceleration_radps2=201), LimitError, "acceleration_radps2 must .*got 201"),
        (lambda: lin(POSE, jerk_radps3=2e5), LimitError, "jerk_radps3 must .*got 200000"),
        (lambda: lin(POSE, moving=""), ShapeError, "moving must be a name of 1 to 128 bytes, got ''"),
        (lambda: lin(POSE, moving="x" * 129), ShapeError, "1 to 128 bytes"),
        (lambda: lin(POSE, moving=3), ShapeError, "must be a name"),  # type: ignore[arg-type]
        (lambda: lin_rel(z="down"), ShapeError, "must be 6 numbers"),  # type: ignore[arg-type]
        (lambda: lin_rel(z=NAN), LimitError, r"offset\[2\] must .*got nan"),
        (lambda: lin_rel(frame=""), ShapeError, "frame must be a name .*got ''"),
        (lambda: LinRel(Q), ShapeError, "offset must be a Pose"),  # type: ignore[arg-type]
        (lambda: hold(0), LimitError, r"seconds must be in \(0, 1e\+06\] s, got 0"),
        (lambda: hold(-1), LimitError, "seconds must .*got -1"),
        (lambda: hold(NAN), LimitError, "seconds must .*got nan"),
        (lambda: hold(2e6), LimitError, "seconds must .*got 2e"),
        (lambda: hold("long"), ShapeError, "must be a number"),  # type: ignore[arg-type]
        (lambda: ptp(Q).limited_to(0.0), LimitError, r"speed must be in \(0, 1\], got 0"),
        (lambda: hold().limited_to(2.0), LimitError, "speed must .*got 2"),
        (lambda: Dynamics(speed_mps=11.0), LimitError, "speed_mps must .*got 11"),
        (lambda: Dynamics(joint_speed=Q), LimitError, r"joint_speed\[0\] must .*got 0"),
        (lambda: Blending(relative=2.0), LimitError, "relative must .*got 2"),
        (PartialPose, LimitError, "one coordinate at least"),
        (lambda: PartialPose(z=math.inf), LimitError, "z must be finite"),
        (lambda: PartialPose(a=90.0), LimitError, "a must be in .*got 90 rad"),
        (lambda: PartialPose(z="up"), ShapeError, "z must be a number"),  # type: ignore[arg-type]
        (lambda: PartialPose(z=0.3).completed(Q), ShapeError, "start must be a Pose"),  # type: ignore[arg-type]
        (lambda: circ(POSE, PartialPose(z=0.3)), ShapeError, "end must be a Pose"),  # type: ignore[arg-type]
        (lambda: spline([lin(PartialPose(z=0.3))]), CommandRejected, "has a partial target of its own"),
        (lambda: Redundancy(math.inf), LimitError, "e1 must .*got inf"),
        (lambda: Redundancy(e1=math.nan), LimitError, "e1 must .*got nan"),
        (lambda: Redundancy(e1=np.float64(np.nan)), LimitError, "e1 must .*got nan"),
        (lambda: Redundancy(status=8), LimitError, "status must be 0 to 7, or -1 for not given, got 8"),
        (lambda: Redundancy(status=-2), LimitError, "status must .*got -2"),
        (lambda: Redundancy(turn=128), LimitError, "turn must .*got 128"),
        (lambda: Redundancy(turn=1.5), LimitError, "turn must .*got 1.5"),  # type: ignore[arg-type]
    ],
)
def test_refuses_with_value_range_and_remedy(
    make: Callable[[], object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        make()


DYNAMICS = Dynamics(speed_mps=0.1, joint_speed=0.3)


def test_dynamics_are_shared_and_keywords_go_before_them() -> None:
    assert lin(POSE, dynamics=DYNAMICS) == lin(POSE, speed_mps=0.1, joint_speed=0.3)
    assert lin(POSE, dynamics=DYNAMICS, speed_mps=0.2).dynamics == Dynamics(speed_mps=0.2, joint_speed=0.3)
    assert ptp(Q, dynamics=Dynamics(joint_speed=0.4), jerk=0.5).dynamics == Dynamics(
        joint_speed=0.4, joint_jerk=0.5
    )
    assert list(DYNAMICS.given()) == ["speed_mps", "joint_speed"]


def test_help_lists_every_keyword() -> None:
    names = list(inspect.signature(lin).parameters)
    assert names[:2] == ["pose", "near"] and {"dynamics", "speed_mps", "joint_jerk", "blend_rad"} <= set(
        names
    )
    assert (
        "speed" in inspect.signature(ptp).parameters and "speed_mps" not in inspect.signature(ptp).parameters
    )


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (
            lambda: ptp(Q, dynamics=DYNAMICS),
            CommandRejected,
            "dynamics has speed_mps, which ptp does not have",
        ),
        (lambda: spl(POSE, dynamics=DYNAMICS), CommandRejected, "joint_speed, which spl does not have"),
        (lambda: lin(POSE, dynamics=0.3), ShapeError, "dynamics must be a Dynamics, got 0.3"),  # type: ignore[arg-type]
        (lambda: lin(POSE, speed=0.3), TypeError, "unexpected keyword argument 'speed'; .*speed_mps"),  # type: ignore[call-arg]
        (lambda: ptp(Q, speed_mps=0.3), TypeError, "unexpected keyword argument 'speed_mps'"),  # type: ignore[call-arg]
        (lambda: Dynamics(speed=0.3), TypeError, "unexpected keyword argument 'speed'"),  # type: ignore[call-arg]
    ],
)
def test_limits_that_a_motion_does_not_have_are_refused(
    make: Callable[[], object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        make()


def test_the_repr_leaves_out_what_is_at_its_default() -> None:
    assert repr(ptp(Q)) == f"Ptp(q={ptp(Q).q!r})"
    assert repr(ptp(Q, speed=0.5).dynamics) == f"Dynamics(joint_speed={np.full(7, 0.5)!r})"
    assert repr(Dynamics()) == "Dynamics()"


def test_a_percentage_is_distinguished_from_a_fraction() -> None:
    with pytest.raises(
        LimitError, match=r"speed must be in \(0, 1\], got 50 \(it is a fraction: did you mean 0.5\?"
    ):
        ptp(Q, speed=50)


def test_the_longest_time_of_a_motion_is_a_whole_range_of_each_joint_with_its_ramps() -> None:
    iiwa = robot("iiwa14")
    ranges, faster, harder = iiwa.q_max - iiwa.q_min, iiwa.dq_max / iiwa.ddq_max, iiwa.ddq_max / iiwa.dddq_max
    whole = ranges / iiwa.dq_max + faster + harder
    assert Dynamics().turn_time(iiwa) == pytest.approx(whole.max())
    slow = Dynamics(joint_speed=0.5, joint_acceleration=0.5, joint_jerk=0.25)
    longest = ranges / (0.5 * iiwa.dq_max) + faster + 4.0 * harder
    assert slow.turn_time(iiwa) == pytest.approx(longest.max())
