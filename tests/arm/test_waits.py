"""A wait looks at the safety state, and ends with its reason."""

from __future__ import annotations

import threading
import time

import pytest

import heptarm as ha
from heptarm.wire.messages import SafetyBits
from tests.arm.peer import Peer

STOPPED = SafetyBits.EMERGENCY_STOP | SafetyBits.PROTECTIVE_STOP


def later(peer: Peer, bits: SafetyBits) -> threading.Timer:
    """Report other bits a moment later."""

    def change() -> None:
        peer.safety = bits

    timer = threading.Timer(0.1, change)
    timer.start()
    return timer


@pytest.mark.parametrize(
    ("bits", "reason"),
    [
        (STOPPED, "emergency stop"),
        (SafetyBits.OPERATOR_SAFETY_OPEN, "safeguard open"),
        (SafetyBits.PROTECTIVE_STOP, "safety stop"),
        (SafetyBits.RECOVERY_REQUIRED, "recovery required"),
    ],
)
def test_a_wait_ends_with_the_reason_of_a_stop_that_begins_meanwhile(
    peer: Peer, bits: SafetyBits, reason: str
) -> None:
    with peer.arm() as arm:
        timer = later(peer, bits)
        with pytest.raises(ha.SafetyStop, match=f"the wait ended at a safety stop: {reason}"):
            arm.wait_until(lambda state: state.q[0] > 1.0, timeout=600.0)
        timer.join()
        peer.safety = SafetyBits.READY_TO_MOVE


def test_a_wait_for_rest_ends_at_a_stop_that_is_active_already(peer: Peer) -> None:
    peer.motion = 3  # waits for the end of the stop
    peer.safety = STOPPED
    with peer.arm() as arm:
        with pytest.raises(ha.SafetyStop, match="emergency stop"):
            arm.wait_for_rest(timeout=600.0)
        peer.motion = 0


def test_a_wait_for_the_end_of_a_stop_goes_on(peer: Peer) -> None:
    peer.safety = STOPPED
    with peer.arm() as arm:
        began = time.monotonic()

        def is_free(state: ha.State) -> bool:
            if time.monotonic() - began > 1.5:
                peer.safety = SafetyBits.READY_TO_MOVE
            return not state.safety.emergency_stop

        assert arm.wait_until(is_free, timeout=600.0).safety.ready_to_move


def test_a_wait_for_the_stop_itself_and_for_what_follows_returns(peer: Peer) -> None:
    peer.motion = 3
    with peer.arm() as arm:
        timer = later(peer, STOPPED)
        assert arm.wait_until(lambda state: state.safety.emergency_stop, timeout=600.0)
        timer.join()

        def ended(state: ha.State) -> bool:
            peer.motion = 0
            return not state.motion.active

        assert arm.wait_until(ended, timeout=600.0)


def test_a_pause_does_not_end_a_wait_but_is_named_when_it_takes_too_long(peer: Peer) -> None:
    peer.safety = SafetyBits.PAUSED
    with peer.arm() as arm, pytest.raises(ha.Timeout, match=r"within 1\.5 s: paused"):
        arm.wait_until(lambda state: state.q[0] > 1.0, timeout=1.5)
