"""Cartesian impedance and overlaid forces through the whole stack: API, TCP, Java application, doubles, plant."""

from __future__ import annotations

import numpy as np
import pytest

import heptarm as ha
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.sine import SineImpedance
from tests.simulators import FASTER

#: Of the shared virtual cabinet.
SPEED = FASTER
HOME = ha.deg(0, 30, 0, -90, 0, 60, 0)
COMPLIANT = (500.0, 1000.0, 2000.0, 200.0, 200.0, 200.0)


def pushed(arm: ha.Arm, seconds: float, *, after: float = 0.0) -> np.ndarray:
    """Positions of the flange while the arm holds, off its set-point, base frame, shape (n, 3) [m].

    Args:
        seconds: of the cabinet.
        after: so many of them are left out at first.
    """
    seen = []
    begin = arm.state.stamp
    for state in arm.states():
        if state.stamp > begin + after * 1e9:
            seen.append(state.pose.xyz - state.pose_cmd.xyz)
        if state.stamp > begin + seconds * 1e9:
            break
    return np.array(seen)


@pytest.mark.parametrize(("direction", "index"), [("x", 0), ("y", 1)])
def test_a_constant_force_bends_the_arm_by_force_over_stiffness(
    arm: ha.Arm, direction: str, index: int
) -> None:
    mode = SineImpedance.force(**{direction: 20.0}, base=CartesianImpedance(COMPLIANT, frame="base"))
    handle = arm.start(ha.hold(), mode=mode)
    arm.wait_until(
        lambda state: abs(state.pose.xyz - state.pose_cmd.xyz)[index] > 0.8 * 20.0 / COMPLIANT[index]
    )
    travel = pushed(arm, 1.5)
    handle.cancel()
    handle.wait()
    expected = np.zeros(3)
    expected[index] = 20.0 / COMPLIANT[index]
    assert travel[-1] == pytest.approx(expected, abs=0.02 * 20.0 / COMPLIANT[index] + 2e-4)


def test_an_additional_force_and_one_that_swings(arm: ha.Arm) -> None:
    base = CartesianImpedance(
        (2000.0,) * 3 + (200.0,) * 3, additional_force=(0, 0, -20, 0, 0, 0), frame="base"
    )
    mode = SineImpedance.sine("y", frequency=0.5, amplitude=40.0, base=base)
    handle = arm.start(ha.hold(), mode=mode)
    travel = pushed(arm, 3.0, after=0.5)
    handle.cancel()
    handle.wait()
    assert travel[:, 1].max() == pytest.approx(0.02, abs=2e-3)
    assert travel[:, 1].min() == pytest.approx(-0.02, abs=2e-3)
    assert travel[-1, 2] == pytest.approx(-0.01, abs=1e-3)


def test_motions_are_done_in_every_mode_and_the_arm_is_stiff_afterwards(arm: ha.Arm) -> None:
    for mode in (
        JointImpedance(500.0),
        CartesianImpedance(),
        SineImpedance.lissajous("yz", frequency=1.0, amplitude=5.0).timed(hold_time=0.4, fall_time=0.1),
        SineImpedance.spiral("xy", frequency=2.0, amplitude=5.0, total_time=0.6),
    ):
        with arm.using(mode):
            assert arm.move([ha.lin_rel(z=-0.03), ha.lin_rel(z=0.03)])
        assert arm.move(ha.ptp(HOME)).residual < 2e-3


def test_a_limit_on_the_deviation_stops_the_motion_and_reports_it(arm: ha.Arm) -> None:
    base = CartesianImpedance(
        (500.0,) * 3 + (200.0,) * 3, max_deviation=(0.01, 0.01, 0.01, 1, 1, 1), frame="base"
    )
    with pytest.raises(ha.MotionAborted, match="deviation"):
        arm.move(ha.hold(5.0), mode=SineImpedance.force(x=20.0, base=base))
    assert arm.move(ha.ptp(HOME))


def test_a_force_limit_that_stops(arm: ha.Arm) -> None:
    base = CartesianImpedance(
        (2000.0,) * 3 + (200.0,) * 3,
        max_force=(10.0, 10.0, 10.0, 300, 300, 300),
        max_force_stops=True,
        frame="base",
    )
    with pytest.raises(ha.MotionAborted, match="force"):
        arm.move(ha.hold(5.0), mode=SineImpedance.force(x=30.0, base=base))
    assert arm.move(ha.ptp(HOME))


def test_what_the_cabinet_does_not_know_is_refused_before_anything_moves(arm: ha.Arm) -> None:
    before = arm.state.q
    with pytest.raises(ha.CommandRejected, match="somewhere"):
        arm.move(ha.lin_rel(z=-0.05), mode=CartesianImpedance(frame="somewhere"))
    assert arm.state.q == pytest.approx(before, abs=1e-3)
