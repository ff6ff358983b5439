"""Targets in a frame other than the base: by its name, or by its pose."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable

import numpy as np
import pytest

import heptarm as ha
from heptarm.arm.translate.motions import in_base, item
from heptarm.errors import CommandRejected, ShapeError
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot

TABLE = Pose.xyz_abc(0.5, 0.1, 0.1, *deg(90, 0, 0))
VIA, END = Pose.at(0.1, 0.05, 0.2), Pose.xyz_abc(0.0, 0.1, 0.2, *deg(0, 0, 180))
FRAMES = {"/Table": TABLE}
#: Motions, by a function of the frame in which their poses are.
MADE: dict[str, Callable[..., Motion]] = {
    "lin": lambda to, **how: ha.lin(to(END), **how),
    "ptp": lambda to, **how: ha.ptp(to(END), **how),
    "circ": lambda to, **how: ha.circ(to(VIA), to(END), **how),
    "spline": lambda to, **how: ha.spline(
        [to(VIA), ha.spl(to(END)), ha.lin(to(VIA)), ha.circ(to(END), to(VIA @ VIA))], **how
    ),
}


@pytest.mark.parametrize("name", MADE)
def test_a_name_and_a_pose_mean_the_same_as_poses_in_the_base(name: str) -> None:
    make = MADE[name]
    there = make(lambda pose: TABLE @ pose)
    named = make(lambda pose: pose, frame="/Table")
    assert make(lambda pose: pose, frame=TABLE) == there == in_base(named, FRAMES)
    assert named != there and pickle.loads(pickle.dumps(named)) == named and "/Table" in str(named)
    assert in_base(there, {}) is there and make(lambda pose: pose, frame="base") == make(lambda pose: pose)
    limited = named.limited_to(0.3)
    assert in_base(limited, FRAMES) == there.limited_to(0.3)


def test_an_offset_in_the_axes_of_a_pose_is_that_in_its_axes() -> None:
    start, offset = Pose.xyz_abc(0.4, -0.2, 0.5, *deg(20, 30, 150)), (0.1, 0.02, -0.05, *deg(10, -20, 30))
    own = ha.lin_rel(*offset, frame=start.shifted(1.0, 2.0, 3.0))  # where its origin is does not count
    assert own.frame == "base"
    reached = Pose.of(start.xyz + own.offset.xyz, (own.offset @ Pose.of(np.zeros(3), start.quat)).quat)
    assert reached.distance_to(start @ Pose.xyz_abc(*offset)) < 1e-12
    assert reached.angle_to(start @ Pose.xyz_abc(*offset)) < 1e-7


def test_arcs_and_ellipses_lie_in_the_frame() -> None:
    start = Pose.at(0.1, 0.0, 0.2)
    quarter = ha.arc(start, math.pi / 2, centre=(0, 0, 0.2), frame=TABLE)
    assert quarter.end.xyz == pytest.approx(TABLE.rotation @ (0.0, 0.1, 0.2) + TABLE.xyz)
    whole = ha.ellipse(start, 0.05, centre=(0, 0, 0.2), plane="xz", frame="/Table")
    flat = np.array(
        [segment.target.y for segment in whole.segments if isinstance(segment, type(ha.spl(start)))]
    )
    assert whole.frame == "/Table" and flat == pytest.approx(np.zeros(36), abs=1e-12)


@pytest.mark.parametrize("name", MADE)
def test_a_message_never_has_poses_in_another_frame(name: str) -> None:
    motion = MADE[name](lambda pose: pose, frame="/Table")
    for unknown in (lambda: in_base(motion, {}), lambda: item(motion, robot("iiwa14"))):
        with pytest.raises(
            CommandRejected, match=r"frame of a target must be one of base, got '/Table' .*lin_rel"
        ):
            unknown()


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: ha.lin(END, frame=3), ShapeError, "frame must be a name"),  # type: ignore[arg-type]
        (lambda: ha.lin(END, frame=""), ShapeError, "frame must be a name"),
        (lambda: ha.lin(None, frame=TABLE), ShapeError, "pose must be a Pose"),  # type: ignore[arg-type]
        (lambda: ha.ptp([0.0] * 7, frame="/Table"), CommandRejected, "frame given with joint positions"),
        (lambda: ha.ptp([0.0] * 7, frame=TABLE), CommandRejected, "frame given with joint positions"),
        (lambda: ha.spline([ha.lin(END, frame="/Table")]), CommandRejected, "frame of its own"),
    ],
)
def test_what_is_no_frame_is_refused(make: Callable[[], object], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        make()
