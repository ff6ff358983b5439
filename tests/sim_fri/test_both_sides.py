"""heptarm's client against heptarm's controller: two state machines without common code."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heptarm.fri.protocol import messages as m
from heptarm.fri.protocol.version import Version
from heptarm.fri.session.events import Kind
from heptarm.sim.fri.faults import FaultyLink, LinkFaults
from heptarm.sim.fri.overlay import CONTROLS, MotionOverlay
from heptarm.sim.fri.settings import SessionConfiguration
from tests.long import few
from tests.oracles.fri.answers import Setpoint
from tests.sim_fri.pair import Pair
from tests.sim_fri.rig import READY, State

LEGAL = [
    (version, mode)
    for version in Version
    for mode in CONTROLS
    if version.traits.quaternions or mode is not m.CommandMode.CARTESIAN_POSE
]


@pytest.mark.parametrize(("version", "mode"), LEGAL)
@pytest.mark.parametrize("receive", few([(1, 3), (5, 1), (1, 1)], 2))
def test_the_two_agree_on_everything(version: Version, mode: m.CommandMode, receive: tuple[int, int]) -> None:
    pair = Pair(SessionConfiguration(version, *receive))
    pair.active(MotionOverlay(mode, CONTROLS[mode][0]))
    session, controller = pair.session, pair.controller
    assert session.mode is mode and session.multiplier == receive[1]
    pair.setpoint = Setpoint(tau=(1.0,) * 7, wrench=(2.0,) * 6)
    pair.run(300)
    assert controller.state is State.COMMANDING_ACTIVE and session.quality is m.Quality.EXCELLENT
    tau, wrench = pair.arm.loads[-1]
    assert (tau is not None) == (mode is m.CommandMode.TORQUE) and (tau is None or tau.tolist() == [1.0] * 7)
    assert (wrench is not None) == (mode is m.CommandMode.WRENCH) and (wrench is None or wrench[0] == 2.0)
    counts = session.counters
    assert counts.lost == counts.missed == counts.malformed == 0
    assert controller.meter.counts.lost == controller.traffic.refused == controller.traffic.stale == 0
    assert session.version in (version, Version.V1_15)


def test_the_arm_follows_the_clients_setpoints() -> None:
    pair = Pair(SessionConfiguration(Version.V2_7))
    pair.active(MotionOverlay())
    for step in range(1, 301):
        pair.setpoint.q = (READY[0] + 5e-4 * step, *READY[1:])
        pair.run(1)
    pair.run(3)
    assert pair.arm.q[0] == pytest.approx(READY[0] + 0.15, abs=1e-12)
    assert np.abs(pair.arm.q[1:] - READY[1:]).max() < 1e-12


@pytest.mark.parametrize("version", Version)
def test_one_client_outlives_a_hundred_sessions(version: Version) -> None:
    pair = Pair(SessionConfiguration(version))
    for _ in range(100 if version is Version.V1_15 else 5):
        pair.active(MotionOverlay())
        pair.run(5)
        pair.controller.close()
        pair.run(2)
        assert pair.session.state is State.IDLE
        pair.renew()
    assert pair.session.counters.malformed == 0


def test_a_session_that_is_torn_off_is_followed_by_another() -> None:
    pair = Pair(SessionConfiguration(Version.V2_7))
    for _ in range(5):
        pair.active(MotionOverlay())
        pair.renew()  # as when the controller's process is killed: no last message
    pair.active(MotionOverlay())
    assert Kind.RESTARTED in {event.kind for event in pair.session.events()}


@given(
    st.sampled_from(Version),
    st.builds(
        LinkFaults,
        loss=st.floats(0, 0.3),
        duplicate=st.floats(0, 0.3),
        corrupt=st.floats(0, 0.1),
        reorder=st.floats(0, 0.2),
        jitter=st.floats(0, 0.01),
        seed=st.integers(0, 1000),
    ),
)
@settings(max_examples=8, deadline=None)
def test_after_any_faults_the_two_find_each_other_again(version: Version, faults: LinkFaults) -> None:
    pair = Pair(SessionConfiguration(version))
    pair.active(MotionOverlay())
    pair.there, pair.back = FaultyLink(faults), FaultyLink(faults)
    pair.run(300)
    assert (pair.arm.leaps <= 1.2 * pair.arm.robot.dq_max * 1e-3 + 1e-12).all()
    pair.there, pair.back = FaultyLink(), FaultyLink()
    pair.controller.stop()
    pair.run(700)  # a counter damaged in transit may silence the client for a moment
    pair.active(MotionOverlay())
