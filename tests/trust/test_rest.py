"""A virtual cabinet at rest: its clock, its states and its reactions are those of one that is awake."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest

import heptarm as ha
from bench.measure.cabinet import Cabinet
from heptarm import Arm

#: A machine that is busy wakes the cabinet late; see tests/cabinet/test_state.py.
PATIENCE = 60.0


@pytest.fixture(scope="module")
def cabinet() -> Iterator[Cabinet]:
    with Cabinet(real_time="off") as cabinet:
        yield cabinet


@pytest.fixture
def resting(cabinet: Cabinet) -> Iterator[Arm]:
    """The arm, at rest."""
    with ha.connect(cabinet.target, watchdog=5.0, timeout=30.0, state_rate=50) as arm:
        arm.wait_for_rest()
        rest(cabinet)
        yield arm


def rest(cabinet: Cabinet) -> None:
    """Wait until time passes without simulation."""
    deadline = time.monotonic() + PATIENCE
    before = cabinet.stats()
    while time.monotonic() < deadline:
        time.sleep(0.2)
        now = cabinet.stats()
        if now["ticks"] == before["ticks"] and now["rested"] > before["rested"]:
            return
        before = now
    raise AssertionError(f"the cabinet does not rest: {before}")


def test_states_at_rest_are_on_the_grid_of_their_rate_and_all_the_same(
    resting: Arm, cabinet: Cabinet
) -> None:
    resting.subscribe(rate=1000)
    states = list(resting.states(duration=1.0, size=5000))[1:]
    stamps = np.array([state.stamp for state in states])
    assert (np.diff(stamps) > 0).all() and (np.diff(stamps) % 1_000_000 == 0).all()
    assert len(states) > 100 and (np.ptp([state.q for state in states], axis=0) < 1e-6).all()
    assert all(state.safety.ready_to_move for state in states)
    rest(cabinet)  # also while it is observed


def test_observers_of_several_rates_get_their_states_at_rest(resting: Arm, cabinet: Cabinet) -> None:
    rates = (40, 125, 500)
    with ExitStack() as stack:
        arms = [
            stack.enter_context(ha.connect(cabinet.target, control=False, timeout=30.0, state_rate=rate))
            for rate in rates
        ]
        streams = [arm.states(duration=1.0, size=5000) for arm in arms]
        for stream, rate in zip(streams, rates, strict=True):
            stamps = np.array([one.stamp for one in stream])[1:]
            period = round(1e9 / rate)
            steps = np.diff(stamps)
            held_up = (
                steps > 1.5 * period
            )  # the state that was due then comes as soon as this machine has time
            assert len(stamps) > 0.2 * rate and (steps > 0).all()
            assert ((stamps[1:] % period == 0) | held_up).all()
        rest(cabinet)


def test_the_clock_goes_on_at_rest(resting: Arm) -> None:
    def ahead() -> float:
        """How much more time has passed on its clock than on ours [s]; a state that waited makes it larger."""
        began, first = time.monotonic(), resting.state.stamp
        time.sleep(1.0)
        last = resting.wait_until(lambda s: s.stamp > first + 500_000_000, timeout=PATIENCE).stamp
        return 1e-9 * (last - first) - (time.monotonic() - began)

    assert min(ahead() for _ in range(3)) <= 0.1


def test_a_motion_from_rest_arrives_and_the_arm_rests_again(resting: Arm, cabinet: Cabinet) -> None:
    target = resting.state.q + ha.deg(0, 0, 0, 5, 0, 0, 0)
    assert resting.move(ha.ptp(target)).arrived
    assert np.abs(resting.state.q - target).max() < 1e-3
    rest(cabinet)
    assert resting.move(ha.ptp(target - ha.deg(0, 0, 0, 5, 0, 0, 0))).arrived


def test_a_stop_at_rest_is_seen_and_ends(resting: Arm, cabinet: Cabinet) -> None:
    cabinet.operate("emergency_stop")
    resting.wait_until(lambda s: s.safety.emergency_stop, timeout=PATIENCE)
    rest(cabinet)  # with closed brakes
    cabinet.operate("clear")
    resting.wait_until(lambda s: not s.safety.emergency_stop, timeout=PATIENCE)
    resting.recover(timeout=PATIENCE)
    assert resting.move(ha.ptp(resting.state.q + ha.deg(0, 0, 0, 1, 0, 0, 0))).arrived


def test_a_push_at_rest_is_felt(resting: Arm, cabinet: Cabinet) -> None:
    cabinet.operate("push 0 0 -20")
    resting.wait_until(lambda s: s.wrench.force[2] < -10, timeout=PATIENCE)
    cabinet.operate("push 0 0 0")
    resting.wait_until(lambda s: abs(s.wrench.force[2]) < 1, timeout=PATIENCE)


def test_an_override_at_rest_counts_for_the_next_motion(resting: Arm) -> None:
    resting.set_override(0.5)
    resting.wait_until(lambda s: abs(s.motion.override - 0.5) < 1e-9, timeout=PATIENCE)
    assert resting.move(ha.ptp(resting.state.q + ha.deg(0, 0, 0, 1, 0, 0, 0))).arrived
    resting.set_override(1.0)
