"""Stops, modes and errors through the whole stack: results of motions, states, recovery."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import heptarm as ha
from heptarm import Arm
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from heptarm.values.state import OperationMode
from tests.conftest import RunningCabinet

HOME = deg(0, 30, 0, -90, 0, 60, 0)
AWAY = deg(70, 30, 0, -90, 0, 60, 0)
FAR = ptp(AWAY, speed=0.3)


@pytest.fixture(scope="module")
def desk() -> Iterator[Arm]:
    """A simulator whose operator these tests play; in real time, since they check the states meanwhile."""
    with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
        yield arm


@pytest.fixture
def safe(desk: Arm) -> Iterator[Arm]:
    """At home, in automatic mode, nothing pressed; restored afterwards."""
    _tidy(desk)
    desk.move(ptp(HOME))
    yield desk
    _tidy(desk)


def _tidy(arm: Arm) -> None:
    for words in ("clear", "release", "aut", "override 1"):
        arm.operator.do(words)
    arm.stop()
    assert arm.recover(timeout=20.0).done
    arm.set_override(1.0)
    arm.wait_for_rest()


def under_way(arm: Arm, handle: ha.MotionHandle) -> ha.MotionHandle:
    arm.wait_until(lambda s: np.abs(s.dq).max() > 0.1, timeout=20.0)
    return handle


@pytest.mark.parametrize(
    ("fault", "expected_text", "step"),
    [
        ("emergency_stop", "emergency stop", "release the emergency stop"),
        ("external_emergency_stop", "emergency stop", "release the emergency stop"),
        ("operator_safety", "safeguard", "close the safeguard"),
        ("protective_stop", "safety function", "remove the cause of the safety stop"),
    ],
)
def test_a_stop_ends_what_runs_and_waits(safe: Arm, fault: str, expected_text: str, step: str) -> None:
    handle = under_way(safe, safe.start(FAR))
    waiting = safe.start(ptp(HOME))
    safe.operator.do(fault)
    for one in (handle, waiting):
        with pytest.raises(ha.MotionAborted, match=expected_text) as ended:
            one.wait(timeout=20.0)
        assert ended.value.cause is ha.Cause.SAFETY and ended.value.code == 62
    state = safe.wait_until(lambda s: not s.safety.brakes_open, timeout=20.0)
    seen = state.safety
    assert not seen.ready_to_move and seen.paused and seen.protective_stop
    assert seen.emergency_stop is ("emergency" in fault)
    assert seen.operator_safety_open is (fault == "operator_safety")
    with pytest.raises(ha.NeedsOperator, match=step) as refused:
        safe.move(ptp(HOME))
    assert step in refused.value.instructions
    left = safe.recover()
    assert not left.done and any(step in one for one in left.remaining)
    safe.operator.clear()
    safe.wait_until(lambda s: not s.safety.protective_stop, timeout=20.0)
    with pytest.raises(ha.SafetyStop, match="recover"):
        safe.move(ptp(HOME))  # no motion starts by itself when the button is released
    done = safe.recover()
    assert done.done and done.did and not done.remaining
    assert safe.state.safety.ready_to_move
    assert safe.move(ptp(HOME)).arrived


def test_recover_waits_for_a_person(safe: Arm) -> None:
    safe.operator.fault("emergency_stop")
    safe.wait_until(lambda s: s.safety.emergency_stop, timeout=20.0)
    timer = threading.Timer(0.6, safe.operator.clear)
    timer.start()
    assert safe.recover(timeout=30.0).done
    timer.join()
    assert safe.recover() == ha.Recovery(done=True)  # nothing had to be done


def test_the_enabling_switch_pauses_a_motion(safe: Arm) -> None:
    safe.operator.choose("t2")
    safe.wait_until(lambda s: s.safety.mode is OperationMode.T2, timeout=20.0)
    with pytest.raises(ha.NeedsOperator, match="enabling switch"):
        safe.move(FAR)
    safe.operator.hold()
    assert safe.recover(timeout=20.0).done
    handle = under_way(safe, safe.start(FAR))
    safe.operator.release()
    rests = safe.wait_until(lambda s: s.safety.paused and np.abs(s.dq).max() < 1e-3, timeout=20.0)
    assert not handle.done and not rests.safety.ready_to_move and not rests.safety.enabling_switch
    left = safe.recover()
    assert not left.done and "enabling switch" in str(left)
    safe.operator.hold()
    time.sleep(0.3)
    assert not handle.done and np.abs(safe.state.q - rests.q).max() < 1e-3  # holding it is not enough
    recovery = safe.recover(timeout=20.0)
    assert recovery.done and any(f"motion {handle.id} go on" in one for one in recovery.did)
    assert handle.wait(timeout=20.0).arrived


def test_start_at_the_smartpad_lets_a_paused_motion_go_on(safe: Arm) -> None:
    handle = under_way(safe, safe.start(FAR))
    safe.operator.do("pause")
    safe.wait_until(lambda s: s.safety.paused and np.abs(s.dq).max() < 1e-3, timeout=20.0)
    assert not handle.done
    safe.operator.start()
    assert handle.wait(timeout=20.0).arrived


def test_a_pause_of_the_operator_stays_when_control_is_taken(safe: Arm) -> None:
    safe.release_control()
    safe.operator.do("pause")
    safe.wait_until(lambda s: s.safety.paused, timeout=20.0)
    time.sleep(0.5)  # a motion that begins while the speed goes to 0 moves until then
    safe.take_control()
    handle = safe.start(ptp(AWAY))
    rests = safe.state
    time.sleep(0.3)
    assert not handle.done and np.abs(safe.state.q - rests.q).max() < 1e-3
    safe.operator.start()
    assert handle.wait(timeout=20.0).arrived


def test_t1_is_slow(safe: Arm) -> None:
    safe.operator.choose("t1")
    safe.operator.hold()
    safe.wait_until(lambda s: s.safety.mode is OperationMode.T1 and s.safety.enabling_switch, timeout=20.0)
    assert safe.recover(timeout=20.0).done
    fastest = 0.0
    handle = safe.start(ptp(AWAY))
    for state in safe.states(rate=100):
        if handle.done:
            break
        turn = abs(state.dq[0]) if np.isfinite(state.dq[0]) else 0.0
        fastest = max(fastest, float(turn * np.hypot(*state.pose.xyz[:2])))
    assert handle.wait(timeout=30.0).arrived
    assert 0.2 < fastest < 0.26


def test_the_manual_override_slows_down(safe: Arm) -> None:
    full = safe.move(FAR).duration
    safe.operator.override(0.5)
    assert safe.move(ptp(HOME, speed=0.3)).duration > 1.4 * full


@pytest.mark.parametrize(
    ("words", "expected_text", "code"),
    [
        ("drive_error 3", "drive error in A3", 62),
        ("push 0 0 -2000 0.05", r"drive error in A\d: (velocity|.*behind)", 62),  # the drive itself trips
        ("joint_limit 4", "limit A4", 50),
        ("singularity", "singularity", 53),
    ],
)
def test_errors_end_a_motion(safe: Arm, words: str, expected_text: str, code: int) -> None:
    handle = under_way(safe, safe.start(FAR))
    safe.operator.do(words)
    with pytest.raises(ha.MotionAborted, match=expected_text) as ended:
        handle.wait(timeout=20.0)
    trips = code == 62
    assert ended.value.cause is (ha.Cause.SAFETY if trips else ha.Cause.FAILED)
    assert ended.value.code == code
    state = safe.wait_for_rest(timeout=20.0)
    assert state.safety.ready_to_move is not trips
    recovery = safe.recover()  # an error of the drives may be acknowledged by software
    assert recovery.done and bool(recovery.did) is trips
    assert safe.move(ptp(HOME)).arrived


def test_a_servo_motion_ends_with_a_stop(safe: Arm) -> None:
    servo = safe.servo("joint", rate=100, watchdog=2.0)
    with pytest.raises(ha.MotionAborted, match="safeguard") as ended, servo:
        timer = threading.Timer(0.5, safe.operator.fault, ("operator_safety",))
        timer.start()
        while servo.tick() and servo.t < 20.0:
            servo.set(servo.start.q + 0.2 * np.sin(servo.t))
    timer.join()
    assert ended.value.cause is ha.Cause.SAFETY
    safe.wait_for_rest(timeout=20.0)


@pytest.mark.parametrize("motion", [FAR, lin_rel(z=-0.25, frame="base", speed_mps=0.1), hold(20.0)])
@pytest.mark.parametrize("kind", ["path", "fast"])
def test_stop_from_another_thread_while_a_move_blocks(safe: Arm, motion: object, kind: Any) -> None:
    def stop() -> None:
        safe.wait_until(lambda s: s.motion is not None and s.motion.active, timeout=20.0)
        for _ in range(3):
            safe.stop(kind)
            time.sleep(0.05)

    stopper = threading.Thread(target=stop)
    stopper.start()
    with pytest.raises(ha.MotionAborted) as ended:
        safe.move(motion, timeout=30.0)  # type: ignore[arg-type]
    stopper.join()
    assert ended.value.cause is ha.Cause.STOPPED
    safe.wait_for_rest(timeout=20.0)


def test_stop_after_motion_lets_it_finish(safe: Arm) -> None:
    first = under_way(safe, safe.start(FAR))
    second = safe.start(ptp(HOME))
    safe.stop("after_motion")
    assert first.wait(timeout=20.0).arrived
    with pytest.raises(ha.MotionAborted) as dropped:
        second.wait(timeout=20.0)
    assert dropped.value.cause is ha.Cause.STOPPED


def test_an_observer_stops_what_another_controls(safe: Arm) -> None:
    handle = under_way(safe, safe.start(FAR))
    host = safe.connection.cabinet
    assert host is not None
    with ha.connect(f"sim://{host.host}:{host.port}", control=False) as other:
        other.stop("fast")
        with pytest.raises(ha.MotionAborted):
            handle.wait(timeout=20.0)
        left = other.recover()  # another client is in control
        assert not left.done and "release control" in left.remaining[0]
        with pytest.raises(ha.CommandRejected, match="operator"):
            _ = other.operator


def test_faults_may_be_timed() -> None:
    with ha.connect("sim://iiwa14?fault=operator_safety@1.0", timeout=30.0) as arm:
        arm.wait_until(lambda s: s.safety.operator_safety_open, timeout=30.0)
        assert arm.state.stamp > 0.9e9


def test_a_fault_that_is_none_is_refused() -> None:
    with pytest.raises(ha.ConnectFailed, match="not understood"):
        ha.connect("sim://iiwa14?fault=explosion@1")


def test_recover_reconnects(cabinet: RunningCabinet) -> None:
    arm = ha.connect(cabinet.target, watchdog=5.0)
    try:
        arm.connection.link.cut()
        deadline = time.monotonic() + 30.0
        while arm.connected and time.monotonic() < deadline:
            time.sleep(0.02)
        assert not arm.connected
        recovery = arm.recover(timeout=20.0)
        assert recovery.done and "made a new connection" in recovery.did
        assert arm.in_control and arm.connected
    finally:
        arm.close()
