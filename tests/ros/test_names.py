"""Targets of programs for libiiwa: NaN keeps a position."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import ShapeError
from heptarm.ros.interface.motions import joint_target, partial_joints, pose_target
from heptarm.ros.interface.names import PRESETS
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.pose import Pose

HERE = np.arange(7) * 0.1
POSE = Pose.of([0.4, 0.1, 0.5], [1.0, 0.0, 0.0, 0.0])
NAN = math.nan


class FakeDriver:
    """A driver of an arm at rest."""

    arm = SimpleNamespace(state=SimpleNamespace(q_cmd=HERE, pose_cmd=POSE))
    configuration = NodeConfiguration.of({})
    transforms = None


DRIVER: Any = FakeDriver()


def test_nan_keeps_a_joint() -> None:
    target = joint_target(DRIVER, [], [NAN, 1.0, NAN, NAN, NAN, NAN, NAN])
    assert target[1] == 1.0 and (np.delete(target, 1) == np.delete(HERE, 1)).all()


@pytest.mark.parametrize("quat", [(NAN,) * 4, (0.0,) * 4])
def test_no_orientation_keeps_it(quat: tuple[float, ...]) -> None:
    assert pose_target(DRIVER, (NAN, NAN, 0.3), quat) == Pose.of([0.4, 0.1, 0.3], POSE.quat)


def test_half_an_orientation_is_none() -> None:
    with pytest.raises(ShapeError, match="four numbers"):
        pose_target(DRIVER, (0.4, 0.1, 0.5), (NAN, 0.0, 0.0, 1.0))


def test_every_driver_has_joint_states_and_the_action() -> None:
    for name, preset in PRESETS.items():
        types = {entry.type for entry in preset.entries}
        assert name == "heptarm" or {"sensor_msgs/JointState", "control_msgs/FollowJointTrajectory"} <= types


def test_a_command_names_a_joint_once_in_whatever_spelling() -> None:
    driver: Any = SimpleNamespace(
        configuration=NodeConfiguration.of({"names": "lbr_stack", **PRESETS["lbr_stack"].defaults})
    )
    assert partial_joints(driver, ["A2", "lbr_A1"], [2.0, 1.0])[:2].tolist() == [1.0, 2.0]
    with pytest.raises(ShapeError, match="appear once"):
        partial_joints(driver, ["A1", "lbr_A1"], [2.0, 1.0])
