"""The boundary of a workspace, for frames and tools of any pose."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.errors import OutsideWorkspace
from heptarm.model.boundary import TOLERANCE, Boundary
from heptarm.model.kinematics import forward
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from heptarm.values.workspace import Workspace

ARM = robot("iiwa14")
HOME = np.radians([0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0])
FRAME = Pose.xyz_abc(0.5, 0.0, 0.3, np.pi / 4, 0.1, -0.2)
TIP = Pose.xyz_abc(0.02, 0.01, 0.15, 0.3, 0.0, 0.0)


def boundary(half: float = 0.2, **more: object) -> Boundary:
    space = Workspace(([-half] * 3, [half] * 3), frame="cell", **more)  # type: ignore[arg-type]
    return Boundary(space, ARM, FRAME, TIP)


def test_the_box_lies_in_its_frame_and_bounds_the_tool() -> None:
    one = boundary()
    tool = (Pose.from_matrix(forward(ARM, HOME)) @ TIP).xyz
    np.testing.assert_allclose(one.tool(HOME), tool, atol=1e-12)
    inside = FRAME @ Pose.at(0.19, -0.19, 0.0)
    beyond = FRAME @ Pose.at(0.25, 0.0, -0.21)
    assert one.outside(inside.xyz) == 0.0
    assert one.outside(beyond.xyz) == pytest.approx(0.05)
    np.testing.assert_allclose(one.clamped_point(beyond.xyz), (FRAME @ Pose.at(0.2, 0.0, -0.2)).xyz)
    below, above = one.walls(beyond.xyz)
    np.testing.assert_allclose(below, [0.45, 0.2, -0.01], atol=1e-9)
    np.testing.assert_allclose(above, [-0.05, 0.2, 0.41], atol=1e-9)


def test_the_excess_is_that_of_the_tool_or_of_the_joints() -> None:
    tool = FRAME.inverse() @ Pose.at(*boundary().tool(HOME))
    half = float(np.abs(tool.xyz).max())
    assert boundary(half - 0.01).excess(HOME) == pytest.approx(0.01)
    assert boundary(half + 0.01).excess(HOME) == 0.0
    joints = boundary(half + 0.01, joints=(HOME - 0.1, HOME + 0.1))
    assert joints.excess(HOME + 0.3 * np.eye(7)[6]) == pytest.approx(0.2)


def test_joint_targets_are_clamped_on_the_way_to_them() -> None:
    one = boundary(joints=(HOME - 0.5, HOME + 0.5))
    rng = np.random.default_rng(1)
    cut = 0
    for _ in range(100):
        q = HOME + rng.uniform(-1.0, 1.0, 7)
        held = one.clamped(q, HOME)
        assert one.excess(held) <= max(one.excess(HOME), TOLERANCE) + 1e-9
        cut += not np.array_equal(held, q)
    assert cut > 50
    small = HOME + 0.01
    assert np.array_equal(one.clamped(small, HOME), small)


def test_from_outside_the_way_in_is_open_and_the_way_out_is_not() -> None:
    one = Boundary(Workspace(joints=(HOME - 0.1, HOME + 0.1)), ARM, Pose.at(), TIP)
    beyond = HOME + 0.3
    np.testing.assert_array_equal(one.clamped(HOME + 0.2, beyond), HOME + 0.2)
    np.testing.assert_array_equal(one.clamped(HOME + 0.4, beyond), beyond)


def test_a_refusal_names_axis_value_range_and_what_it_is_not() -> None:
    one = boundary(joints=(HOME - 0.1, HOME + 0.1))
    error = one.refusal(HOME + 0.2 * np.eye(7)[3], "the target", parameter="q")
    assert isinstance(error, OutsideWorkspace) and error.parameter == "q"
    assert "A4 must be in [-95.7, -84.3] deg, got -78.54 deg" in str(error)
    assert "no safety function" in str(error)
    error = one.refusal_of_point((FRAME @ Pose.at(0.0, 0.3, 0.0)).xyz, "the pose", parameter="pose")
    assert "the tool's y in cell must be in [-0.2, 0.2] m, got 0.3 m" in str(error)
