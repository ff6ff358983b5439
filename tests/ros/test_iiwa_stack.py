"""Control modes, limits and frames of iiwa_stack's services; what moves is tested with the node of ROS 1."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.presets import iiwa_stack
from heptarm.ros.interface.presets.iiwa_settings import IiwaStackSettings
from heptarm.ros.interface.service import ServiceResponse
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose

SIX = dict.fromkeys("xyzabc", 0.0)


def joints(value: float) -> SimpleNamespace:
    return SimpleNamespace(**{f"a{number}": value for number in range(1, 8)})


def six(**values: float) -> SimpleNamespace:
    return SimpleNamespace(**(SIX | values))


def request(mode: int, **given: Any) -> SimpleNamespace:
    """A request with the zeros that ROS fills in."""
    limits = {name: six() for name in ("max_path_deviation", "max_control_force", "max_cartesian_velocity")}
    fields = {
        "joint_impedance": SimpleNamespace(joint_stiffness=joints(0.0), joint_damping=joints(0.0)),
        "cartesian_impedance": SimpleNamespace(
            cartesian_stiffness=six(), cartesian_damping=six(), nullspace_stiffness=0.0, nullspace_damping=0.0
        ),
        "desired_force": SimpleNamespace(cartesian_dof=0, desired_force=0.0, desired_stiffness=0.0),
        "sine_pattern": SimpleNamespace(cartesian_dof=0, frequency=0.0, amplitude=0.0, stiffness=0.0),
        "limits": SimpleNamespace(max_control_force_stop=False, **limits),
    }
    return SimpleNamespace(control_mode=mode, **(fields | given))


def context(**more: Any) -> Any:
    return SimpleNamespace(iiwa_stack=IiwaStackSettings(), **more)


def test_angles_are_those_of_kuka_and_millimetres_become_metres() -> None:
    given = request(2)
    given.cartesian_impedance.cartesian_stiffness = six(x=1500.0, y=1400.0, z=350.0, a=10.0, b=20.0, c=-1.0)
    given.cartesian_impedance.nullspace_stiffness = 5.0
    given.limits.max_path_deviation = six(x=50.0, y=60.0, z=70.0, a=0.1, b=0.2, c=0.3)
    given.limits.max_control_force = six(x=50.0, y=60.0, z=70.0, a=0.0, b=0.2, c=0.3)
    mode = iiwa_stack.mode_of(given)
    assert isinstance(mode, CartesianImpedance)
    assert mode.stiffness.tolist() == [1500.0, 1400.0, 350.0, CartesianImpedance().stiffness[3], 20.0, 10.0]
    assert mode.damping.tolist() == CartesianImpedance().damping.tolist(), "0 is none"
    assert mode.nullspace_stiffness == 5.0
    assert mode.max_deviation == pytest.approx([0.05, 0.06, 0.07, 0.3, 0.2, 0.1])
    assert np.isnan(mode.max_force).all(), "one zero of six, and the limit is none"


def test_the_other_modes() -> None:
    assert iiwa_stack.mode_of(request(0)) == Position()
    gentle = SimpleNamespace(joint_stiffness=joints(300.0), joint_damping=joints(-1.0))
    mode = iiwa_stack.mode_of(request(1, joint_impedance=gentle))
    assert isinstance(mode, JointImpedance) and mode.stiffness[6] == 300.0
    force = SimpleNamespace(cartesian_dof=4, desired_force=2.0, desired_stiffness=100.0)
    mode = iiwa_stack.mode_of(request(3, desired_force=force))
    assert isinstance(mode, SineImpedance) and mode.bias.tolist() == [0.0, 0.0, 0.0, 0.0, 0.0, 2.0]
    sine = SimpleNamespace(cartesian_dof=2, frequency=3.0, amplitude=5.0, stiffness=900.0)
    mode = iiwa_stack.mode_of(request(4, sine_pattern=sine))
    assert isinstance(mode, SineImpedance) and mode.frequency[1] == 3.0 and mode.base.stiffness[1] == 900.0


@pytest.mark.parametrize(
    ("given", "word"),
    [
        (request(7), "control_mode"),
        (request(3), "cartesian_dof"),
        (
            request(
                4, sine_pattern=SimpleNamespace(cartesian_dof=9, frequency=1.0, amplitude=1.0, stiffness=1.0)
            ),
            "cartesian_dof",
        ),
    ],
)
def test_what_there_is_not_is_refused(given: Any, word: str) -> None:
    with pytest.raises(CommandRejected, match=word):
        iiwa_stack.mode_of(given)


def test_limits_that_are_not_positive_stay_and_wrong_ones_are_refused() -> None:
    here = context()
    fast = SimpleNamespace(joint_relative_velocity=0.5, joint_relative_acceleration=-1.0)
    iiwa_stack.set_servo_limits(here, fast)
    iiwa_stack.set_joint_limits(here, fast)
    assert (here.iiwa_stack.servo_speed, here.iiwa_stack.servo_acceleration) == (0.5, None)
    assert here.iiwa_stack.joints == {"speed": 0.5}
    for value in (1.5, math.nan):
        with pytest.raises(LimitError, match="joint_relative_velocity"):
            iiwa_stack.set_servo_limits(
                here, SimpleNamespace(joint_relative_velocity=value, joint_relative_acceleration=0.5)
            )
    path = dict.fromkeys(iiwa_stack.PATH_LIMITS, -1.0)
    iiwa_stack.set_path_limits(here, SimpleNamespace(**(path | {"maxCartesianVelocity": 0.3})))
    with pytest.raises(LimitError, match="speed_mps"):
        iiwa_stack.set_path_limits(here, SimpleNamespace(**(path | {"maxCartesianVelocity": 300.0})))
    assert here.iiwa_stack.path == {"speed_mps": 0.3}
    zero, axes = SimpleNamespace(x=0.0, y=0.0, z=0.0), SimpleNamespace(x=0.3, y=0.2, z=0.0)
    twist = SimpleNamespace(linear=axes, angular=zero)
    iiwa_stack.set_line_limits(here, SimpleNamespace(max_cartesian_velocity=twist))
    assert (here.iiwa_stack.line_speed, here.iiwa_stack.turn_speed) == (0.2, IiwaStackSettings().turn_speed)


def test_the_flange_is_a_motion_frame_by_the_stacks_name() -> None:
    offset = Pose.at(0.0, 0.0, 0.1)
    driver = SimpleNamespace(configuration=SimpleNamespace(frame=lambda which: "iiwa_link_ee"))
    arm = SimpleNamespace(
        pose=lambda frame, reference: Pose.at(0.0, 0.0, 0.0) if frame == "flange" else offset
    )
    here = context(driver=driver, arm=arm)
    for name, moving, of in (
        ("iiwa_link_ee", "flange", Pose.at(0, 0, 0)),
        ("grip", "grip", offset),
        ("", "tool", None),
    ):
        iiwa_stack.set_endpoint_frame(here, SimpleNamespace(frame_id=name))
        assert (here.iiwa_stack.moving, here.iiwa_stack.offset) == (moving, of)


def test_nothing_moves_has_the_stacks_number() -> None:
    here = context(driver=SimpleNamespace(state=None))
    assert iiwa_stack.time_to_destination(here, None).fields == {"remaining_time": -999.0}


def test_the_error_of_a_response_is_empty_after_success() -> None:
    for success, text in ((True, ""), (False, "why")):
        response = SimpleNamespace(success=None, error=None)
        ServiceResponse(success, "why").fill(response)
        assert (response.success, response.error) == (success, text)


def test_every_name_of_the_preset_has_a_handler() -> None:
    entries = PRESETS["iiwa_stack"].entries
    for role, table in (
        (NameRole.OWN_COMMAND, iiwa_stack.TOPICS),
        (NameRole.SERVICE, iiwa_stack.SERVICES),
        (NameRole.ACTION, iiwa_stack.ACTIONS),
    ):
        assert {entry.last for entry in entries if entry.role is role} == set(table), role
