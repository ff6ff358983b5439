"""Hand guiding, precise guiding and taught trajectories as values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.impedance import CartesianImpedance

NAN = np.nan


def test_hand_guiding_keeps_what_it_is_given() -> None:
    guide = ha.hand_guide(q_max=[0.5] + [NAN] * 6, cartesian_velocity=0.2, at_limit="all", outside="pull")
    assert guide.q_max[0] == 0.5 and np.isnan(guide.q_max[1:]).all() and np.isnan(guide.q_min).all()
    assert np.isnan(guide.joint_velocity) and guide.cartesian_velocity == 0.2
    assert guide == ha.hand_guide(
        q_max=[0.5] + [NAN] * 6, cartesian_velocity=0.2, at_limit="all", outside="pull"
    )
    assert guide.limited_to(0.1) is guide


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"q_min": [1.0] * 7, "q_max": [2.0, 1.0, 2, 2, 2, 2, 2]}, r"q_min\[1\]"),
        ({"q_min": [0.0] * 6}, "7"),
        ({"joint_velocity": 0.0}, "joint_velocity"),
        ({"cartesian_velocity": 11.0}, "cartesian_velocity"),
        ({"at_limit": "some"}, "at_limit"),
        ({"outside": "push"}, "outside"),
    ],
)
def test_wrong_limits_are_refused(given: dict[str, object], complaint: str) -> None:
    with pytest.raises(ha.CommandRejected, match=complaint):
        ha.hand_guide(**given)  # type: ignore[arg-type]


def test_compliant_is_compliant_where_it_is_reported_to_be() -> None:
    mode = compliance("xa", frame="base", stiffness=3000.0, turning=200.0)
    assert isinstance(mode, CartesianImpedance) and mode.frame == "base"
    assert mode.stiffness.tolist() == [0.0, 3000.0, 3000.0, 200.0, 200.0, 0.0]
    for wrong in ("", "xx", "xq", 3):
        with pytest.raises(ha.ShapeError, match="xyzabc"):
            compliance(wrong)  # type: ignore[arg-type]
    with pytest.raises(ha.LimitError, match="stiffness"):
        compliance("x", stiffness=6000.0)


# ------------------------------------------------------------------------------------------ trajectories


def taught() -> ha.Trajectory:
    """One second of rest, a rotation of A1 and of A2 back, half a second of rest; 100 positions per second."""
    t = np.arange(0.0, 4.0, 0.01)
    q = np.zeros((len(t), 7))
    go = np.clip(t - 1.0, 0.0, 2.5)
    q[:, 0], q[:, 1] = 0.4 * go, 0.2 * np.sin(go)
    return ha.Trajectory.of(t + 5.0, q, robot="iiwa14")


def test_a_trajectory_begins_at_zero_and_rests_outside() -> None:
    line = ha.Trajectory.of([2.0, 3.0, 5.0], [np.zeros(7), np.ones(7), np.ones(7)])
    assert line.times.tolist() == [0.0, 1.0, 3.0] and line.duration == 3.0 and len(line) == 3
    q, dq = line.at(0.25)
    assert q.tolist() == [0.25] * 7 and dq.tolist() == [1.0] * 7
    for t, there in ((-1.0, 0.0), (9.0, 1.0)):
        q, dq = line.at(t)
        assert q.tolist() == [there] * 7 and not dq.any()
    assert line.positions(np.array([0.5, 2.0]))[:, 3].tolist() == [0.5, 1.0]
    assert line.fastest.tolist() == [1.0] * 7


def test_trimming_and_thinning_keep_the_way() -> None:
    whole = taught()
    trimmed = whole.trimmed()
    assert 2.4 < trimmed.duration < 2.6
    thin = trimmed.thinned(tolerance=1e-3)
    assert len(thin) < len(trimmed) / 5
    off = np.abs(thin.positions(trimmed.times) - trimmed.q).max()
    assert 1e-5 < off <= 1e-3
    assert (thin.q[0] == trimmed.q[0]).all() and (thin.q[-1] == trimmed.q[-1]).all()
    with pytest.raises(ha.CommandRejected, match="nothing moves"):
        ha.Trajectory.of([0.0, 1.0], np.zeros((2, 7))).trimmed()
    creeping = ha.Trajectory.of(np.arange(16.0), np.linspace(0.0, 1.5e-3, 16)[:, None] * np.ones(7))
    assert creeping.trimmed() == creeping


def test_a_spline_goes_through_points_of_it() -> None:
    whole = taught()
    spline = whole.spline(tolerance=2e-3, speed=0.5)
    assert 2 < len(spline.points) < 40
    assert (spline.points[-1].q == whole.q[-1]).all()
    for point in spline.points:
        assert np.abs(whole.q - point.q).max(axis=1).min() == 0.0
    shaking = np.random.default_rng(0).uniform(-1.0, 1.0, (2600, 7))
    with pytest.raises(ha.CommandRejected, match="points"):
        ha.Trajectory.of(np.arange(2600.0), shaking).spline(tolerance=1e-6)
    with pytest.raises(ha.CommandRejected, match="nothing moves"):
        ha.Trajectory.of([0.0, 1.0], np.zeros((2, 7))).spline()


def test_files(tmp_path: Path) -> None:
    whole = taught()
    file = whole.save(tmp_path / "path")
    assert file.name == "path.npz" and ha.Trajectory.load(file) == whole
    other = tmp_path / "other.npz"
    np.savez(other, format="something", times=whole.times, q=whole.q, robot="")
    broken = tmp_path / "broken.npz"
    broken.write_bytes(file.read_bytes()[:200])
    for wrong in (other, broken):
        with pytest.raises(ha.CommandRejected, match="is not a trajectory"):
            ha.Trajectory.load(wrong)
    with pytest.raises(ha.CommandRejected, match="missing"):
        ha.Trajectory.load(tmp_path / "missing.npz")


@pytest.mark.parametrize(
    ("times", "q"),
    [
        ([0.0], np.zeros((1, 7))),
        ([0.0, 1.0], np.zeros((2, 6))),
        ([0.0, 0.0], np.zeros((2, 7))),
        ([0.0, 1.0], np.full((2, 7), NAN)),
    ],
)
def test_what_is_no_trajectory(times: list[float], q: np.ndarray) -> None:
    with pytest.raises(ha.CommandRejected):
        ha.Trajectory.of(times, q)
