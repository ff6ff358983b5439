"""A program that is looked ahead: the controller's own plans, one after the other, as the cabinet groups them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import heptarm as ha
from heptarm import model
from heptarm.arm.translate.motions import item
from heptarm.planning.lookahead import FramesOfArm, PlannedProgram, look_ahead
from heptarm.values.checks import Array
from heptarm.values.motion.motion import Motion
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import robot

IIWA = robot("iiwa14")
HOME = deg(0, 30, 0, -90, 0, 60, 0)
TIP = Pose.xyz_abc(0.02, 0.0, 0.15, 0.0, 0.4, 0.0)
START = Pose.from_matrix(model.forward(IIWA, HOME)) @ TIP
FRAMES = FramesOfArm(
    lambda name: TIP if name == "tool" else Pose.at(), lambda name: Pose.at() if name == "base" else None
)


def ahead(*motions: Motion, step: float = 0.01) -> PlannedProgram:
    return look_ahead(IIWA, HOME, [item(motion, IIWA) for motion in motions], FRAMES, step=step)


def places(program: PlannedProgram) -> Array:
    return np.array([(Pose.from_matrix(model.forward(IIWA, q)) @ TIP).xyz for q in program.q])


def moved(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Pose:
    return Pose(START.xyz + [x, y, z], START.quat)


@pytest.mark.parametrize(
    "motion",
    [
        ha.ptp(deg(20, 40, 0, -80, 0, 60, 10)),
        ha.ptp(moved(y=0.1)),
        ha.lin(moved(y=0.1)),
        ha.lin_rel(x=0.05, z=-0.05, a=0.3),
        ha.lin_rel(y=0.1, frame="base"),
        ha.lin_rel(y=0.1, frame="flange"),
        ha.circ(moved(x=-0.05, y=0.05), moved(x=-0.1)),
        ha.spline([moved(y=0.1), ha.lin(moved(x=-0.1, y=0.1))], speed_mps=0.2),
        ha.spline_joints([deg(10, 30, 0, -90, 0, 60, 0), deg(20, 30, 0, -90, 0, 60, 0)], speed=0.5),
        ha.ptp_home(),
    ],
    ids=lambda motion: type(motion).__name__,
)
def test_a_motion_keeps_all_limits_from_rest_to_rest(motion: Motion) -> None:
    program = ahead(motion)
    assert program.q[0] == pytest.approx(HOME, abs=1e-9) and program.t[0] == 0.0
    assert np.diff(program.t).max() <= 0.01 + 1e-9 and np.diff(program.t).min() > 0.0
    assert not program.dq[[0, -1]].any()
    assert np.abs(program.dq / IIWA.dq_max).max() < 1.01
    assert np.abs(program.ddq / IIWA.ddq_max).max() < 1.03
    integrated = np.cumsum(0.5 * (program.dq[1:] + program.dq[:-1]) * np.diff(program.t)[:, None], axis=0)
    assert program.q[1:] - HOME == pytest.approx(integrated, abs=2e-3)


def test_the_axes_of_a_relative_line() -> None:
    assert places(ahead(ha.lin_rel(y=0.1, frame="base")))[-1] == pytest.approx(START.xyz + [0, 0.1, 0])
    assert places(ahead(ha.lin_rel(z=0.1)))[-1] == pytest.approx(START.xyz + START.rotation @ [0, 0, 0.1])
    flange = START @ TIP.inverse()
    end = places(ahead(ha.lin_rel(z=0.1, frame="flange")))[-1]
    assert end == pytest.approx(START.xyz + flange.rotation @ [0, 0, 0.1])


def test_a_blended_program_has_no_stop_and_an_exact_one_has() -> None:
    corners = (moved(y=0.1), moved(x=-0.1, y=0.1), moved(x=-0.1))
    blended = ahead(*(ha.lin(corner, speed_mps=0.2, blend_m=0.02) for corner in corners))
    exact = ahead(*(ha.lin(corner, speed_mps=0.2) for corner in corners))
    assert blended.is_blended == (True, True, False) and exact.is_blended == (False,) * 3
    assert blended.duration < exact.duration - 0.2
    begins = np.searchsorted(blended.t, blended.begins[1:])
    assert np.abs(blended.dq[begins]).max(axis=1).min() > 0.05
    nearest = np.linalg.norm(places(blended) - corners[0].xyz, axis=1).min()
    assert 0.002 < nearest < 0.02
    # another motion frame, or a motion without a path, is a stop
    mixed = ahead(
        ha.lin(corners[0], blend_m=0.02), ha.lin_rel(z=0.02, moving="flange", blend_m=0.01), ha.hold(0.5)
    )
    assert mixed.is_blended == (False,) * 3 and mixed.duration - mixed.begins[2] == pytest.approx(0.5)


def test_a_long_program_is_sampled_more_coarsely() -> None:
    program = ahead(*[ha.hold(1000.0), ha.lin_rel(z=0.01, speed_mps=1e-4)])
    assert len(program.t) < 5100 and program.duration > 1090.0


@pytest.mark.parametrize(
    ("motions", "error", "text"),
    [
        ((ha.lin(moved(x=0.6)),), ha.Unreachable, r"not reachable at \d+ %"),
        ((ha.lin_rel(x=-0.5, z=-0.6, frame="base"),), ha.LimitError, "A4 .*on the path"),
        ((ha.ptp(deg(0, 130, 0, 0, 0, 0, 0)),), ha.LimitError, "A2 must be in"),
        ((ha.hold(),), ha.CommandRejected, "no end .*give it a duration"),
        ((ha.hold(1.0), ha.hand_guide()), ha.CommandRejected, r"^motions\[1\]: hand guiding"),
        ((ha.hold(1.0), ha.ptp(moved(x=0.9))), ha.Unreachable, r"^motions\[1\]: "),
        (
            (ha.circ(moved(x=0.05), moved(x=0.1)),),
            ha.CommandRejected,
            "start, via and end lie on a line: .* at least 0.0001 rad .* got 0 rad",
        ),
    ],
)
def test_what_the_controller_would_refuse(
    motions: tuple[Motion, ...], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        ahead(*motions)


@pytest.mark.parametrize(
    ("start", "axis", "turn"),
    [
        ((160, 45, 0, -90, 0, 45, 0), 1, 40),
        ((-160, 45, 0, -90, 0, 45, 0), 1, -40),
        ((0, 45, 0, -90, 0, 45, 165), 7, 40),
        ((0, 45, 0, -90, 0, 45, -165), 7, -40),
        ((0, 30, 0, -90, 0, 110, 0), 6, 40),
    ],
)
def test_a_line_across_a_limit_names_the_limit(start: tuple[float, ...], axis: int, turn: float) -> None:
    frames = FramesOfArm(lambda name: Pose.at(), lambda name: None)
    q = deg(*start)
    goal = Pose.from_matrix(model.forward(IIWA, q + np.radians(turn) * np.eye(7)[axis - 1]))
    with pytest.raises(ha.LimitError, match=f"limit A{axis} on the path"):
        look_ahead(IIWA, q, [item(ha.lin(goal), IIWA)], frames, step=0.01)


def test_of_two_obstacles_on_a_line_the_first_is_named() -> None:
    frames = FramesOfArm(lambda name: Pose.at(), lambda name: None)
    q = deg(0, 30, 0, -90, 0, 100, 0)
    flange = model.forward(IIWA, q)
    # 30 deg about A6, which has 20 left, and then out of reach
    turned = Pose.from_matrix(model.forward(IIWA, q + np.radians(60) * np.eye(7)[5]))
    goal = Pose.of(flange[:3, 3] + [0.9, 0, 0.9], turned.quat)
    with pytest.raises(ha.LimitError, match="limit A6 on the path"):
        look_ahead(IIWA, q, [item(ha.lin(goal), IIWA)], frames, step=0.01)


def test_a_line_through_a_singularity_is_refused() -> None:
    stretched = deg(
        0, 5, 0, -10, 0, 5, 0
    )  # the line passes over the base, where A1 and A3 would have to jump
    frames = FramesOfArm(lambda name: Pose.at(), lambda name: None)
    with pytest.raises(ha.CommandRejected, match="singularity|not reachable|would have to jump"):
        look_ahead(IIWA, stretched, [item(ha.lin_rel(x=-0.5), IIWA)], frames, step=0.01)


def test_it_needs_neither_java_nor_mujoco() -> None:
    code = "import sys, heptarm.planning.lookahead; print(*({'jpype', 'mujoco'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
