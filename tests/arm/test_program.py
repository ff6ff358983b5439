"""From motions to the wire."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from math import isnan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import heptarm as ha
from heptarm.arm.motion.program_request import ProgramTerms, is_endless, listed, longest
from heptarm.arm.translate.motions import item as item_of
from heptarm.errors import inside
from heptarm.model.inverse_kinematics import redundancy
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot
from heptarm.wire import messages as wire

ROBOT = robot("iiwa14")
POSE = Pose.xyz_abc(0.5, 0.1, 0.4, *deg(180, 0, 180))


def one(motion: Motion, speed: float = 1.0) -> wire.Item:
    item = item_of(motion, ROBOT, speed=speed)
    item._check("")
    return item


def test_joint_targets() -> None:
    item = one(ptp(deg(0, 10, 20, 30, 40, 50, 60), speed=0.4, blend_rel=0.5), 0.3)
    assert isinstance(item.motion, wire.Ptp) and item.frame == ""
    assert item.motion.q == pytest.approx(np.radians(np.arange(0, 70, 10)))
    assert item.motion.dynamics.velocity == (0.3,) * 7 and isnan(item.motion.dynamics.jerk[0])
    assert item.motion.blending.relative == 0.5


def test_poses_with_what_decides_between_arm_positions() -> None:
    near = deg(10, 20, 5, -60, 5, 50, 5)
    item = one(ptp(POSE, near=near, moving="gripper/tip"))
    assert isinstance(item.motion, wire.PtpPose) and item.frame == "gripper/tip"
    wanted = redundancy(ROBOT, near.tolist())
    assert (item.motion.redundancy.e1, item.motion.redundancy.status) == (wanted.e1, wanted.status)
    item = one(lin(POSE, redundancy=ha.Redundancy(e1=0.3, status=2)))
    assert isinstance(item.motion, wire.Lin)
    assert (item.motion.redundancy.e1, item.motion.redundancy.status, item.motion.redundancy.turn) == (
        0.3,
        2,
        -1,
    )
    item = one(lin(POSE))
    assert isinstance(item.motion, wire.Lin) and isnan(item.motion.redundancy.e1)
    assert item.motion.target.xyz == (0.5, 0.1, 0.4)


def test_relative_lines() -> None:
    item = one(lin_rel(z=0.1, frame="base", speed_mps=0.05, joint_speed=0.9), 0.5)
    assert isinstance(item.motion, wire.LinRel) and item.motion.reference == "base"
    assert item.motion.offset.xyz == (0.0, 0.0, 0.1)
    assert item.motion.dynamics.velocity == 0.05 and item.motion.joints.velocity == (0.5,) * 7
    relative = one(lin_rel(z=0.1)).motion
    assert isinstance(relative, wire.LinRel) and relative.reference == ""


def test_holds() -> None:
    item = one(hold(2.5))
    assert isinstance(item.motion, wire.Hold) and item.motion.duration == 2.5
    endless = one(hold()).motion
    assert isinstance(endless, wire.Hold) and isnan(endless.duration)
    assert is_endless([hold()], ROBOT) and not is_endless([hold(1.0), ptp(np.zeros(7))], ROBOT)


def test_limits_of_the_connected_robot() -> None:
    with pytest.raises(ha.LimitError, match="A4"):
        one(ptp(deg(0, 0, 0, 121, 0, 0, 0)))
    with pytest.raises(ha.LimitError, match="near|A6"):
        one(ptp(POSE, near=deg(0, 0, 0, 0, 0, 130, 0)))


def test_the_longest_time_is_generous_but_finite() -> None:
    slow, fast = (longest([ptp(np.zeros(7), speed=s)], ROBOT, 1.0) for s in (0.01, 1.0))
    assert 15 < fast < 60 < slow < 10_000
    assert longest([ptp(np.zeros(7))], ROBOT, 0.01) == pytest.approx(slow)
    assert longest([lin_rel(z=0.1, speed_mps=0.001)], ROBOT, 1.0) > 3000
    assert longest([hold(10.0)], ROBOT, 1.0) == pytest.approx(45.0)
    assert longest([hold()], ROBOT, 1.0) == float("inf")


def test_lists() -> None:
    motion = ptp(np.zeros(7))
    assert listed(motion) == (motion,) and listed([motion, motion]) == (motion, motion)
    for wrong in ([], "ptp", [motion, 3], None, [motion] * 1001):
        with pytest.raises(ha.ShapeError):
            listed(wrong)  # type: ignore[arg-type]


fraction = st.floats(0.001, 1.0)
maybe = st.none() | fraction
axes = st.tuples(*(st.floats(float(a), float(b)) for a, b in zip(ROBOT.q_min, ROBOT.q_max, strict=True)))
angles = st.floats(-6.28, 6.28)
poses = st.builds(Pose.xyz_abc, *[st.floats(-1.5, 1.5)] * 3, *[angles] * 3)
motions = st.one_of(
    st.builds(
        ptp,
        axes,
        speed=maybe,
        acceleration=maybe,
        jerk=maybe,
        blend_rel=st.floats(0, 1),
        blend_m=st.floats(0, 2),
    ),
    st.builds(ptp, poses, near=st.none() | axes, speed=maybe),
    st.builds(lin, poses, speed_mps=maybe, speed_radps=maybe, joint_speed=maybe, blend_rad=st.floats(0, 6.3)),
    st.builds(
        lin_rel,
        *[st.floats(-1, 1)] * 3,
        *[angles] * 3,
        jerk_mps3=maybe,
        frame=st.sampled_from(["tool", "base"]),
    ),
    st.builds(hold, st.floats(0.001, 1e6)),
)


@given(st.lists(motions, min_size=1, max_size=4), fraction)
def test_whatever_the_values_allow_the_protocol_carries(program: list[Motion], speed: float) -> None:
    run = wire.Run(items=tuple(item_of(motion, ROBOT, speed=speed) for motion in program))
    run.validate()
    assert len(run.items) == len(wire.Run.decode(run.encode()).items) == len(program)
    for item in run.items:
        limits = getattr(
            item.motion, "dynamics" if isinstance(item.motion, wire.Ptp | wire.PtpPose) else "joints", None
        )
        if limits is not None:
            assert all(v <= speed or (speed == 1.0 and isnan(v)) for v in limits.velocity)
    assert longest(program, ROBOT, speed) > 0


def test_arcs_and_how_the_orientation_is_led() -> None:
    via, end = Pose.at(0.55, 0.1, 0.4), Pose.xyz_abc(0.5, 0.2, 0.4, *deg(180, 0, 180))
    item = one(
        ha.circ(via, end, near=deg(0, 30, 0, -90, 0, 60, 0), blend_m=0.02, orientation="constant"), 0.5
    )
    assert isinstance(item.motion, wire.Circ)
    assert item.motion.via.xyz == (0.55, 0.1, 0.4) and item.motion.end.xyz == (0.5, 0.2, 0.4)
    assert item.motion.orientation.type is wire.OrientationType.CONSTANT
    assert item.motion.blending.distance == 0.02 and item.motion.joints.velocity == (0.5,) * 7
    along = one(ha.circ(via, end, reference="path")).motion
    assert isinstance(along, wire.Circ) and along.orientation.reference is wire.OrientationReference.PATH
    joint = one(lin(POSE, orientation="joint")).motion
    assert isinstance(joint, wire.Lin) and joint.orientation.type is wire.OrientationType.JOINT
    assert longest([ha.circ(via, end, speed_mps=0.01)], ROBOT, 1.0) > 1800


def test_arcs_and_splines_reach_the_wire_whole() -> None:
    via, end = Pose.at(0.5, 0.15, 0.4), Pose.at(0.5, 0.2, 0.35)
    arc = one(ha.circ(via, end, orientation="constant", reference="path", blend_m=0.02)).motion
    assert isinstance(arc, wire.Circ) and arc.via.xyz == (0.5, 0.15, 0.4) and arc.blending.distance == 0.02
    assert arc.orientation == wire.Orientation(
        type=wire.OrientationType.CONSTANT, reference=wire.OrientationReference.PATH
    )
    curve = ha.spline(
        [POSE, ha.spl(via, orientation="ignore", speed_mps=0.1), lin(end), ha.circ(via, POSE)],
        moving="flange",
        speed_mps=0.2,
        joint_speed=0.9,
    )
    item = one(curve, 0.5)
    assert isinstance(item.motion, wire.Spline) and item.frame == "flange"
    kinds = [type(segment) for segment in item.motion.segments]
    assert kinds == [wire.SplSegment, wire.SplSegment, wire.LinSegment, wire.CircSegment]
    assert item.motion.segments[1].dynamics.velocity == 0.1
    assert item.motion.segments[1].orientation.type == wire.OrientationType.IGNORE
    assert item.motion.dynamics.velocity == 0.2 and item.motion.joints.velocity == (0.5,) * 7
    joints = one(ha.spline_joints([np.zeros(7), ptp(np.full(7, 0.1), speed=0.2)]), 0.5).motion
    assert isinstance(joints, wire.JointSpline)
    assert [point.dynamics.velocity[0] for point in joints.points] == [0.5, 0.2]
    with pytest.raises(ha.LimitError, match=r"A2"):
        one(ha.spline_joints([np.zeros(7), deg(0, 121, 0, 0, 0, 0, 0)]))
    assert 15 < longest([curve], ROBOT, 1.0) < longest([curve], ROBOT, 0.01)
    assert 15 < longest([ha.spline_joints([np.zeros(7)] * 3)], ROBOT, 1.0) < 200


@pytest.mark.parametrize(
    ("terms", "error", "text"),
    [
        ({"speed": 0.0}, ha.LimitError, r"speed must be in \(0, 1\], got 0"),
        ({"speed": 1.5}, ha.LimitError, r"speed must be in \(0, 1\], got 1.5"),
        ({"mode": "position"}, ha.ShapeError, "mode must be"),
        ({"until": 3.0}, ha.ShapeError, "until must be"),
        ({"then": "jump"}, ha.HeptarmError, "then must be"),
        ({"when": "now"}, ha.ShapeError, "when must be one of 'queue', 'replace', 'reject', got 'now'"),
    ],
)
def test_terms_are_checked_where_they_are_made(
    terms: dict[str, Any], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        ProgramTerms(**terms)


def test_terms_are_one_value() -> None:
    terms = ProgramTerms(speed=0.3, when="replace")
    assert (terms.mode, terms.until, terms.then, terms.breaks) == (None, None, "stay", ())
    with pytest.raises(FrozenInstanceError):
        terms.speed = 1.0  # type: ignore[misc]


def test_a_refused_element_is_named_in_text_and_parameter() -> None:
    far = Pose.at(9.0, 0.0, 0.5)
    line = ha.spline([ha.spl(POSE)] * 30 + [ha.spl(far)] + [ha.spl(POSE)])
    with pytest.raises(ha.LimitError, match=r"^segments\[30\]: target\.x must") as error:
        one(line)
    assert error.value.parameter == "segments[30].target.x"
    with (
        pytest.raises(ha.LimitError, match=r"^motions\[1\]\.segments\[30\]: target\.x must") as error,
        inside("motions[1]"),
    ):
        one(line)
    assert error.value.parameter == "motions[1].segments[30].target.x"
    joints = ha.spline_joints([np.zeros(7)] * 3 + [deg(0, 0, 0, 121, 0, 0, 0)])
    with pytest.raises(ha.LimitError, match=r"^points\[3\]: .*A4") as error:
        one(joints)
    assert error.value.parameter.startswith("points[3].q")
