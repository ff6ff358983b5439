"""Recovering and arriving, against a scripted cabinet in memory."""

from __future__ import annotations

import pytest

import heptarm as ha
from heptarm.values.mode.impedance import JointImpedance
from heptarm.wire import messages as wire
from heptarm.wire.codes import Code
from tests.arm.peer import Peer

HOME = ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0))
STEPS = "release the emergency stop; close the safeguard"


def test_what_is_left_comes_step_by_step(peer: Peer) -> None:
    peer.expect(wire.Recover, wire.Rejected(code=Code.NEEDS_OPERATOR, text=STEPS))
    with peer.arm() as arm:
        left = arm.recover()
    assert not left.done and left.remaining == ("release the emergency stop", "close the safeguard")
    assert str(left) == f"not ready: {STEPS}"


def test_it_tries_again_while_there_is_time(peer: Peer) -> None:
    for _ in range(2):
        peer.expect(wire.Recover, wire.Rejected(code=Code.NEEDS_OPERATOR, text=STEPS))
    peer.expect(wire.Recover, wire.Accepted(id=0))
    with peer.arm() as arm:
        assert arm.recover(timeout=30.0).done


def test_a_cabinet_that_cannot_recover_reports_it(peer: Peer) -> None:
    peer.expect(wire.Recover, wire.Rejected(code=Code.UNSUPPORTED, text="not here"))
    with peer.arm() as arm, pytest.raises(ha.CommandRejected, match="not here"):
        arm.recover()


def test_another_ones_control_is_left_to_people(peer: Peer) -> None:
    taken = wire.Rejected(code=Code.CONTROL_TAKEN, text="eve (session 7) controls this robot")
    with peer.arm() as arm:
        arm.connection.in_control = False
        arm.connection.controller = "eve"
        peer.expect(wire.TakeControl, taken)
        assert arm.recover().remaining == ("let eve release control",)


def test_a_closed_arm_recovers_nothing(peer: Peer) -> None:
    arm = peer.arm()
    arm.close()
    with pytest.raises(ha.ConnectionLost):
        arm.recover()
    with pytest.raises(ha.LimitError):
        arm.recover(timeout=-1.0)


def test_a_stiff_arm_that_ends_short_of_its_target_has_not_arrived(peer: Peer) -> None:
    peer.runs(5, wire.MotionStarted(id=5, item=0), peer.finished(5, residual=0.1))
    with peer.arm() as arm, pytest.raises(ha.ArrivalError, match=r"5\.7 deg short") as short:
        arm.move(HOME)
    assert short.value.cause is ha.Cause.FINISHED and short.value.value == 0.1
    assert "blocks the arm" in short.value.hint


def test_a_compliant_arm_may_yield(peer: Peer) -> None:
    peer.runs(5, wire.MotionStarted(id=5, item=0), peer.finished(5, residual=0.1))
    with peer.arm() as arm:
        assert arm.move(HOME, mode=JointImpedance(300.0)).arrived


def test_a_motion_that_could_not_begin_needs_an_operator(peer: Peer) -> None:
    peer.runs(
        5, peer.finished(5, wire.Cause.FAILED, code=Code.NEEDS_OPERATOR, text="hold the enabling switch")
    )
    with peer.arm() as arm, pytest.raises(ha.NeedsOperator, match="enabling switch") as error:
        arm.move(HOME)
    assert "hold the enabling switch" in error.value.instructions
