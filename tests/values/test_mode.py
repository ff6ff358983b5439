"""Control modes are values: checked when created, equal by their numbers, frozen; four patterns in one line each."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from heptarm.errors import CommandRejected, LimitError, ShapeError
from heptarm.values.frames import BASE, TOOL
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.wire import messages as wire

NAN = math.nan
COMPLIANT = CartesianImpedance((2000, 2000, 300, 200, 200, 200), nullspace_stiffness=10.0)

MAKERS: list[Callable[[], Mode]] = [
    Position,
    lambda: JointImpedance(800.0),
    lambda: JointImpedance([800.0] * 7, damping=0.5),
    lambda: JointImpedance(range(100, 800, 100), damping=[0.1 * i for i in range(7)]),
    CartesianImpedance,
    lambda: CartesianImpedance(COMPLIANT.stiffness, frame=BASE),
    lambda: CartesianImpedance(max_force=[10.0, NAN, NAN, NAN, NAN, NAN], max_force_stops=True),
    lambda: CartesianImpedance(max_velocity=[0.1] * 6, max_deviation=[0.01] * 6, additional_force=[1.0] * 6),
    SineImpedance,
    lambda: SineImpedance.force(z=-10.0),
    lambda: SineImpedance.sine("x", frequency=2.0, amplitude=8.0, base=COMPLIANT),
    lambda: SineImpedance.lissajous("xy", frequency=2.0, amplitude=8.0, stiffness=500.0),
    lambda: SineImpedance.spiral("yz", frequency=2.0, amplitude=8.0, total_time=10.0),
]


@pytest.mark.parametrize("make", MAKERS)
def test_equal_hashed_and_pickled_by_value(make: Callable[[], Mode]) -> None:
    mode = make()
    assert mode == make()
    assert hash(mode) == hash(make())
    assert pickle.loads(pickle.dumps(mode)) == mode
    with pytest.raises((AttributeError, TypeError)):  # Python 3.10 raises TypeError where a slot is missing
        setattr(mode, fields(mode)[0].name if fields(mode) else "stiffness", None)


def test_all_differ() -> None:
    modes = [make() for make in MAKERS]
    assert len(set(modes)) == len(modes)
    assert COMPLIANT.stiffness.tolist() != COMPLIANT


def test_defaults_are_the_cabinets() -> None:
    mode = CartesianImpedance()
    assert mode.stiffness.tolist() == [2000.0] * 3 + [200.0] * 3
    assert mode.damping.tolist() == [0.7] * 6
    assert (mode.nullspace_stiffness, mode.nullspace_damping) == (100.0, 0.7)
    assert not mode.additional_force.any()
    for limit in (mode.max_force, mode.max_velocity, mode.max_deviation):
        assert np.isnan(limit).all()
    assert not mode.max_force_stops
    assert mode.frame == TOOL
    assert JointImpedance(100).damping.tolist() == [0.7] * 7
    sine = SineImpedance()
    assert sine.base == mode
    assert not np.concatenate([sine.amplitude, sine.frequency, sine.phase, sine.bias]).any()
    assert np.isnan([*sine.force_limit, *sine.position_limit, sine.total_time, sine.hold_time]).all()
    assert (sine.rise_time, sine.fall_time, sine.stay_active) == (0.0, 0.0, False)


def test_one_number_stands_for_all_joints_or_directions() -> None:
    assert JointImpedance(300, damping=0.2) == JointImpedance([300.0] * 7, damping=(0.2,) * 7)
    assert CartesianImpedance(damping=1).damping.tolist() == [1.0] * 6


def test_arrays_are_copied_and_frozen() -> None:
    stiffness = np.full(7, 100.0)
    mode = JointImpedance(stiffness)
    stiffness[0] = 1.0
    assert mode.stiffness[0] == 100.0
    with pytest.raises(ValueError, match="read-only"):
        mode.stiffness[0] = 1.0


def test_a_copy_with_other_values_is_checked_as_well() -> None:
    assert replace(COMPLIANT, damping=1.0).stiffness.tolist() == COMPLIANT.stiffness.tolist()  # type: ignore[arg-type]
    with pytest.raises(LimitError, match=r"damping\[0\] must .*got 2"):
        replace(COMPLIANT, damping=2.0)  # type: ignore[arg-type]


def test_a_constant_force_acts_where_it_was_asked_for() -> None:
    mode = SineImpedance.force(z=-10.0, c=1.5, stiffness=50.0, base=COMPLIANT)
    assert mode.bias.tolist() == [0.0, 0.0, -10.0, 1.5, 0.0, 0.0]
    assert mode.base.stiffness.tolist() == [2000.0, 2000.0, 50.0, 50.0, 200.0, 200.0]
    assert not mode.amplitude.any()
    assert SineImpedance.force(z=-10.0, base=COMPLIANT).base == COMPLIANT


@pytest.mark.parametrize(("direction", "index"), [("x", 0), ("y", 1), ("z", 2), ("a", 5), ("b", 4), ("c", 3)])
def test_a_sine_swings_in_one_direction(direction: str, index: int) -> None:
    mode = SineImpedance.sine(
        direction, frequency=2.0, amplitude=8.0, phase=0.3, bias=-1.0, stiffness=250.0, base=COMPLIANT
    )
    for name, value in (("frequency", 2.0), ("amplitude", 8.0), ("phase", 0.3), ("bias", -1.0)):
        content = getattr(mode, name)
        assert content[index] == value
        assert np.count_nonzero(content) == 1
    assert mode.base.stiffness[index] == 250.0
    assert np.count_nonzero(mode.base.stiffness != COMPLIANT.stiffness) == 1


def test_lissajous_and_spiral_swing_in_a_plane() -> None:
    figure = SineImpedance.lissajous("xz", frequency=5.0, amplitude=8.0, stiffness=500.0)
    assert figure.frequency.tolist() == [5.0, 0.0, 2.0, 0.0, 0.0, 0.0]
    assert figure.amplitude.tolist() == [8.0, 0.0, 8.0, 0.0, 0.0, 0.0]
    assert figure.phase.tolist() == [0.0, 0.0, math.pi / 2, 0.0, 0.0, 0.0]
    assert figure.base.stiffness.tolist() == [500.0, 2000.0, 500.0, 200.0, 200.0, 200.0]
    assert math.isnan(figure.duration)
    spiral = SineImpedance.spiral("yz", frequency=2.0, amplitude=8.0, total_time=10.0)
    assert spiral.frequency.tolist() == [0.0, 2.0, 2.0, 0.0, 0.0, 0.0]
    assert abs(spiral.phase[1] - spiral.phase[2]) == pytest.approx(math.pi / 2)
    assert (spiral.rise_time, spiral.fall_time, spiral.duration) == (5.0, 5.0, 10.0)


def test_times_of_a_pattern() -> None:
    shake = SineImpedance.sine("x", frequency=2.0, amplitude=8.0)
    assert math.isnan(shake.timed(rise_time=1.0, fall_time=1.0).duration)
    assert shake.timed(rise_time=1.0, hold_time=2.0, fall_time=0.5).duration == 3.5
    assert shake.timed(rise_time=1.0, total_time=5.0).duration == 5.0
    assert shake.timed(hold_time=60.0, fall_time=0.5, total_time=10.0).duration == 10.0
    assert shake.timed(total_time=1.0, stay_active=True).stay_active
    assert shake.timed(hold_time=1.0).amplitude.tolist() == shake.amplitude.tolist()


@pytest.mark.parametrize("make", MAKERS)
def test_what_is_legal_here_is_legal_on_the_wire(make: Callable[[], Mode]) -> None:
    mode = make()
    sent: wire.Mode
    if isinstance(mode, JointImpedance):
        sent = wire.JointImpedance(stiffness=tuple(mode.stiffness), damping=tuple(mode.damping))
    elif isinstance(mode, CartesianImpedance):
        sent = _cartesian(mode)
    elif isinstance(mode, SineImpedance):
        names = ("amplitude", "frequency", "phase", "bias", "force_limit", "position_limit")
        times = ("total_time", "rise_time", "hold_time", "fall_time", "stay_active")
        values: dict[str, Any] = {name: tuple(getattr(mode, name)) for name in names}
        values |= {name: getattr(mode, name) for name in times}
        sent = wire.SineImpedance(
            base=_cartesian(mode.base),
            **values,
        )
    else:
        sent = wire.PositionMode()
    sent._check("")


def _cartesian(mode: CartesianImpedance) -> wire.CartesianImpedance:
    return wire.CartesianImpedance(
        stiffness=tuple(mode.stiffness),
        damping=tuple(mode.damping),
        nullspace_stiffness=mode.nullspace_stiffness,
        nullspace_damping=mode.nullspace_damping,
        additional_force=tuple(mode.additional_force),
        max_force=tuple(mode.max_force),
        max_force_stops=mode.max_force_stops,
        max_velocity=tuple(mode.max_velocity),
        max_deviation=tuple(mode.max_deviation),
        frame="" if mode.frame == TOOL else mode.frame,
    )


def six(index: int, value: float) -> list[float]:
    """Six harmless numbers and a bad one."""
    result = [1.0] * 6
    result[index] = value
    return result


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: JointImpedance([1.0] * 6), ShapeError, r"stiffness must have shape \(7,\), got \(6,\)"),
        (lambda: JointImpedance("soft"), ShapeError, "must be one number or 7 numbers"),
        (lambda: JointImpedance(-1), LimitError, r"stiffness\[0\] must be in \[0, 5000\] Nm/rad, got -1"),
        (lambda: JointImpedance([1.0] * 6 + [5001]), LimitError, r"stiffness\[6\] must .*got 5001"),
        (lambda: JointImpedance(NAN), LimitError, r"stiffness\[0\] must .*got nan"),
        (lambda: JointImpedance(1.0, damping=1.1), LimitError, r"damping\[0\] must be in \[0, 1\], got 1.1"),
        (lambda: JointImpedance(1.0, damping=None), ShapeError, "must be one number or 7 numbers"),  # type: ignore[arg-type]
        (lambda: CartesianImpedance(3000.0), LimitError, r"\[3\] must be in \[0, 300\] Nm/rad.*\"abc\": 200"),
        (lambda: CartesianImpedance({"xyz": 9000}), LimitError, r"stiffness\[0\] must .*got 9000"),
        (lambda: CartesianImpedance({}), ShapeError, "must have groups of the directions"),
        (lambda: CartesianImpedance({"q": 1}), ShapeError, "must have groups of the directions"),
        (lambda: CartesianImpedance({"xy": 1, "x": 2}), ShapeError, "each direction at most once"),
        (lambda: CartesianImpedance({1: 2}), ShapeError, "must have groups of the directions"),  # type: ignore[dict-item]
        (lambda: CartesianImpedance({"z": "stiff"}), ShapeError, "must be one number or 6 numbers"),  # type: ignore[dict-item]
        (lambda: CartesianImpedance(max_force={"z": -1}), LimitError, r"max_force\[2\] must"),
        (lambda: CartesianImpedance([1.0] * 7), ShapeError, r"stiffness must have shape .*got \(7,\)"),
        (lambda: CartesianImpedance(six(2, 5001)), LimitError, r"\[2\] must be in \[0, 5000\] N/m, got 5001"),
        (lambda: CartesianImpedance(six(3, 301)), LimitError, r"\[3\] must be in \[0, 300\] Nm/rad, got 301"),
        (lambda: CartesianImpedance(six(0, -0.1)), LimitError, r"stiffness\[0\] must .*got -0.1"),
        (lambda: CartesianImpedance(six(5, NAN)), LimitError, r"stiffness\[5\] must .*got nan"),
        (
            lambda: CartesianImpedance(damping=0.05),
            LimitError,
            r"damping\[0\] must be in \[0.1, 1\], got 0.05",
        ),
        (lambda: CartesianImpedance(damping=[True] * 6), ShapeError, "6 numbers.*boolean"),
        (lambda: CartesianImpedance(nullspace_stiffness=-1), LimitError, "nullspace_stiffness must .*got -1"),
        (
            lambda: CartesianImpedance(nullspace_stiffness=NAN),
            LimitError,
            "nullspace_stiffness must .*got nan",
        ),
        (lambda: CartesianImpedance(nullspace_damping=0.2), LimitError, r"must be in \[0.3, 1\]"),
        (lambda: CartesianImpedance(additional_force=six(1, 501)), LimitError, r"must be in \[-500, 500\] N"),
        (lambda: CartesianImpedance(max_force=six(4, -1)), LimitError, r"must be in \[0, 1e\+06\] Nm"),
        (lambda: CartesianImpedance(max_force=[math.inf] * 6), LimitError, r"max_force\[0\] must .*got inf"),
        (lambda: CartesianImpedance(max_force_stops=True), CommandRejected, "without a max_force"),
        (lambda: CartesianImpedance(max_force_stops=1), ShapeError, "must be True or False"),  # type: ignore[arg-type]
        (lambda: CartesianImpedance(max_velocity=six(0, 0)), LimitError, r"must be in \(0, 100\] m/s"),
        (lambda: CartesianImpedance(max_deviation=six(5, 0)), LimitError, r"must be in \(0, 100\] rad"),
        (
            lambda: CartesianImpedance(max_deviation=0.1),
            ShapeError,
            r"max_deviation must have shape .*got \(\)",
        ),
        (lambda: CartesianImpedance(frame=""), ShapeError, "frame must be a name of 1 to 128 bytes, got ''"),
        (lambda: CartesianImpedance(frame="x" * 129), ShapeError, "1 to 128 bytes"),
        (lambda: SineImpedance(JointImpedance(1.0)), ShapeError, "must be a CartesianImpedance"),  # type: ignore[arg-type]
        (lambda: SineImpedance(amplitude=six(0, -1)), LimitError, r"must be in \[0, 500\] N"),
        (lambda: SineImpedance(frequency=six(0, 16)), LimitError, r"must be in \[0, 15\] Hz"),
        (
            lambda: SineImpedance(phase=six(3, -0.1)),
            LimitError,
            r"phase\[3\] must be in \[0, 6.3\] rad, got -0.1",
        ),
        (lambda: SineImpedance(bias=six(3, 501)), LimitError, r"must be in \[-500, 500\] Nm"),
        (lambda: SineImpedance(force_limit=six(3, -1)), LimitError, r"force_limit\[3\] must .*got -1"),
        (lambda: SineImpedance(position_limit=six(3, 101)), LimitError, r"must be in \[0, 100\] rad"),
        (lambda: SineImpedance(rise_time=-1.0), LimitError, r"rise_time must be in \[0, 1e\+06\] s, got -1"),
        (lambda: SineImpedance(fall_time=NAN), LimitError, "fall_time must .*got nan"),
        (lambda: SineImpedance(hold_time="long"), ShapeError, "must be a number"),  # type: ignore[arg-type]
        (
            lambda: SineImpedance(rise_time=2, fall_time=2, total_time=3),
            CommandRejected,
            "at least .* = 4 s, got 3 s",
        ),
        (lambda: SineImpedance(stay_active=True), CommandRejected, "a pattern without an end"),
        (lambda: SineImpedance.force(z="down"), ShapeError, "z must be a number"),  # type: ignore[arg-type]
        (lambda: SineImpedance.force(c=1, stiffness=400), LimitError, r"stiffness must .*got 400"),
        (
            lambda: SineImpedance.sine("w", frequency=1, amplitude=1),
            ShapeError,
            "direction must be one of .*got 'w'",
        ),
        (
            lambda: SineImpedance.sine(["x"], frequency=1, amplitude=1),  # type: ignore[arg-type]
            ShapeError,
            "must be one of x, y, z",
        ),
        (
            lambda: SineImpedance.sine("x", frequency=NAN, amplitude=1),
            LimitError,
            r"frequency\[0\] must .*got nan",
        ),
        (lambda: SineImpedance.lissajous("zx", frequency=1, amplitude=1), ShapeError, "one of xy, xz, yz"),
        (
            lambda: SineImpedance.lissajous("xy", frequency=16, amplitude=1),
            LimitError,
            "frequency must .*got 16",
        ),
        (
            lambda: SineImpedance.spiral("xy", frequency=1, amplitude=1, total_time=0),
            LimitError,
            r"total_time must be in \(0, 1e\+06\] s, got 0",
        ),
        (
            lambda: SineImpedance.spiral("xy", frequency=1, amplitude=1, total_time=None),  # type: ignore[arg-type]
            ShapeError,
            "total_time must be a number",
        ),
    ],
)
def test_refuses_with_value_range_and_remedy(
    make: Callable[[], object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        make()


def test_groups_of_directions() -> None:
    mode = CartesianImpedance(
        {"xy": 3000, "abc": 150},
        damping={"z": 1.0},
        additional_force={"z": 5},
        max_force={"xyz": 40, "a": 10},
    )
    assert mode.stiffness.tolist() == [3000, 3000, 2000, 150, 150, 150]  # z keeps the default
    assert mode.damping.tolist() == [0.7, 0.7, 1.0, 0.7, 0.7, 0.7]
    assert mode.additional_force.tolist() == [0, 0, 5, 0, 0, 0]
    assert (
        mode.max_force[[0, 1, 2, 5]].tolist() == [40, 40, 40, 10] and np.isnan(mode.max_force[[3, 4]]).all()
    )
    assert CartesianImpedance(250.0) == CartesianImpedance({"xyzabc": 250.0})
    sine = SineImpedance(amplitude={"z": 5.0}, frequency={"z": 2.0}, position_limit={"xyz": 0.1})
    assert sine.amplitude.tolist() == [0, 0, 5, 0, 0, 0] and np.isnan(sine.position_limit[3:]).all()
