"""The tip of a tool from poses about a fixed point: exact, with noise, with honest sigma; what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from heptarm import Pose, calibration
from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.checks import Array
from heptarm.values.pose import deg
from heptarm.values.tool import Tool

TIP = Pose.xyz_abc(0.012, -0.034, 0.187, *deg(20, -15, 170))
POINT = np.array([0.55, 0.1, 0.3])
#: How the flange is tilted in the poses [deg].
TILTS = ((0, 35, 180), (60, -35, 180), (120, 0, 215), (-120, 0, 145), (180, 30, 200), (-60, -25, 160))


def about(point: Array, tilts: tuple[tuple[float, ...], ...], *, noise: Array | float = 0.0) -> list[Pose]:
    """Poses of the flange whose tip is at a point, but for an error of pointing (n, 3) [m]."""
    errors = np.broadcast_to(noise, (len(tilts), 3))
    turned = [Pose.xyz_abc(0, 0, 0, *deg(*one)) for one in tilts]
    return [
        Pose.of(point + error - one.rotation @ TIP.xyz, one.quat)
        for one, error in zip(turned, errors, strict=True)
    ]


def reaching(name: str, far: float, tilt: tuple[float, ...]) -> Pose:
    """A pose in which the fixed point is on an axis of the tool."""
    on_axis = TIP.xyz + far * TIP.rotation[:, "xyz".index(name)]
    turned = Pose.xyz_abc(0, 0, 0, *deg(*tilt))
    return Pose.of(POINT - turned.rotation @ on_axis, turned.quat)


def test_exact_poses_give_the_exact_tip_and_point() -> None:
    found = calibration.tcp(about(POINT, TILTS[:4]))
    assert np.allclose(found.pose.xyz, TIP.xyz, atol=1e-12) and np.allclose(found.point, POINT, atol=1e-12)
    assert found.sigma.max() < 1e-12 and found.residuals.max() < 1e-12
    assert math.isnan(found.sigma_angle) and math.isnan(found.spread_without)


@pytest.mark.parametrize("count", [4, 6])
def test_in_a_hundred_runs_the_truth_is_within_two_sigma(count: int) -> None:
    random = np.random.default_rng(count)
    inside, errors = np.zeros(3), []
    for _ in range(100):
        poses = about(POINT, TILTS[:count], noise=random.normal(0.0, 1e-4, (count, 3)))
        found = calibration.tcp(poses)
        off = found.pose.xyz - TIP.xyz
        inside += np.abs(off) <= 2.0 * found.sigma
        errors.append(float(np.linalg.norm(off)))
    assert (inside >= 90).all(), inside
    assert np.quantile(errors, 0.95) < 0.3e-3  # pointing by 0.1 mm along each axis


def test_orientation_from_points_on_two_axes() -> None:
    random = np.random.default_rng(3)
    inside, angles = 0, []
    for _ in range(100):
        shift = Pose.of(random.normal(0.0, 5e-5, 3))  # errors of pointing by 0.05 mm
        poses = about(POINT, TILTS, noise=random.normal(0.0, 5e-5, (6, 3)))
        along = {"z": shift @ reaching("z", 0.12, (10, 5, 170)), "x": reaching("x", 0.1, (-20, 10, 190))}
        found = calibration.tcp(poses, along=along)
        angle = found.pose.angle_to(TIP)
        inside += angle <= 2.0 * found.sigma_angle
        angles.append(angle)
    assert inside >= 90
    assert np.quantile(angles, 0.95) < math.radians(0.1)
    exact = calibration.tcp(
        about(POINT, TILTS), along={"z": reaching("z", 0.12, (10, 5, 170)), "-y": _minus_y()}
    )
    assert exact.pose.angle_to(TIP) < 1e-9


def _minus_y() -> Pose:
    turned = Pose.xyz_abc(0, 0, 0, *deg(15, -10, 185))
    return Pose.of(POINT - turned.rotation @ (TIP.xyz - 0.1 * TIP.rotation[:, 1]), turned.quat)


def test_orientation_from_a_tool_that_is_aligned_with_the_world() -> None:
    random = np.random.default_rng(4)
    world = Pose.xyz_abc(0, 0, 0, *deg(30, 0, 180))
    inside = 0
    for _ in range(100):
        aligned = []
        for tilt in random.normal(0.0, math.radians(0.1), (4, 3)):
            tool = Pose.of(np.zeros(3), world.quat) @ Pose.from_rotvec(np.zeros(3), tilt)
            aligned.append(Pose.of(random.uniform(-1, 1, 3), (tool @ TIP.inverse()).quat))
        found = calibration.tcp(about(POINT, TILTS), aligned=aligned, world=world)
        inside += found.pose.angle_to(TIP) <= 2.0 * found.sigma_angle
        assert found.pose.angle_to(TIP) < math.radians(0.3)
    assert inside >= 90
    with pytest.raises(ShapeError, match="aligned must be a sequence of poses, got Pose"):
        calibration.tcp(about(POINT, TILTS), aligned=aligned[0], world=world)  # type: ignore[arg-type]
    assert calibration.tcp(about(POINT, TILTS), aligned=None).pose.quat[3] == 1.0
    once = calibration.tcp(about(POINT, TILTS), aligned=aligned[:1], world=world)
    assert math.isnan(once.sigma_angle) and "not estimated from residuals" in str(once)


def test_the_worst_pose_is_named() -> None:
    noise = np.random.default_rng(1).normal(0.0, 5e-5, (6, 3))
    noise[2] += (0.002, 0.0, -0.001)
    found = calibration.tcp(about(POINT, TILTS, noise=noise))
    assert found.worst == 3 and found.is_suspect
    assert "pose 3" in str(found) and "measure it again" in str(found)
    good = calibration.tcp(about(POINT, TILTS, noise=np.delete(noise, 2, 0)[[0, 1, 2, 3, 4, 0]]))
    assert not good.is_suspect
    noise[2] += 0.03
    with pytest.raises(CommandRejected, match=r"pose 3 contradicts the others.*measure pose 3 again"):
        calibration.tcp(about(POINT, TILTS, noise=noise))


def test_too_few_poses_are_refused() -> None:
    with pytest.raises(ShapeError, match="poses must be at least 4, got 3"):
        calibration.tcp(about(POINT, TILTS[:3]))
    with pytest.raises(ShapeError, match="must be a sequence of poses"):
        calibration.tcp(TIP)  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match=r"poses\[1\]"):
        calibration.tcp([TIP, 3, TIP, TIP])  # type: ignore[list-item]


def test_poses_that_differ_too_little_are_refused() -> None:
    still = about(POINT, ((0, 0, 180),) * 5)
    with pytest.raises(CommandRejected, match="differ too little"):
        calibration.tcp(still)
    one_axis = about(POINT, ((0, 0, 180), (40, 0, 180), (90, 0, 180), (-70, 0, 180)))
    with pytest.raises(CommandRejected, match=r"along \(0.00, 0.00, 1.00\) of the flange"):
        calibration.tcp(one_axis)


def test_axes_that_cannot_give_an_orientation_are_refused() -> None:
    poses, z = about(POINT, TILTS), reaching("z", 0.12, (10, 5, 170))
    with pytest.raises(ShapeError, match="two poses by axes"):
        calibration.tcp(poses, along={"z": z})
    with pytest.raises(ShapeError, match="two different axes"):
        calibration.tcp(poses, along={"z": z, "-z": z})
    with pytest.raises(CommandRejected, match="nearly one line"):
        calibration.tcp(poses, along={"z": z, "x": reaching("z", 0.08, (0, 0, 180))})
    with pytest.raises(LimitError, match="20.00 mm from the tip, got 5.00 mm"):
        calibration.tcp(poses, along={"z": reaching("z", 0.005, (0, 0, 180)), "x": z})
    with pytest.raises(CommandRejected, match="both give the orientation"):
        calibration.tcp(poses, along={"z": z, "x": z}, aligned=[z])


def test_a_tip_becomes_a_frame_and_the_rest_of_the_tool_stays() -> None:
    found = calibration.tcp(about(POINT, TILTS))
    old = Tool(
        "gripper", mass=1.2, com=(0, 0, 0.06), tcp=Pose.at(0, 0, 0.1), frames={"pad": Pose.at(0, 0.04)}
    )
    new = found.to_tool(old)
    assert new.frame_names == ("tcp", "pad") and new.tcp == found.pose and new.mass == 1.2
    assert found.to_tool(old, frame="needle").frame_names == ("needle", "tcp", "pad")
    assert found.to_tool("pen") == Tool("pen", tcp=found.pose)
