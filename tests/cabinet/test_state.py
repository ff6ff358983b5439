"""Pushed state: rates, groups, stamps, ages."""

from __future__ import annotations

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


def patiently(peer: Peer, seconds: float, check: Callable[[], None], tries: int = 5) -> None:
    """Reads for a while, then checks; again, with fresh states, where the machine was busy with something else."""
    for attempt in range(tries):
        peer.seen.clear()
        peer.read_for(seconds)
        try:
            return check()
        except AssertionError:
            if attempt + 1 == tries:
                raise


def stamps(peer: Peer, group: str) -> np.ndarray:
    return np.array([getattr(state, group).stamp for state in peer.all(wire.State)])


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_states_come_at_the_rate(connect: Connect, rate: float) -> None:
    peer = connect()
    peer.ask(wire.Subscribe(groups=G.JOINTS | G.MOTION, rate=rate))

    def check() -> None:
        seen = stamps(peer, "joints")
        assert (np.diff(seen) > 0).all()
        due = (seen[-1] - seen[0]) * 1e-9 * rate + 1
        assert 0.5 * due < len(seen) < 1.1 * due  # a busy machine misses some
        assert np.median(np.diff(seen)) == pytest.approx(1e9 / rate, rel=0.15)

    patiently(peer, 1.0, check)


def carried(state: wire.State) -> set[wire.Groups]:
    return {group for group, field in _FIELDS.items() if getattr(state, field) is not None}


def test_only_the_groups_that_were_asked_for(connect: Connect) -> None:
    peer = connect()
    for chosen in (G.JOINTS, G.POSE | G.SAFETY, G.TORQUES | G.WRENCH | G.MOTION):
        peer.ask(wire.Subscribe(groups=chosen, rate=200.0))
        # some of the ones before may still be on their way; behind the first of these come no others
        peer.wait(lambda _, m, g=chosen: isinstance(m, wire.State) and carried(m) == set(g), since=len(peer.seen))
        later = peer.wait(lambda _, m: isinstance(m, wire.State), since=len(peer.seen))
        assert carried(later) == set(chosen)
    peer.ask(wire.Subscribe(groups=G.JOINTS, rate=0.0))

    def check() -> None:
        assert not peer.all(wire.State)

    patiently(peer, 0.3, check)


def test_a_rate_that_is_too_fast_is_refused(connect: Connect) -> None:
    rejected = connect().ask(wire.Subscribe(groups=G.JOINTS, rate=1000.5))
    assert (rejected.code, rejected.parameter) == (Code.OUT_OF_RANGE, "rate")


def test_two_clients_with_two_rates(connect: Connect) -> None:
    fast, slow = connect(), connect()
    fast.ask(wire.Subscribe(groups=G.JOINTS, rate=500.0))
    slow.ask(wire.Subscribe(groups=G.JOINTS | G.POSE, rate=20.0))

    def check() -> None:
        slow.read_for(0.02)
        count = len(slow.all(wire.State))
        slow.seen.clear()
        assert len(fast.all(wire.State)) == pytest.approx(500, rel=0.1)
        assert count == pytest.approx(20, abs=3)

    slow.read_for(0.02)
    slow.seen.clear()
    patiently(fast, 1.0, check)
    assert all(state.pose is None for state in fast.all(wire.State))


def test_velocity_follows_the_motion(connect: Connect) -> None:
    peer = connect()
    peer.take_control()
    peer.ask(wire.Subscribe(groups=G.JOINTS | G.MOTION, rate=200.0))
    begin = peer.ask(run(ptp(0.0)))  # wherever other tests left it
    peer.wait_for(wire.MotionFinished, lambda e: e.id == begin.id)
    accepted = peer.ask(run(ptp(0.6)))
    peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id)
    last = peer.wait(
        lambda _, m: isinstance(m, wire.State) and m.motion.motion == 0 and abs(m.joints.dq[0]) < 1e-3,
        since=len(peer.seen),
    )
    moving = [s for s in peer.all(wire.State) if s.motion.motion == accepted.id]
    assert np.median([s.joints.dq[0] for s in moving[10:]]) == pytest.approx(
        1.0, abs=0.1
    )  # the fake robot's speed
    assert last.joints.q[0] == pytest.approx(0.6)
    peer.ask(run(ptp(0.0)))
    peer.wait_for(wire.MotionFinished, lambda e: e.id == accepted.id + 1)
    peer.ask(wire.ReleaseControl())


def test_a_cabinet_with_costly_getters_keeps_the_joints_fresh(make: Callable[..., FakeCabinet]) -> None:
    """At 2 ms a reading, not all groups can be had at 100 Hz: slow ones keep their old stamps, joints go first."""
    cabinet = make(getter=0.002)
    with Peer(cabinet.port) as peer:
        peer.ask(wire.Subscribe(groups=G(63), rate=100.0))
        peer.read_for(2.0)  # costs are learnt

        def check() -> None:
            assert len(peer.all(wire.State)) > 60
            fresh = {}
            for group in _FIELDS.values():
                assert (np.diff(stamps(peer, group)) >= 0).all()
                fresh[group] = len(set(stamps(peer, group))) / 2.0
            assert fresh["joints"] > 30
            assert 2 < fresh["safety"] < 15
            assert fresh["pose"] < fresh["joints"]

        patiently(peer, 2.0, check)
        assert isinstance(peer.ask(wire.Stop()), wire.Accepted)


def test_states_of_a_fast_clock(make: Callable[..., FakeCabinet]) -> None:
    cabinet = make(rate=5.0)
    with Peer(cabinet.port) as peer:
        peer.ask(wire.Subscribe(groups=G.JOINTS, rate=100.0))

        def check() -> None:
            assert len(stamps(peer, "joints")) == pytest.approx(500, rel=0.15)
            assert np.median(np.diff(stamps(peer, "joints"))) == pytest.approx(1e7, rel=0.1)

        patiently(peer, 1.0, check)
