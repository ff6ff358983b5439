"""Services of libiiwa: values and modes, conditions, errors; what moves is tested with both nodes."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from heptarm.errors import CommandRejected, HeptarmError, LimitError, ShapeError
from heptarm.ros.interface.names import PRESETS, NameRole
from heptarm.ros.interface.offered import offered
from heptarm.ros.interface.presets.libiiwa import NO_ERROR, VALUE_ERROR, LibiiwaServer
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance

NAN = math.nan
SIX = {"x": 1000.0, "y": 1100.0, "z": 1200.0, "a": 10.0, "b": 20.0, "c": 30.0}


class FakeContext:
    """Remembers the mode and the guard."""

    def __init__(self) -> None:
        self.mode: Any = None
        self.driver = SimpleNamespace(guard=None)

    def set_mode(self, mode: Any) -> None:
        self.mode = mode


@pytest.fixture
def context() -> FakeContext:
    return FakeContext()


@pytest.fixture
def ask(context: FakeContext) -> Callable[..., Any]:
    server = LibiiwaServer()

    def call(name: str, **request: Any) -> Any:
        return server.service(name, "").handler(cast(Any, context), SimpleNamespace(**request))

    return call


def test_a_mode_has_the_values_that_were_set_before(ask: Callable[..., Any], context: FakeContext) -> None:
    ask("set_joint_stiffness", data=[100.0 * k for k in range(1, 8)])
    assert context.mode is None, "the current mode is position"
    ask("set_control_mode", data="JOINT_IMPEDANCE")
    assert isinstance(context.mode, JointImpedance) and context.mode.stiffness[6] == 700.0
    ask("set_joint_damping", data=[0.5] * 7)
    assert context.mode.damping[0] == 0.5, "the current mode changes at once"


def test_angles_are_those_of_kuka_and_a_million_is_no_limit(
    ask: Callable[..., Any], context: FakeContext
) -> None:
    ask("set_cartesian_stiffness", **SIX, float_param=50.0)
    ask("set_cartesian_max_velocity", **{**dict.fromkeys("xyabc", 1e6), "z": 2.0})
    ask("set_control_mode", data="cartesian_impedance")
    assert isinstance(context.mode, CartesianImpedance)
    assert context.mode.stiffness.tolist() == [1000.0, 1100.0, 1200.0, 30.0, 20.0, 10.0]
    assert context.mode.nullspace_stiffness == 50.0
    assert context.mode.max_velocity[2] == 2.0 and math.isnan(context.mode.max_velocity[0])


def test_a_refused_value_leaves_the_others_and_an_error_that_is_read_once(
    ask: Callable[..., Any], context: FakeContext
) -> None:
    ask("set_control_mode", data="joint_impedance")
    before = context.mode
    for name, data, kind in (
        ("set_joint_stiffness", [9000.0] * 7, LimitError),
        ("set_joint_damping", [0.7], ShapeError),
        ("set_desired_joint_velocity_rel", NAN, HeptarmError),
        ("set_motion_type", "lin_rel", CommandRejected),
    ):
        with pytest.raises(kind):
            ask(name, data=data)
    assert context.mode is before
    codes = [ask("last_error").fields["error_code"] for _ in range(2)]
    assert codes == [VALUE_ERROR, NO_ERROR]
    ask("set_joint_damping", data=[0.6] * 7)
    assert context.mode.stiffness[0] == 2000.0


def test_conditions_are_one_guard_until_they_are_reset(ask: Callable[..., Any], context: FakeContext) -> None:
    ask("set_force_condition", data=[NAN, NAN, 15.0, NAN, NAN, 1.0])
    ask("set_joint_torque_condition", data=[NAN] * 3 + [-5.0] + [NAN] * 6 + [10.0] + [NAN] * 3)
    text = str(context.driver.guard)
    assert "z of flange > 15 N" in text and "A4" in text and "x of" not in text
    ask("reset_conditions")
    assert context.driver.guard is None
    with pytest.raises(ShapeError, match="4 numbers"):
        ask("set_force_condition", data=[1.0] * 4)


def test_every_service_of_the_preset_has_a_handler() -> None:
    services = [one for one in PRESETS["libiiwa"].entries if one.role is NameRole.SERVICE]
    assert len({one.name for one in services}) == len(services) == 26
    for one in services:
        assert LibiiwaServer().service(one.name.rpartition("/")[2], one.type).name == one.name


def test_what_has_types_that_are_missing_is_left_out_and_named() -> None:
    table = offered(NodeConfiguration.of({"names": "lbr_stack"}).values)
    there = {row.type.partition("/")[0] for row in table.topics if row.name.startswith("lbr/")}
    assert not there & set(table.missing)
