"""Steps: what the sensors measure while nothing touches the arm, and of a known weight."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.sim.plant.sensor_errors import FRICTION, POSITION_NOISE, TORQUE_NOISE, TORQUE_STEP
from heptarm.testing.commissioning.contact import WEIGHT, hang
from heptarm.testing.commissioning.person import Person, PersonTask
from heptarm.testing.commissioning.step import Comparison, Movement, at_most, largest, near, step
from heptarm.testing.measure import Unfit, record, watch
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg

#: Error of an external torque that heptarm assumes where the cabinet reports none [Nm].
_TORQUE_ERROR = 0.5
#: Error of a force that the same error of torques makes at home, with a margin [N].
_FORCE_ERROR = 5.0
#: How long the arm is watched [s].
_TIME = 2.0
#: Largest error of a weight [N] and longest time in which its force disappears [ms] that count as agreement.
_WEIGHED, _FALL = 1.5, 30.0
#: A1 turns by this to show its friction [deg].
_TURN = 20.0
#: Stiffness of A1 meanwhile [Nm/rad].
_STIFFNESS = 200.0


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


def _smallest_step(values: Array) -> float:
    """Smallest difference of two values that a sensor has shown; 0 if it shows only one."""
    steps = np.diff(np.unique(values))
    return float(steps.min()) if len(steps) else 0.0


@step(movement=Movement("Nothing but the approach", "0 deg", "then the arm rests"))
def noise(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Are noise and resolution of torques and positions as small as assumed?"""
    states = watch(arm, _TIME)
    torques = np.array([state.tau for state in states])
    positions = np.array([state.q for state in states])
    ranges = arm.robot.tau_max
    return (
        at_most(
            "noise of the torques, part of the axis' highest torque",
            largest(torques.std(axis=0) / ranges),
            2 * TORQUE_NOISE,
        ),
        at_most("smallest step of the torque of A7", _smallest_step(torques[:, 6]), 1.1 * TORQUE_STEP, "Nm"),
        at_most(
            "noise of the positions", 1000 * largest(positions.std(axis=0)), 2000 * POSITION_NOISE, "mrad"
        ),
    )


@step(
    movement=Movement(
        "Nothing but the approach",
        "0 deg",
        "then the arm rests; hang 1 kg on the flange and drop it when you are asked to",
    )
)
def weight(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Is the force of a known weight measured exactly, and how late?"""
    before = np.mean([state.wrench.force for state in watch(arm, 0.5)], axis=0)
    hang(arm, person, before)
    watch(arm, 1.0)  # a weight swings for a while
    measured = float(before[2] - np.mean([state.wrench.force[2] for state in watch(arm, _TIME)]))
    pushed = arm.states(duration=60.0)
    high = low = 0
    for state in pushed:
        if not high:
            person.does(PersonTask.DROP)
        part = (before[2] - state.wrench.force[2]) / measured
        high = state.stamp if part > 0.9 or not high else high
        if part < 0.1:
            low = state.stamp
            break
    pushed.close()
    if not low:
        raise Unfit("the weight was not dropped within 60 s")
    return (
        near("force of a weight of 9.81 N", measured, WEIGHT, _WEIGHED, "N"),
        at_most("it falls from 90 to 10 % within", (low - high) * 1e-6, _FALL, "ms"),
    )


@step(
    movement=Movement(
        "A1, in joint impedance of 200 Nm/rad,", f"by {_TURN:g} deg and back", "a tenth of its speed"
    ),
    needs=("ptp", "joint_impedance"),
)
def friction(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Is the friction that the controller leaves in an axis as small as assumed?"""
    compliant = JointImpedance(_STIFFNESS)

    def lag(to: float) -> float:
        """Mean distance of set-point and position in the middle of a motion [rad]."""
        seen = record(arm, ptp(HOME + deg(to, 0, 0, 0, 0, 0, 0)), mode=compliant)
        part = np.degrees(seen.q_cmd[:, 0] - HOME[0]) / _TURN
        return float((seen.q_cmd - seen.q)[(part > 0.35) & (part < 0.65), 0].mean())

    # in both directions the arm lags behind by the friction; half of the difference leaves offsets out
    found = 0.5 * abs(lag(_TURN) - lag(0.0)) * _STIFFNESS
    return (at_most("friction left in A1", found, 2 * FRICTION * float(arm.robot.tau_max[0]), "Nm"),)
