"""Kinematics in C++: the same joints, poses and refusals as in Python."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import heptarm as ha
from heptarm import model
from heptarm.fri.loop.wrench import external_wrench
from heptarm.values.robot import ROBOTS, RobotModel, robot
from tests.cpp.native import compiled, objects

pytestmark = pytest.mark.computing

Ask = Callable[..., list[str]]


@pytest.fixture(scope="module")
def ask(tmp_path_factory: pytest.TempPathFactory) -> Ask:
    folder = tmp_path_factory.mktemp("kinematics")
    parts = objects(folder, ("kinematics", "redundancy"))
    program = compiled(Path(__file__).parent / "kinematics.cpp", folder, parts=parts)

    def asked(lines: Iterable[str]) -> list[str]:
        done = subprocess.run(
            [str(program)],
            input="".join(f"{line}\n" for line in lines),
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    return asked


def words(*parts: str | npt.ArrayLike) -> str:
    return " ".join(
        part if isinstance(part, str) else " ".join(repr(float(one)) for one in np.ravel(part))
        for part in parts
    )


def random_joints(arm: RobotModel, count: int, seed: int) -> list[npt.NDArray[np.float64]]:
    return list(np.random.default_rng(seed).uniform(arm.q_min, arm.q_max, (count, 7)))


@pytest.mark.parametrize("name", ROBOTS)
def test_poses_jacobians_wrenches_and_redundancy_are_those_of_python(ask: Ask, name: str) -> None:
    arm = robot(name)
    chance = np.random.default_rng(3)
    for q in (*random_joints(arm, 30, seed=1), np.zeros(7), ha.deg(0, 0, 0, -90, 0, 0, 0)):
        point, tau = chance.normal(size=3), chance.normal(size=7)
        found = [
            np.array(line.split(), dtype=float)
            for line in ask(
                (
                    words(name, "forward", q),
                    words(name, "jacobian", q, point),
                    words(name, "redundancy", q),
                    words(name, "wrench", q, tau),
                )
            )
        ]
        pose = ha.Pose(found[0][:3], found[0][3:])
        np.testing.assert_allclose(pose.matrix, model.forward(arm, q), atol=1e-12)
        expected = np.concatenate([model.jacobian(arm, q).ravel(), model.jacobian(arm, q, point).ravel()])
        np.testing.assert_allclose(found[1], expected, atol=1e-12)
        known = model.redundancy(arm, q)
        assert found[2][1:3].tolist() == [known.status, known.turn] and found[2][0] == q[2]
        assert found[2][3] == pytest.approx(model.arm_angle(arm, q), abs=1e-9)
        np.testing.assert_allclose(found[3], external_wrench(arm, q, tau), atol=1e-9)


@pytest.mark.parametrize("name", ["iiwa7", "iiwa14"])
def test_solutions_are_those_of_python(ask: Ask, name: str) -> None:
    arm = robot(name)
    asked, expected = [], []
    for number, q in enumerate((*random_joints(arm, 40, seed=2), ha.deg(0, 0, 0, -90, 0, 60, 0))):
        pose = ha.Pose.from_matrix(model.forward(arm, q))
        goal = (name, "solve", pose.xyz, pose.quat)
        near = np.clip(q + np.random.default_rng(number).normal(scale=0.1, size=7), arm.q_min, arm.q_max)
        status = model.redundancy(arm, q).status
        asked += [
            words(*goal),
            words(*goal, "near", near),
            words(*goal, "e1", [q[2]], "status", [status]),
        ]
        expected += [
            model.solve(arm, pose),
            model.solve(arm, pose, near=near),
            model.solve(arm, pose, e1=q[2], status=status),
        ]
    found = [np.array(line.split(), dtype=float) for line in ask(asked)]
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_what_has_no_solution_is_refused_as_in_python(ask: Ask) -> None:
    arm = robot("iiwa14")
    ready = ha.Pose.from_matrix(model.forward(arm, ha.deg(0, 20, 0, -90, 0, 60, 0)))
    here = (ready.xyz, ready.quat)
    for line, code, text in (
        (
            words("iiwa14", "solve", [2, 0, 0.5], [0, 0, 0, 1]),
            51,
            "the LBR iiwa 14 R820 reaches 0.020 to 0.820 m (bring",
        ),
        (words("iiwa14", "solve", *here, "e1", [3.1]), 51, "E1 is the angle of A3, which must be in"),
        (words("iiwa14", "solve", *here, "status", [8]), 2, "status must be 0 to 7, got 8"),
        (words("iiwa14", "solve", ready.xyz, [0, 0, 0, 2]), 2, "pose.quat must be of unit length"),
        (words("iiwa14", "solve", [np.nan, 0, 0], ready.quat), 2, "pose.xyz[0] must be a finite number"),
        (words("iiwa14", "forward", [0] * 6, [np.inf]), 2, "q[6] must be a finite number, got inf"),
        (words("iiwa14", "solve", *here, "near", [np.nan] * 7), 2, "near[0] must be a finite number"),
        (words("kr6", "forward", [0] * 7), 0, "model must be one of iiwa7, iiwa14, med7, med14, got kr6"),
    ):
        (said,) = ask([line])
        assert said.startswith(f"error {code} ") and text in said, said
    with pytest.raises(ha.Unreachable, match="reaches 0.020 to 0.820 m"):
        model.solve(arm, ha.Pose.at(2, 0, 0.5))
