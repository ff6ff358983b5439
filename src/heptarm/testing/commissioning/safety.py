"""Steps: T1, the enabling switch, the emergency stop, and what software may do about them."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.sim.plant.safety_monitor import LASTING
from heptarm.testing.commissioning.person import Person, PersonTask, expect, number
from heptarm.testing.commissioning.step import Comparison, Movement, at_least, at_most, near, same, step
from heptarm.testing.measure import Unfit, fresh, record
from heptarm.testing.stage import HOME
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg
from heptarm.values.tool import Workpiece

#: Highest speed of the flange in T1 [m/s], and what is programmed here.
_T1, _PROGRAMMED = 0.25, 0.3
_A7 = 6
#: As light as nothing: the real flange is empty meanwhile.
_PIECE = Workpiece("heptarm-check", mass=0.01)


@step(
    movement=Movement(
        "The flange",
        "0.15 m along y and back",
        "0.3 m/s programmed, which T1 has to reduce to 0.25 m/s",
        ceiling=0.5,
    ),
    needs=("lin_rel",),
)
def t1_speed(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does T1 slow a motion down instead of refusing or stopping it?"""
    recording = record(arm, lin_rel(y=0.15, frame="base", speed_mps=_PROGRAMMED))
    top = float(np.sort(recording.speeds)[-3]) if len(recording.speeds) > 3 else 0.0
    arm.move(lin_rel(y=-0.15, frame="base", speed_mps=0.1))
    return (
        at_most("highest speed of the flange", top, 1.04 * _T1, "m/s"),
        at_least("highest speed of the flange", top, 0.8 * _T1, "m/s"),
        same(
            "the motion", "arrives" if recording.result.arrived else recording.result.cause.value, "arrives"
        ),
    )


@step(
    movement=Movement(
        "A7",
        "by 90 deg; release the enabling switch on the way when you are asked to",
        "a tenth of its speed",
    ),
    needs=("ptp",),
)
def enabling_switch(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does a released enabling switch pause a motion that software may continue once it is held again?"""
    handle = arm.start(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 90)))
    arm.wait_until(lambda s: s.q[_A7] > np.radians(5), timeout=30.0)
    expect(arm, person, PersonTask.RELEASE, lambda s: not s.safety.enabling_switch, "the released switch")
    arm.wait_until(lambda s: np.abs(s.dq).max() < 1e-2, timeout=10.0)
    ended = handle.done
    expect(arm, person, PersonTask.HOLD, lambda s: s.safety.enabling_switch, "the held switch")
    recovery = arm.recover(timeout=30.0)
    arrives = recovery.done and not ended and handle.wait().arrived
    return (
        same("on release the motion", "ends" if ended else "pauses", "pauses"),
        same("arm.recover() makes the arm", "ready" if recovery.done else "not ready", "ready"),
        same("the motion then", "arrives" if arrives else "is lost", "arrives"),
    )


@step(
    movement=Movement(
        "Nothing but the approach",
        "0 deg",
        "then the arm rests; press the emergency stop when you are asked to",
    )
)
def emergency_stop(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the state show an emergency stop, are outputs refused meanwhile, and may software resume afterwards?"""
    expect(arm, person, PersonTask.PRESS_STOP, lambda s: s.safety.emergency_stop, "the emergency stop")
    lamps = [name for name, signal in arm.io.signals.items() if signal.is_output and signal.kind == "boolean"]
    refused = "no output here"
    if lamps:
        try:
            arm.io.set({lamps[0]: arm.io[lamps[0]]})  # the value that it has: nothing switches
            refused = "written"
        except HeptarmError:
            refused = "refused"
    expect(
        arm,
        person,
        PersonTask.RELEASE_STOP,
        lambda s: not s.safety.emergency_stop,
        "the released emergency stop",
    )
    recovery = arm.recover(timeout=60.0)
    compared = [
        same("after it arm.recover() makes the arm", "ready" if recovery.done else "not ready", "ready")
    ]
    if lamps:
        compared.insert(0, same("an output during the emergency stop is", refused, "refused"))
    return tuple(compared)


@step(needs=("workpieces", "safety_workpieces"))
def workpiece(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the cabinet take a workpiece that no template of the project describes as the safety workpiece?"""
    try:
        with arm.attached(_PIECE, safety=True):
            taken = "taken" if fresh(arm).safety_workpiece == _PIECE.name else "ignored"
    except CommandRejected as error:
        taken = f"refused: {error.text}"
    return (same("a workpiece that a program defines is, as the safety workpiece,", taken, "taken"),)


@step(needs=("safety_workpieces",))
def counted_load(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Which load do the safety functions count, as far as the robot's documents name it?"""
    lasting = number(person, "Time for which an external torque has to last before the arm is stopped", "ms")
    found = [] if lasting is None else [near("time until the stop", lasting, LASTING, 1.0, "ms")]
    asked = (
        ("Does the safety workpiece count until another one or none is set, even if it is detached", "yes"),
        ("Are external torques monitored while the arm rests", "no"),
        (
            "Text of the error when a safety workpiece is heavier than allowed",
            "the safety configuration allows",
        ),
    )
    for question, expected in asked:
        answer = person.reads(question)
        if answer:
            found.append(same(question, answer, expected))
    if not found:
        raise Unfit("no document names it")
    return tuple(found)
