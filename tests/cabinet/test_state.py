"""Pushed states: rates, groups, stamps, ages."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.fake import FakeCabinet
from tests.cabinet.peer import Peer, ptp, run

Connect = Callable[..., Peer]
G = wire.Groups
_FIELDS = {
    G.JOINTS: "joints",
    G.TORQUES: "torques",
    G.POSE: "pose",
    G.WRENCH: "wrench",
    G.MOTION: "motion",
    G.SAFETY: "safety",
}


#: Time constant of the filter of the velocity that the core reports [s].
FILTER = 0.01
#: A machine that is busy with something else wakes the cabinet late, and it skips the states of that time. So tests
#: of rates require at least this fraction of the states; `bench/` measures how exactly rates are kept.
KEPT = 0.2


def stamps(peer: Peer, group: str) -> np.ndarray:
    return np.array([getattr(state, group).stamp for state in peer.all(wire.State)])


def clock(peer: Peer) -> tuple[float, int, float]:
    """The cabinet's time [ns], between two times of this machine [s]."""
    before = time.monotonic()
    number = len(peer.seen) + 1
    peer.send(wire.Ping(sent=number))
    pong = peer.wait_for(wire.Pong, lambda answer: answer.sent == number)
    return before, pong.received, time.monotonic()


def comes_at(seen: np.ndarray, rate: float) -> None:
    """States are due on a grid of the cabinet's clock: at most one for each point of it, in order."""
    assert (np.diff(seen) > 0).all()
    due = (seen[-1] - seen[0]) * 1e-9 * rate
    assert KEPT * due < len(seen) <= due + 2


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_states_come_at_the_rate(connect: Connect, rate: float) -> None:
    peer = connect()
    peer.ask(wire.Subscribe(groups=G.JOINTS | G.MOTION, rate=rate))
    peer.read_for(3.0)
    comes_at(stamps(peer, "joints"), rate)


def carried(state: wire.State) -> set[wire.Groups]:
    return {group for group, field in _FIELDS.items() if getattr(state, field) is not None}


def test_only_the_groups_that_were_asked_for(connect: Connect) -> None:
    peer = connect()
    for chosen in (G.JOINTS, G.POSE | G.SAFETY, G.TORQUES | G.WRENCH | G.MOTION):
        peer.ask(wire.Subscribe(groups=chosen, rate=200.0))
        # some older ones may still arrive; after the first new one no old ones do
        groups = set(chosen)
        peer.wait(lambda _, m: isinstance(m, wire.State) and carried(m) == groups, since=len(peer.seen))  # noqa: B023
        later = peer.wait(lambda _, m: isinstance(m, wire.State), since=len(peer.seen))
        assert carried(later) == set(chosen)
    peer.ask(wire.Subscribe(groups=G.JOINTS, rate=0.0))
    patience = time.monotonic() + 10.0
    while peer.all(wire.State) and time.monotonic() < patience:  # those in transit
        peer.seen.clear()
        peer.read_for(0.3)
    assert not peer.all(wire.State)


def test_a_rate_that_is_too_fast_is_refused(connect: Connect) -> None:
    rejected = connect().ask(wire.Subscribe(groups=G.JOINTS, rate=1000.5))
    assert (rejected.code, rejected.parameter) == (Code.OUT_OF_RANGE, "rate")


def test_two_clients_with_two_rates(connect: Connect) -> None:
    fast, slow = connect(), connect()
    fast.ask(wire.Subscribe(groups=G.JOINTS, rate=500.0))
    slow.ask(wire.Subscribe(groups=G.JOINTS | G.POSE, rate=20.0))
    fast.read_for(1.0)
    slow.read_for(0.02)
    comes_at(stamps(fast, "joints"), 500.0)
    comes_at(stamps(slow, "joints"), 20.0)
    assert all(state.pose is None for state in fast.all(wire.State))


def test_velocity_follows_the_motion(connect: Connect) -> None:
    """The velocity is the filtered difference of the positions by their stamps, independent of the true velocity.

    The fake robot is no measure: it loses time with each tick that a busy machine wakes it late, and lags behind its
    speed of 1 rad/s by that much.
    """
    peer = connect()
    peer.take_control()
    peer.ask(wire.Subscribe(groups=G.JOINTS | G.MOTION, rate=200.0))
    begin = peer.ask(run(ptp(0.0)))  # where other tests left it
    peer.wait_for(wire.MotionFinished, lambda e: e.id == begin.id)
    accepted = peer.ask(run(ptp(0.6)))
    peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)
    last = peer.wait(
        lambda _, m: isinstance(m, wire.State) and m.motion.motion == 0 and abs(m.joints.dq[0]) < 1e-3,
        since=len(peer.seen),
    )
    states = peer.all(wire.State)
    moving = [k for k, state in enumerate(states) if state.motion.motion == accepted.id and k > 0]
    for k in moving:
        before, now = states[k - 1].joints, states[k].joints
        dt = (now.stamp - before.stamp) * 1e-9
        slope = (np.array(now.q) - before.q) / dt
        filtered = before.dq + (1.0 - np.exp(-dt / FILTER)) * (slope - before.dq)
        assert now.dq == pytest.approx(filtered, abs=1e-6)
    assert max(states[k].joints.dq[0] for k in moving) > 0.3
    assert last.joints.q[0] == pytest.approx(0.6)
    peer.ask(run(ptp(0.0)))
    peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id + 1)
    peer.ask(wire.ReleaseControl())


def test_a_cabinet_with_costly_getters_keeps_the_joints_fresh(make: Callable[..., FakeCabinet]) -> None:
    """At 2 ms a reading, not all groups can be had at 100 Hz: slow ones keep their old stamps, joints go first."""
    cabinet = make(getter=0.002)
    with Peer(cabinet.port) as peer:
        peer.ask(wire.Subscribe(groups=G(63), rate=100.0))
        peer.read_for(2.0)  # the costs are measured first
        peer.seen.clear()
        peer.read_for(4.0)
        joints = stamps(peer, "joints")
        seconds = (joints[-1] - joints[0]) * 1e-9
        assert len(joints) > KEPT * 100 * seconds
        fresh = {}
        for group in _FIELDS.values():
            assert (np.diff(stamps(peer, group)) >= 0).all()
            fresh[group] = len(set(stamps(peer, group)) - {0}) / seconds
        assert fresh["joints"] > KEPT * 100
        assert 1 < fresh["safety"] < 15
        assert fresh["pose"] < fresh["joints"]
        assert isinstance(peer.ask(wire.Stop()), wire.Accepted)


def test_states_of_a_fast_clock(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make(rate=5.0)
    with Peer(cabinet.port) as peer:
        peer.ask(wire.Subscribe(groups=G.JOINTS, rate=100.0))
        peer.wait_for(wire.State)
        first = clock(peer)
        peer.read_for(1.0)
        last = clock(peer)
        seen = stamps(peer, "joints")
        comes_at(seen, 100.0)
        received = last[1] + 5.0e9 * (last[2] - last[0])  # at the latest, by the cabinet's clock
        assert seen[-1] < received and seen[-1] - seen[0] > 0.5 * (last[1] - first[1])
        # however long each question was under way
        passed = (last[1] - first[1]) * 1e-9
        assert 5.0 * (last[0] - first[2]) - 1e-3 < passed < 5.0 * (last[2] - first[0]) + 1e-3
