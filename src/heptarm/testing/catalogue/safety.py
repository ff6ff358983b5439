"""Scenarios: faults, how they are reported, and how work continues after them."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import HeptarmError, MotionAborted, NeedsOperator
from heptarm.testing.measure import below, holds, near, note, record
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from heptarm.values.result import Cause
from heptarm.values.state import OperationMode

_FAR = ptp(HOME + deg(50, 0, 0, 0, 0, 0, 0), speed=0.3)


def _under_way(arm: Arm) -> MotionHandle:
    handle = arm.start(_FAR)
    arm.wait_until(lambda s: abs(s.dq[0]) > 0.1 or handle.done, timeout=20.0)
    return handle


def _ends(handle: MotionHandle, what: str) -> MotionAborted:
    try:
        handle.wait()
    except MotionAborted as error:
        note(error.text)
        return error
    holds(False, f"{what} ends the motion with an error")
    raise AssertionError


@scenario(line=10, rows="", risk=Risk.FAULT, operator=True, space=0.5)
def stops(arm: Arm) -> None:
    """Emergency stop, safeguard, safety stop: the arm brakes and reports the cause and what a person has to do."""
    for name, step in (
        ("emergency_stop", "release the emergency stop"),
        ("operator_safety", "close the safeguard"),
        ("protective_stop", "remove the cause of the safety stop"),
    ):
        handle = _under_way(arm)
        arm.operator.do(name)
        holds(_ends(handle, name).cause is Cause.SAFETY, f"{name} is the cause")
        state = arm.wait_until(lambda s: not s.safety.brakes_open, timeout=20.0)
        holds(
            not state.safety.ready_to_move and bool(state.safety.stops),
            f"state: {', '.join(state.safety.stops)}",
        )
        try:
            arm.move(ptp(HOME))
            holds(False, "a motion is refused")
        except NeedsOperator as error:
            holds(step in error.instructions, f"a person has to {error.instructions}")
        holds(not arm.recover().done, "software does not lift it")
        arm.operator.clear()
        arm.wait_until(lambda s: not s.safety.protective_stop, timeout=20.0)
        holds(arm.recover(timeout=10.0).done, "then software may recover")
        holds(arm.move(ptp(HOME)).arrived, "and it continues")


@scenario(line=10, rows="G17", risk=Risk.FAULT, operator=True, space=0.8)
def modes(arm: Arm) -> None:
    """T1 is slow and requires the enabling switch: released, the arm pauses; held and recovered, it continues."""
    arm.operator.choose("t1")
    arm.operator.hold()
    arm.wait_until(lambda s: s.safety.mode is OperationMode.T1 and s.safety.enabling_switch, timeout=20.0)
    holds(arm.recover(timeout=10.0).done, "ready in T1")
    handle = arm.start(ptp(HOME + deg(80, 0, 0, 0, 0, 0, 0)))
    fastest = 0.0
    for state in arm.states(rate=100):
        turn = abs(float(state.dq[0])) if np.isfinite(state.dq[0]) else 0.0
        fastest = max(fastest, turn * float(np.hypot(*state.pose.xyz[:2])))
        if state.q[0] > np.radians(10) or handle.done:
            break
    below(fastest, 0.26, "speed in T1", unit="m/s")
    arm.operator.release()
    rests = arm.wait_until(lambda s: s.safety.paused and np.abs(s.dq).max() < 1e-3, timeout=20.0)
    holds(not handle.done and not rests.safety.ready_to_move, "it pauses")
    arm.operator.hold()
    holds(arm.recover(timeout=10.0).done and handle.wait().arrived, "it continues and arrives")


@scenario(line=10, rows="G20 B15", risk=Risk.FAULT, operator=True, space=0.5)
def errors(arm: Arm) -> None:
    """Drive errors, joint limits and singularities end a motion, each with its code."""
    for words, expected, code in (
        ("drive_error 3", "drive error in A3", 62),
        ("joint_limit 4", "limit A4", 50),
        ("singularity", "singularity", 53),
    ):
        handle = _under_way(arm)
        arm.operator.do(words)
        error = _ends(handle, words)
        holds(expected in error.text and error.code == code, f"code {error.code}")
        arm.wait_for_rest(timeout=20.0)
        holds(arm.recover(timeout=10.0).done, "recovered")
        holds(arm.move(ptp(HOME)).arrived, "the next motion arrives")


@scenario(line=10, rows="F12", risk=Risk.FAULT, operator=True, space=0.2)
def manual_override(arm: Arm) -> None:
    """The override of the smartPAD also slows motions down."""
    there = ptp(HOME + deg(0, 0, 0, 0, 0, 0, 30), speed=0.3)
    full = record(arm, there).moving
    arm.operator.override(0.3)
    slow = record(arm, ptp(HOME, speed=0.3)).moving
    arm.operator.override(1.0)
    near(slow / full, 2.5, 1.0, "at 0.3 it takes as many times as long")


@scenario(line=10, rows="B10", risk=Risk.FREE, space=0.5, virtual=True, needs=("ptp",))
def observer(arm: Arm) -> None:
    """Another client observes, cannot move the arm, and can stop it."""
    from heptarm.arm.connect import connect
    from heptarm.errors import NotInControl

    host = arm.connection.link.peer
    with connect(host, control=False, name="scenario-observer", timeout=20.0) as other:
        try:
            other.move(ptp(HOME))
            holds(False, "an observer does not move the arm")
        except NotInControl as error:
            note(error.text)
        handle = _under_way(arm)
        other.wait_until(lambda s: s.motion is not None and s.motion.id == handle.id, timeout=20.0)
        other.stop("fast")
        holds(_ends(handle, "an observer's stop").cause is Cause.STOPPED, "stopped by an observer")
    arm.wait_for_rest()


@scenario(line=10, rows="", risk=Risk.FREE, space=0.5, needs=("ptp",))
def kinds(arm: Arm) -> None:
    """A stop after the motion finishes it and drops the queue."""
    first, second = arm.start(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 20))), arm.start(ptp(HOME))
    first.wait_started(20.0)
    arm.stop("after_motion")
    holds(first.wait().arrived, "what runs finishes")
    try:
        second.wait()
        holds(False, "what waits is dropped")
    except HeptarmError as error:
        note(error.text)
    near(arm.wait_for_rest().q[6], np.radians(20), 1e-3, "A7", unit="rad")
