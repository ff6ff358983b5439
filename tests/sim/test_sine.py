"""Overlaid forces: a clamped hand exerts the commanded force, a free one swings with its stiffness."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from heptarm.model.kinematics import forward
from heptarm.sim.control_laws.cartesian_impedance import RAMP, OverlaidForce
from heptarm.values.checks import Array
from heptarm.values.mode.directions import DIRECTIONS
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from tests.long import few
from tests.sim.compliant import ASKEW, Arm

NOWHERE = np.zeros(6)
#: Of an amplitude or a frequency: what the issue of this feature promises.
ACCURACY = 0.05


# ------------------------------------------------------------------------------------------- the pattern itself


def over(pattern: OverlaidForce, seconds: float, index: int) -> Array:
    """One direction of a pattern, millisecond by millisecond."""
    return np.array([pattern.force(t * 1e-3, NOWHERE)[index] for t in range(round(seconds * 1000))])


def test_a_sine_has_bias_amplitude_frequency_and_phase() -> None:
    pattern = OverlaidForce(SineImpedance.sine("y", frequency=2.0, amplitude=8.0, phase=0.5, bias=3.0))
    t = np.arange(1000) * 1e-3
    assert over(pattern, 1.0, 1) == pytest.approx(3.0 + 8.0 * np.sin(4 * math.pi * t + 0.5))
    assert not over(pattern, 1.0, 0).any()
    assert pattern.end == math.inf


def test_it_rises_holds_falls_and_is_gone() -> None:
    pattern = OverlaidForce(SineImpedance.force(z=-10.0).timed(rise_time=1.0, hold_time=2.0, fall_time=0.5))
    times = (0.0, 0.25, 1.0, 2.9, 3.25, 3.5, 9.0)
    assert [pattern.force(t, NOWHERE)[2] for t in times] == pytest.approx([0, -2.5, -10, -10, -5, 0, 0])
    assert pattern.end == 3.5


def test_the_total_time_ends_it_with_its_fall() -> None:
    pattern = OverlaidForce(
        SineImpedance.force(z=8.0).timed(rise_time=1.0, hold_time=60.0, fall_time=2.0, total_time=5.0)
    )
    assert [pattern.force(t, NOWHERE)[2] for t in (0.5, 3.0, 4.0, 5.0)] == pytest.approx([4, 8, 4, 0])
    short = OverlaidForce(SineImpedance.force(z=8.0).timed(rise_time=1.0, hold_time=0.0, fall_time=1.0))
    assert [short.force(t, NOWHERE)[2] for t in (0.5, 1.0, 1.5, 2.0)] == pytest.approx([4, 8, 4, 0])


def test_without_times_it_lasts() -> None:
    assert OverlaidForce(SineImpedance.force(x=1.0)).force(1e5, NOWHERE)[0] == 1.0


def test_a_force_limit_cuts_the_peaks() -> None:
    mode = SineImpedance(amplitude=[10.0] * 6, frequency=[1.0] * 6, force_limit=[4.0] + [math.nan] * 5)
    assert over(OverlaidForce(mode), 1.0, 0).max() == 4.0
    assert over(OverlaidForce(mode), 1.0, 0).min() == -4.0
    assert over(OverlaidForce(mode), 1.0, 1).max() == pytest.approx(10.0)


def test_beyond_the_position_limit_only_what_pulls_back_acts() -> None:
    mode = SineImpedance(bias=[10.0, 10.0, -10.0, 0.0, 0.0, 0.0], position_limit=[0.01] * 3 + [math.nan] * 3)
    pattern = OverlaidForce(mode)
    assert pattern.force(1.0, np.array([0.005, 0, 0, 0, 0, 0]))[0] == 10.0
    assert 0.0 < pattern.force(1.0, np.array([0.009, 0, 0, 0, 0, 0]))[0] < 10.0
    assert pattern.force(1.0, np.array([0.011, -0.02, 0.02, 0, 0, 0])).tolist() == [
        0.0,
        10.0,
        -10.0,
        0.0,
        0.0,
        0.0,
    ]
    closed = OverlaidForce(SineImpedance(bias=[10.0] * 6, position_limit=[0.0] * 6))
    assert not closed.force(1.0, np.full(6, 1e-4)).any()


def test_a_lissajous_figure_closes_after_five_periods_of_its_first_axis() -> None:
    pattern = OverlaidForce(SineImpedance.lissajous("xy", frequency=2.0, amplitude=8.0))
    x, y = over(pattern, 5.0, 0), over(pattern, 5.0, 1)
    assert x[:2500] == pytest.approx(x[2500:], abs=1e-9)
    assert y[:2500] == pytest.approx(y[2500:], abs=1e-9)
    assert (x[0], y[0]) == pytest.approx((0.0, 8.0))
    assert np.count_nonzero(np.diff(np.signbit(x[:2500]))) == pytest.approx(10, abs=1)
    assert np.count_nonzero(np.diff(np.signbit(y[:2500]))) == pytest.approx(4, abs=1)


def test_a_spiral_goes_evenly_outwards_and_back() -> None:
    pattern = OverlaidForce(SineImpedance.spiral("xz", frequency=3.0, amplitude=12.0, total_time=4.0))
    x, z = over(pattern, 4.5, 0), over(pattern, 4.5, 2)
    t = np.arange(4500) * 1e-3
    assert np.hypot(x, z) == pytest.approx(12.0 * np.maximum(0.0, 1.0 - np.abs(t - 2.0) / 2.0), abs=1e-9)
    turns = np.unwrap(np.arctan2(z[1:4000], x[1:4000]))
    assert np.diff(turns) == pytest.approx(2 * math.pi * 3.0 * 1e-3)


def test_it_can_keep_the_motion_waiting() -> None:
    arm = Arm(SineImpedance.force(z=5.0).timed(total_time=0.3, stay_active=True))
    arm.step(0.2)
    assert arm.law.stays
    arm.step(0.2)
    assert not arm.law.stays
    assert not Arm(SineImpedance.force(z=5.0).timed(total_time=0.3)).law.stays


# ------------------------------------------------------------------------------------------- a clamped hand


def clamped(mode: SineImpedance, seconds: float, *, tcp: Pose | None = None) -> Array:
    """Wrenches on the clamp at the motion frame, in its axes, every tick, shape (n, 6)."""
    link = Pose.from_matrix(forward(robot("iiwa14"), ASKEW)) @ Pose.at(z=-0.035)
    world = link.inverse()
    numbers = [*world.xyz, world.quat[3], *world.quat[:3]]
    relative = " ".join(map(str, numbers))
    weld = f'<weld body1="link_7" relpose="{relative}" solref="0.003 1" solimp="0.9999 0.9999 0.001"/>'
    arm = Arm(mode, tcp=tcp, tail=f"<equality>{weld}</equality>")
    turn = arm.wanted.rotation
    seen = []
    for _ in range(round(seconds * 1000)):
        arm.tick()
        force = -np.linalg.lstsq(arm.flange.jacobian.T, arm.data.qfrc_constraint[:7], rcond=None)[0]
        force[3:] -= np.cross(arm.flange.rotation @ arm.tcp.xyz, force[:3])
        seen.append(np.concatenate([turn.T @ force[:3], turn.T @ force[3:]]))
    assert arm.pose.distance_to(arm.wanted) < 1e-3, "it is clamped"
    return np.array(seen)


def swing(force: Array, most: float = 20.0) -> tuple[float, float, float]:
    """Mean, amplitude and frequency [Hz] of the sine that fits best."""
    t = np.arange(len(force)) * 1e-3

    def fit(frequency: float) -> tuple[float, Any]:
        basis = np.stack(
            [np.ones_like(t), np.sin(2 * math.pi * frequency * t), np.cos(2 * math.pi * frequency * t)]
        )
        part, *_ = np.linalg.lstsq(basis.T, force, rcond=None)
        return float(np.sum((basis.T @ part - force) ** 2)), part

    best = min(np.arange(0.2, most, 0.05), key=lambda f: fit(f)[0])
    part = fit(best)[1]
    return float(part[0]), float(math.hypot(part[1], part[2])), float(best)


@pytest.mark.parametrize(
    ("direction", "frequency", "amplitude", "bias"),
    few(
        [
            ("z", 15.0, 10.0, -20.0),
            ("c", 2.0, 2.0, 0.5),
            ("x", 1.0, 10.0, 0.0),
            ("y", 5.0, 30.0, 0.0),
            ("a", 6.0, 1.0, 0.0),
        ],
        2,
    ),
)
def test_the_force_has_its_amplitude_and_frequency(
    direction: str, frequency: float, amplitude: float, bias: float
) -> None:
    mode = SineImpedance.sine(direction, frequency=frequency, amplitude=amplitude, bias=bias)
    felt = clamped(mode, 1.3, tcp=Pose.xyz_abc(0.02, 0.0, 0.1, 0.4))[300:]
    index = DIRECTIONS[direction]
    mean, swung, beat = swing(felt[:, index])
    assert swung == pytest.approx(amplitude, rel=ACCURACY)
    assert beat == pytest.approx(frequency, rel=ACCURACY)
    assert mean == pytest.approx(bias, abs=ACCURACY * amplitude)
    others = np.delete(felt, index, axis=1)
    assert np.abs(others[:, :3]).max() < 0.1 * (amplitude + abs(bias)), "nothing elsewhere"


def test_the_lissajous_force_swings_in_both_axes() -> None:
    felt = clamped(SineImpedance.lissajous("xy", frequency=5.0, amplitude=8.0, stiffness=500.0), 1.8)[300:]
    for index, frequency in ((0, 5.0), (1, 2.0)):
        _, swung, beat = swing(felt[:, index])
        assert swung == pytest.approx(8.0, rel=ACCURACY)
        assert beat == pytest.approx(frequency, rel=ACCURACY)
    assert np.abs(felt[:, 2]).max() < 0.5


def test_the_spiral_force_grows_and_shrinks() -> None:
    felt = clamped(SineImpedance.spiral("xz", frequency=4.0, amplitude=20.0, total_time=3.0), 3.2)
    radius = np.hypot(felt[:, 0], felt[:, 2])
    for time in (0.5, 1.0, 1.5, 2.0, 2.5):
        expected = 20.0 * (1.0 - abs(time - 1.5) / 1.5)
        around = radius[round(1000 * time) - 20 : round(1000 * time) + 20]
        assert float(np.mean(around)) == pytest.approx(expected, rel=ACCURACY)
    assert radius[-50:].max() < 0.2
    turns = np.unwrap(np.arctan2(felt[500:2500, 2], felt[500:2500, 0]))
    assert abs(turns[-1] - turns[0]) / (2 * math.pi) / 2.0 == pytest.approx(4.0, rel=ACCURACY)


def test_a_constant_force_sets_in_gently_and_lasts() -> None:
    felt = clamped(SineImpedance.force(z=-10.0), 0.6)
    assert felt[200:, 2] == pytest.approx(np.full(400, -10.0), rel=ACCURACY)
    assert np.abs(np.diff(felt[:, 2], prepend=0.0)).max() < 10.0 / (RAMP * 1000) * 3.0


# ------------------------------------------------------------------------------------------- a free hand


def test_a_free_hand_complies_to_a_constant_force_by_force_over_stiffness() -> None:
    arm = Arm(SineImpedance.force(z=-10.0, stiffness=500.0))
    arm.step(1.2)
    assert arm.law.deviation == pytest.approx([0, 0, -0.02, 0, 0, 0], abs=4e-4)


def test_a_free_hand_swings_slowly_as_its_spring_lets_it() -> None:
    base = CartesianImpedance((1000.0,) * 3 + (200.0,) * 3)
    arm = Arm(SineImpedance.sine("x", frequency=0.5, amplitude=10.0, base=base))
    arm.step(1.0)
    _, swung, beat = swing(np.array(arm.step(4.0))[:, 0], 2.0)
    assert swung == pytest.approx(0.01, rel=0.1)
    assert beat == pytest.approx(0.5, rel=0.1)


def test_a_position_limit_holds_a_compliant_arm_back() -> None:
    base = CartesianImpedance((200.0,) * 3 + (200.0,) * 3)
    mode = SineImpedance(base, bias=[20.0, 0, 0, 0, 0, 0], position_limit=[0.01] + [math.nan] * 5)
    arm = Arm(mode)  # 10 cm without the limit
    seen = np.array(arm.step(2.0))[:, 0]
    assert 0.008 < seen[-1] < 0.01
    assert np.ptp(seen[-300:]) < 1e-4, "no rattle at the limit"
