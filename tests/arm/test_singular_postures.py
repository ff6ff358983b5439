"""Postures that people teach, where a pose leaves joints free: streams and motions of the pose leave them alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import heptarm as ha
from heptarm import model
from tests.long import few

#: Degrees, and how joints went before.
ROUND = {
    "to 60,0,0,-90,0,60,0": (20, 0, 40, -90, 0, 60, 0),
    "A5 by 122": (0, 30, 0, -60, 50, 0, -20),
    "by 184": (20, 0, 40, 0, -20, 0, 10),
    "A5 by 132": (0, 45, 0, -90, 0, 0, 0),
    "candle": (0, 0, 0, 0, 0, 0, 0),
}
#: How far a joint may move [rad]; noisy sensors tell a pose no better.
STAYS, STAYS_WITH_NOISE = ha.deg(0.01)[0], ha.deg(0.1)[0]

#: An arm with noisy sensors is never at rest, which costs five times the processor time: every run has ideal sensors
#: here, and noise in tests/sim/test_singular_postures.py.
either = pytest.mark.parametrize("sensors", few(["ideal", "noisy"]), indirect=True)


@pytest.fixture(scope="module")
def sensors(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def arm(sensors: str) -> Iterator[ha.Arm]:
    with ha.connect(f"sim://iiwa14?speed=3&sensors={sensors}", timeout=60.0, watchdog=5.0) as connected:
        yield connected


@pytest.mark.parametrize("name", few(ROUND, 2))
@pytest.mark.parametrize("sensors", ["ideal"], indirect=True)
def test_a_stream_of_its_own_pose_and_a_motion_to_it_move_nothing(arm: ha.Arm, name: str) -> None:
    streams_its_own_pose(arm, ROUND[name], STAYS)


@pytest.mark.long
@pytest.mark.parametrize("name", ROUND)
@pytest.mark.parametrize("sensors", ["noisy"], indirect=True)
def test_with_noisy_sensors_they_move_hardly_anything(arm: ha.Arm, name: str) -> None:
    streams_its_own_pose(arm, ROUND[name], STAYS_WITH_NOISE)


def streams_its_own_pose(arm: ha.Arm, degrees: tuple[float, ...], allowed: float) -> None:
    arm.move(ha.ptp(ha.deg(*degrees)))
    before = arm.wait_for_rest().q_cmd
    with arm.servo("pose", rate=100, watchdog=2.0) as sv:
        while sv.tick() and sv.t < 5.0:
            sv.set(sv.start.pose)
            assert np.abs(arm.state.q_cmd - before).max() <= allowed
    arm.move(ha.ptp(arm.wait_for_rest().pose))
    assert np.abs(arm.wait_for_rest().q_cmd - before).max() <= allowed
    arm.move(ha.ptp(arm.state.pose, near=ha.deg(*degrees)))
    assert np.abs(arm.wait_for_rest().q_cmd - before).max() <= allowed


@either
def test_the_pose_of_home_needs_no_swing(arm: ha.Arm) -> None:
    start = ha.deg(10, 20, 5, -40, 0, 40, 5)
    arm.move(ha.ptp(start))
    arm.wait_for_rest()
    arm.move(ha.ptp(ha.Pose.from_matrix(model.forward(arm.robot, np.zeros(7)))))
    assert np.abs(arm.wait_for_rest().q_cmd - start).max() <= ha.deg(40.1)[0]


@either
def test_a_stream_into_the_candle_moves_the_joints_that_it_needs(arm: ha.Arm) -> None:
    start = ha.deg(0, 5, 0, -10, 0, 5, 0)
    arm.move(ha.ptp(start))
    arm.wait_for_rest()
    with arm.servo("pose", rate=100, watchdog=2.0) as sv:
        while sv.tick() and sv.t < 4.0:
            part = max(0.0, 1.0 - sv.t / 3.0)
            sv.set(ha.Pose.from_matrix(model.forward(arm.robot, part * start)))
            assert np.abs(arm.state.q_cmd - start).max() <= ha.deg(10.5)[0]


@either
def test_e1_is_the_angle_of_a3(arm: ha.Arm) -> None:
    start = ha.deg(0, 20, 0, -110, 0, -40, 90)
    arm.move(ha.ptp(start))
    state = arm.wait_for_rest()
    assert state.redundancy.e1 == state.q[2]
    for e1 in ha.deg(-80, 0).tolist():  # as KUKA's sample moves in the null space
        arm.move(ha.lin(state.pose, redundancy=ha.Redundancy(e1=e1, status=state.redundancy.status)))
        assert arm.wait_for_rest().q_cmd[2] == pytest.approx(e1, abs=1e-3)
