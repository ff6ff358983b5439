"""Base parameters of the dynamics: the regressor beside Pinocchio's, and an arm from computed recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import calibration
from heptarm.calibration.base_parameters import dynamics_regressor, independent_columns
from heptarm.errors import CommandRejected
from heptarm.model.dynamics import inverse_dynamics_rows
from tests.calibration.hidden_arm import HIDDEN, IIWA, computed, trajectory

#: Base parameters of seven revolute joints, of which the first one is vertical, with KUKA's parallel and crossing axes.
COUNT = 43


def moments(count: int) -> Any:
    """Positions, velocities and accelerations, shape (3, count, 7)."""
    return np.random.default_rng(1).uniform(-1.5, 1.5, (3, count, 7))


def test_the_regressor_has_the_torques_and_the_base_of_pinocchio(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    other = pin.buildModelFromUrdf(str(ha.export_model(tmp_path / "arm.urdf")))
    data, given = other.createData(), moments(30)
    rows = [pin.computeJointTorqueRegressor(other, data, *row).copy() for row in zip(*given, strict=True)]
    theirs, ours = np.concatenate(rows), dynamics_regressor(IIWA, *given).reshape(-1, 70)
    links = IIWA.links
    entries = []
    for mass, com, inertia in zip(links.mass, links.com, links.inertia, strict=True):
        about = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))
        entries.append([mass, *(mass * com), *about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])
    torques = ours @ np.ravel(entries)
    np.testing.assert_allclose(torques, inverse_dynamics_rows(IIWA, *given).ravel(), atol=1e-9)
    known = np.concatenate([one.toDynamicParameters() for one in list(other.inertias)[1:]])
    np.testing.assert_allclose(torques, theirs @ known, atol=1e-6)

    def rank(matrix: Any) -> int:
        sizes = np.linalg.svd(matrix, compute_uv=False)
        return int((sizes > 1e-9 * sizes[0]).sum())

    columns = independent_columns(IIWA)
    assert len(columns) == rank(theirs) == rank(np.concatenate([theirs, ours[:, columns]], axis=1)) == COUNT


def test_an_arm_is_predicted_without_its_masses() -> None:
    found = calibration.base_parameters(computed(HIDDEN, trajectory(40.0), seed=1), robot=IIWA)
    given = moments(50)
    true = inverse_dynamics_rows(IIWA, *given)
    off = found.torques(*given) - true
    assert (np.sqrt(np.square(off).mean(axis=0)) < 0.02 * IIWA.tau_max).all()
    assert "43" in str(found)
    still = trajectory(2.0)
    short = calibration.ArmSamples(*(one[:400] for one in _fields(computed(HIDDEN, still, seed=2))))
    with pytest.raises(CommandRejected):
        calibration.base_parameters(short, robot=IIWA)


def _fields(samples: calibration.ArmSamples) -> list[Any]:
    return [getattr(samples, name) for name in ("t", "q", "q_cmd", "tau", "tau_ext", "tau_cmd")]
