"""Blended items through the core: reported one by one, and refused with the same texts as without blending."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.cabinet.peer import Peer, ptp, run
from tests.cabinet.test_programs import finished

Connect = Callable[..., Peer]
FAILS_AT_PLANNING, FAILS_ON_THE_WAY = 1.25, 1.5
OPEN = wire.JointDynamics(velocity=(math.nan,) * 7, acceleration=(math.nan,) * 7, jerk=(math.nan,) * 7)


@pytest.fixture
def peer(connect: Connect) -> Iterator[Peer]:
    peer = connect()
    peer.take_control()
    peer.ask(wire.SetOverride(value=1.0))
    finished(peer, peer.ask(run(ptp())))
    yield peer
    peer.ask(wire.Stop())
    peer.ask(wire.ReleaseControl())


def blended(*q: float) -> wire.Item:
    item = ptp(*q)
    assert isinstance(item.motion, wire.Ptp)
    return replace(item, motion=replace(item.motion, blending=wire.Blending(relative=0.2)))


def events(peer: Peer, accepted: wire.Accepted) -> list[tuple[str, int]]:
    return [
        (type(m).__name__, m.item)
        for _, m in peer.seen
        if getattr(m, "id", None) == accepted.id and type(m).__name__ in ("MotionStarted", "MotionFinished")
    ]


def test_every_item_of_a_batch_is_reported(peer: Peer) -> None:
    accepted = peer.ask(run(blended(0.02), blended(0.04), blended(0.02), ptp(0.0), blended(0.02)))
    assert finished(peer, accepted).cause == wire.Cause.FINISHED
    assert events(peer, accepted) == [*(("MotionStarted", i) for i in range(5)), ("MotionFinished", 4)]


@pytest.mark.parametrize(
    ("a7", "code"), [(FAILS_AT_PLANNING, Code.UNREACHABLE), (FAILS_ON_THE_WAY, Code.EXECUTION_FAILED)]
)
def test_a_failure_in_a_batch_ends_the_program(peer: Peer, a7: float, code: int) -> None:
    accepted = peer.ask(run(blended(0.02), blended(0.0, 0, 0, 0, 0, 0, a7), blended(0.0), ptp(0.0)))
    end = finished(peer, accepted)
    assert (end.cause, end.code) == (wire.Cause.FAILED, code)
    assert finished(peer, peer.ask(run(ptp(0.0)))).cause == wire.Cause.FINISHED


def test_cancelling_ends_the_whole_batch(peer: Peer) -> None:
    accepted = peer.ask(run(blended(2.0), blended(-2.0), ptp(2.0)))
    peer.wait_for(wire.MotionStarted, lambda e: e.id == accepted.id)
    peer.ask(wire.Cancel(id=accepted.id))
    end = finished(peer, accepted)
    assert end.cause == wire.Cause.CANCELLED and 0.0 <= end.q[0] < 1.0


def test_points_of_a_joint_spline_are_checked_before_anything_moves(peer: Peer) -> None:
    point = wire.JointPoint(q=(0.0,) * 7, dynamics=OPEN)
    bad = replace(point, q=(0.0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0))
    item = replace(ptp(0.0), motion=wire.JointSpline(points=(point, bad), dynamics=OPEN))
    refused = peer.ask(run(item))
    assert refused.code == Code.JOINT_LIMIT
    assert refused.parameter == "items[0].motion.points[1].q[1]"
    empty = replace(ptp(0.0), motion=wire.JointSpline(points=(), dynamics=OPEN))
    assert isinstance(peer.ask(run(empty)), wire.Rejected)
