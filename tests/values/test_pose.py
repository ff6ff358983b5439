"""Poses: a Lie group, and KUKA's angles."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.errors import LimitError, ShapeError
from heptarm.values.pose import Pose, deg, multiply, quaternion, rotation

angles = st.floats(-math.pi, math.pi)
lengths = st.floats(-10, 10)
poses = st.builds(Pose.xyz_abc, lengths, lengths, lengths, angles, angles, angles)
IDENTITY = Pose.at()


def near(a: Pose, b: Pose, tolerance: float = 1e-9) -> bool:
    return a.distance_to(b) < tolerance and a.angle_to(b) < tolerance


@given(poses, poses, poses)
def test_composition_is_associative(a: Pose, b: Pose, c: Pose) -> None:
    assert near((a @ b) @ c, a @ (b @ c))


@given(poses)
def test_identity_and_inverse(a: Pose) -> None:
    assert near(a @ IDENTITY, a)
    assert near(IDENTITY @ a, a)
    assert near(a @ a.inverse(), IDENTITY)
    assert near(a.inverse() @ a, IDENTITY)


@given(poses, poses)
def test_composition_is_the_product_of_matrices(a: Pose, b: Pose) -> None:
    assert np.allclose((a @ b).matrix, a.matrix @ b.matrix, atol=1e-12)
    assert np.allclose(a.inverse().matrix, np.linalg.inv(a.matrix), atol=1e-11)


@given(poses, poses)
def test_inverse_of_a_product(a: Pose, b: Pose) -> None:
    assert near((a @ b).inverse(), b.inverse() @ a.inverse())


@given(poses)
def test_matrix_and_back(a: Pose) -> None:
    assert near(Pose.from_matrix(a.matrix), a, 1e-12)
    r = a.rotation
    assert np.allclose(r @ r.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(r) == pytest.approx(1.0)


@given(angles, angles, angles)
def test_kuka_angles_are_rz_ry_rx(a: float, b: float, c: float) -> None:
    def about(axis: int, t: float) -> np.ndarray:
        i, j = (axis + 1) % 3, (axis + 2) % 3
        m = np.eye(3)
        m[i, i] = m[j, j] = math.cos(t)
        m[i, j], m[j, i] = -math.sin(t), math.sin(t)
        return m

    pose = Pose.xyz_abc(a=a, b=b, c=c)
    assert np.allclose(pose.rotation, about(2, a) @ about(1, b) @ about(0, c), atol=1e-12)
    assert Pose.xyz_abc(0, 0, 0, *pose.abc).angle_to(pose) < 1e-7


@pytest.mark.parametrize("b", [90, -90])
def test_kuka_angles_at_gimbal_lock(b: float) -> None:
    pose = Pose.xyz_abc(0, 0, 0, *deg(30, b, 20))
    assert Pose.xyz_abc(0, 0, 0, *pose.abc).angle_to(pose) < 1e-7


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("off", [0.0, *(10.0**k for k in range(-16, -1))])
def test_kuka_angles_near_gimbal_lock_lose_nothing(side: int, off: float) -> None:
    """Within 1e-8 of it they lost 6e-4 rad."""
    for a, c in ((0.5, 0.3), (-2.9, 3.0), (0.0, 1.0), (3.1, -0.2)):
        pose = Pose.xyz_abc(a=a, b=side * (math.pi / 2 - off), c=c)
        again = Pose.xyz_abc(0, 0, 0, *pose.abc)
        assert np.abs(again.rotation - pose.rotation).max() <= 1e-9


@given(poses, poses, poses)
def test_distances_are_metrics(a: Pose, b: Pose, c: Pose) -> None:
    assert a.distance_to(b) == b.distance_to(a)
    assert a.angle_to(b) == pytest.approx(b.angle_to(a), abs=1e-12)
    assert a.distance_to(c) <= a.distance_to(b) + b.distance_to(c) + 1e-12
    assert a.angle_to(c) <= a.angle_to(b) + b.angle_to(c) + 1e-9
    assert 0.0 <= a.angle_to(b) <= math.pi + 1e-12


@given(st.floats(-math.pi, math.pi))
def test_angle_to_measures_the_turn(t: float) -> None:
    assert IDENTITY.angle_to(Pose.xyz_abc(b=t)) == pytest.approx(abs(t), abs=1e-12)


def test_quaternion_is_canonical() -> None:
    quat = np.array([0.1, -0.2, 0.3, 0.9]) / np.linalg.norm([0.1, -0.2, 0.3, 0.9])
    assert Pose.of((0, 0, 0), quat) == Pose.of((0, 0, 0), -quat)
    assert hash(Pose.of((0, 0, 0), quat)) == hash(Pose.of((0, 0, 0), -quat))
    assert Pose.of((0, 0, 0), (1, 0, 0, 0)) == Pose.of((0, 0, 0), (-1, 0, 0, 0))
    assert Pose.of((-0.0, 0, 0)) == Pose.of((0.0, 0, 0))
    assert hash(Pose.of((-0.0, 0, 0))) == hash(Pose.of((0.0, 0, 0)))
    assert Pose.at(x=1.0) != Pose.at(x=2.0)
    assert Pose.at() != "pose"


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (0, -0.6, 0.8)])
@pytest.mark.parametrize("turn", [math.pi, math.pi - 1e-9, math.pi + 1e-9, 1e-9, 0.0, 3.0])
def test_quaternion_of_a_matrix_is_accurate_everywhere(axis: tuple[float, ...], turn: float) -> None:
    quat = np.array([*(math.sin(turn / 2) * np.array(axis)), math.cos(turn / 2)])
    found = quaternion(rotation(quat).tolist())
    assert min(np.abs(found - quat).max(), np.abs(found + quat).max()) < 1e-15


def test_hamilton_product() -> None:
    i, j, k = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)
    assert multiply(i, j).tolist() == [0, 0, 1, 0]
    assert multiply(j, k).tolist() == [1, 0, 0, 0]
    assert multiply(i, i).tolist() == [0, 0, 0, -1]


def test_frozen() -> None:
    given_xyz = np.array([1.0, 2.0, 3.0])
    pose = Pose.of(given_xyz)
    given_xyz[0] = 9.0
    assert pose.x == 1.0  # a copy
    with pytest.raises(ValueError, match="read-only"):
        pose.xyz[0] = 2.0
    with pytest.raises(ValueError, match="read-only"):
        pose.quat[0] = 2.0
    with pytest.raises(AttributeError):
        pose.xyz = given_xyz  # type: ignore[misc]
    assert pickle.loads(pickle.dumps(pose)) == pose


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: Pose.of((1, 2)), ShapeError, r"xyz must have shape \(3,\), got \(2,\)"),
        (lambda: Pose.of((1, 2, 3), (0, 0, 1)), ShapeError, "quat must have shape"),
        (lambda: Pose.of((1, 2, 3), (0, 0, 0, 2)), ShapeError, "norm 1, got 2 .*divide it by its norm"),
        (lambda: Pose.of((1, 2, 3), (0, 0, 0, 0)), ShapeError, "norm 1, got 0"),
        (lambda: Pose.of((1, math.nan, 3)), LimitError, r"xyz\[1\] must .*got nan"),
        (lambda: Pose.of((1, 2, math.inf)), LimitError, r"xyz\[2\] must .*got inf"),
        (lambda: Pose.of(("a", "b", "c")), ShapeError, "must be 3 numbers"),
        (lambda: Pose.of((1, 2, 3), (0, 0, 0, math.nan)), LimitError, r"quat\[3\] must .*got nan"),
        (lambda: Pose.from_matrix(np.eye(3)), ShapeError, r"matrix must have shape .*got \(3, 3\)"),
        (
            lambda: Pose.from_rotvec((1, 2, 3), (0, 180, 0)),
            LimitError,
            "rotvec must be at most one turn.* deg",
        ),
        (lambda: Pose.at().rotated(a=90), LimitError, "a must be in .* rad, got 90 rad"),
        (lambda: Pose.at().shifted("0.1"), ShapeError, "x must be a number"),  # type: ignore[arg-type]
        (lambda: Pose.at().shifted(z=0.1, frame="flange"), ShapeError, "frame must be one of 'base', 'tool'"),
        (lambda: Pose.at().interpolate(Pose.at(), 50), LimitError, r"fraction must be in \[0, 1\], got 50"),
        (lambda: Pose.at().interpolate((1, 2, 3), 0.5), ShapeError, "other must be a Pose"),  # type: ignore[arg-type]
    ],
)
def test_refuses(make: object, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        make()  # type: ignore[operator]


def test_text() -> None:
    assert (
        repr(Pose.of((0.5, 0, 0.3), (0, 0, 1, 0))) == "Pose(xyz=[0.5, 0.0, 0.3], quat=[0.0, 0.0, 1.0, 0.0])"
    )
    pose = Pose.xyz_abc(1 / 3, 0.123456789, -0.2, *deg(31, 22, 13))
    again = eval(repr(pose), {"Pose": Pose})
    assert again.xyz.tolist() == pose.xyz.tolist(), "repr is exact"
    np.testing.assert_allclose(again.quat, pose.quat, rtol=0, atol=3e-16)
    assert deg(180).tolist() == [math.pi]


def test_a_pose_is_shifted_and_rotated_in_its_own_and_in_the_bases_axes() -> None:
    pose = Pose.xyz_abc(0.5, 0.1, 0.4, *deg(30, 20, 10))
    np.testing.assert_allclose(pose.shifted(x=0.1, z=-0.2).xyz, pose.xyz + [0.1, 0.0, -0.2])
    np.testing.assert_allclose(
        pose.shifted(0.1, 0.2, 0.3, frame="tool").xyz, (pose @ Pose.at(0.1, 0.2, 0.3)).xyz
    )
    turn = Pose.xyz_abc(a=0.3, b=-0.2, c=0.1)
    np.testing.assert_allclose(pose.rotated(0.3, -0.2, 0.1).matrix, (pose @ turn).matrix, atol=1e-12)
    based = pose.rotated(0.3, -0.2, 0.1, frame="base")
    np.testing.assert_allclose(based.rotation, turn.rotation @ pose.rotation, atol=1e-12)
    np.testing.assert_allclose(based.xyz, pose.xyz)


def test_rotation_vector_and_roll_pitch_yaw() -> None:
    pose = Pose.xyz_abc(0, 0, 0, 0.3, -0.2, 0.1)
    np.testing.assert_allclose(pose.rpy, (0.1, -0.2, 0.3), atol=1e-12)
    vector = np.array([0.0, math.pi - 1e-3, 0.0])
    np.testing.assert_allclose(Pose.from_rotvec((1, 2, 3), vector).rotvec, vector, atol=1e-9)
    assert Pose.from_rotvec((0, 0, 0), (0.0, 0.0, 0.0)).rotvec.tolist() == [0.0, 0.0, 0.0]
    assert float(np.linalg.norm(Pose.xyz_abc(c=math.pi).rotvec)) == pytest.approx(math.pi)
    again = Pose.from_rotvec(pose.xyz, pose.rotvec)
    assert again.angle_to(pose) < 1e-12
    opposite = Pose(pose.xyz, -pose.quat)  # the same rotation
    np.testing.assert_allclose(opposite.rotvec, pose.rotvec, atol=1e-12)


def test_interpolation_turns_at_constant_speed_on_the_shortest_rotation() -> None:
    first, second = Pose.xyz_abc(0.1, 0.2, 0.3), Pose.xyz_abc(0.5, 0.2, -0.3, *deg(170, 20, 30))
    for fraction in (0.0, 0.25, 0.5, 1.0):
        between = first.interpolate(second, fraction)
        assert between.angle_to(first) == pytest.approx(fraction * second.angle_to(first), abs=1e-9)
        np.testing.assert_allclose(between.xyz, first.xyz + fraction * (second.xyz - first.xyz))
    with pytest.raises(LimitError, match="fraction"):
        first.interpolate(second, 1.1)
    with pytest.raises(ShapeError, match="frame"):
        first.shifted(x=0.1, frame="flange")
