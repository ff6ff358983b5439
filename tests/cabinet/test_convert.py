"""The application's conversion between metres and quaternions and Sunrise's millimetres and angles."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest

from heptarm.values.pose import Pose
from tests.cabinet.fake import classes, toolchain

COUNT = 2000


def _poses() -> list[Pose]:
    chance = np.random.default_rng(5)
    poses = []
    for _ in range(COUNT):
        quat = chance.normal(size=4)
        poses.append(Pose.of(chance.uniform(-1.5, 1.5, size=3), quat / np.linalg.norm(quat)))
    for b in (math.pi / 2, -math.pi / 2):  # where a and c are not unique, and near that
        for off in (0.0, *(sign * 10.0**-k for k in range(1, 17) for sign in (1, -1))):
            a, c = chance.uniform(-math.pi, math.pi, size=2)
            poses.append(Pose.xyz_abc(0.1, 0.2, 0.3, a, b + off, c))
    for a in (0.0, math.pi / 2, math.pi, -math.pi):
        poses += [
            Pose.xyz_abc(0, 0, 0, a, 0, 0),
            Pose.xyz_abc(0, 0, 0, 0, 0, a),
            Pose.xyz_abc(0, 0, 0, a, a, a),
        ]
    return poses


def test_poses_go_to_sunrise_and_come_back() -> None:
    poses = _poses()
    text = "".join(" ".join(repr(float(v)) for v in pose.array) + "\n" for pose in poses)
    command = [toolchain.find_jdk().java, "-cp", classes("java_app"), "heptarm.app.ConvertProbe"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    rows = np.array([[float(word) for word in line.split()] for line in done.stdout.splitlines()])
    assert rows.shape == (len(poses), 13)
    for pose, row in zip(poses, rows, strict=True):
        assert row[:3] == pytest.approx(pose.xyz * 1000.0, abs=1e-9)
        there = Pose.xyz_abc(*(row[:3] / 1000.0), *row[3:6])
        assert np.abs(there.matrix - pose.matrix).max() < 1e-12
        back = Pose.of(row[6:9], row[9:13])
        assert np.abs(back.matrix - pose.matrix).max() < 1e-12
        assert row[12] >= 0.0
