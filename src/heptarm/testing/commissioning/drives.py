"""Steps: the drives' own supervision. No step makes a drive trip: what cannot be measured without is read or asked."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.sim.plant.drive_monitor import BEYOND, LAG, SPEED, TORQUE, TORQUE_TICKS
from heptarm.testing.commissioning.person import Person, PersonTask, number
from heptarm.testing.commissioning.step import Comparison, Movement, at_most, largest, near, same, step
from heptarm.testing.measure import Unfit, record
from heptarm.testing.stage import HOME
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg

#: Part of the assumed threshold that a slow motion may use.
_PART = 0.4


@step(
    movement=Movement("The arm", "A1, A4 and A6 by 20 deg and back", "a tenth of every axis' speed"),
    needs=("ptp",),
)
def following_error(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Do the axes follow their set-points closely enough for the assumed threshold?"""
    recording = record(arm, [ptp(HOME + deg(20, 0, 0, 20, 0, -20, 0)), ptp(HOME)])
    lag = largest(recording.q_cmd - recording.q)
    return (at_most("largest distance of set-point and measured position", lag, _PART * LAG, "rad"),)


@step()
def thresholds(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """At which speed, position and torque does a drive trip, as far as the robot's documents name it?"""
    asked = (
        ("Speed at which a drive trips, as a multiple of the axis' highest speed", SPEED, 0.05, "1"),
        ("Angle beyond the position limit at which a drive trips", float(np.degrees(BEYOND)), 0.1, "deg"),
        ("Torque beyond which a drive trips, as a multiple of the axis' highest torque", TORQUE, 0.05, "1"),
        ("Time for which that torque has to last", float(TORQUE_TICKS), 1.0, "ms"),
    )
    found = []
    for question, expected, by, unit in asked:
        value = number(person, question, unit)
        if value is not None:
            found.append(near(question, value, expected, by, unit))
    if not found:
        raise Unfit("no document names the thresholds")
    return tuple(found)


@step()
def message(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """What is the text of a drive's error?"""
    text = person.reads("Text of the newest error of a drive in the log of the smartPAD")
    if not text:
        raise Unfit("no drive has tripped yet; run this step again after the first time")
    return (same("text of the error", text, "drive error in A1"),)


@step()
def acknowledging(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the cabinet's application acknowledge an error of a drive by software?"""
    if not person.finds(PersonTask.FIND_DRIVE_ERROR):
        raise Unfit("no drive has tripped; run this step again when one has")
    arm.wait_until(lambda s: not s.safety.ready_to_move, timeout=20.0)
    person.does(PersonTask.HOLD)
    recovery = arm.recover(timeout=20.0)
    return (same("after arm.recover() the arm is", "ready" if recovery.done else "not ready", "ready"),)


@step()
def med_torques(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Are the highest torques of an LBR Med those of the iiwa?"""
    if "med" not in arm.robot.name:
        raise Unfit(f"the {arm.robot.title} is no LBR Med")
    found = []
    for axis, torque in enumerate(arm.robot.tau_max.tolist(), 1):
        value = number(person, f"Highest torque of A{axis} in the data sheet", "Nm")
        if value is not None:
            found.append(near(f"highest torque of A{axis}", value, torque, 0.5, "Nm"))
    if not found:
        raise Unfit("no data sheet is at hand")
    return tuple(found)
