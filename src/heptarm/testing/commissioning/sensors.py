"""Steps: what the torque sensors measure while nothing touches the arm."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.testing.commissioning.person import Person
from heptarm.testing.commissioning.step import Comparison, Movement, at_most, largest, step
from heptarm.testing.measure import watch

#: Error of an external torque that heptarm assumes where the cabinet reports none [Nm].
_TORQUE_ERROR = 0.5
#: Error of a force that the same error of torques makes at home, with a margin [N].
_FORCE_ERROR = 5.0
#: How long the arm is watched [s].
_TIME = 2.0


@step(movement=Movement("Nothing but the approach", "0 deg", "then the arm rests"))
def external_torques(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Are the external torques of a free arm at rest as small as assumed?"""
    states = watch(arm, _TIME)
    torques = np.array([state.tau_ext for state in states])
    forces = np.array([state.wrench.force for state in states])
    return (
        at_most("largest external torque, nothing touches the arm", largest(torques), _TORQUE_ERROR, "Nm"),
        at_most("standard deviation of the external torques", largest(torques.std(axis=0)), 0.2, "Nm"),
        at_most("largest external force", largest(forces), _FORCE_ERROR, "N"),
    )
