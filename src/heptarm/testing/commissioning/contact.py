"""Steps: how far the arm deforms under a weight, how it is guided, and what it does where it touches something."""

from __future__ import annotations

import numpy as np

from heptarm import model
from heptarm.arm.arm import Arm
from heptarm.sim.control_laws.cartesian_impedance import GUIDED_STIFFNESS
from heptarm.sim.control_laws.laws import GUIDED, STIFFNESS
from heptarm.skills.touch import touch
from heptarm.testing.commissioning.person import PATIENCE, Person, PersonTask, expect
from heptarm.testing.commissioning.step import Comparison, Movement, at_least, at_most, near, step
from heptarm.testing.measure import Unfit, watch
from heptarm.testing.stage import DEEPEST
from heptarm.values.checks import Array
from heptarm.values.mode.compliance import compliance
from heptarm.values.mode.impedance import CartesianImpedance
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.motion import hold
from heptarm.when import force

#: Weight that the person attaches to the flange, and its mass [N, kg].
WEIGHT, MASS = 9.81, 1.0
#: Force at which a motion onto the block ends [N], its speed [m/s], and the distance that it has before [m].
_FORCE, _SLOWLY, _ABOVE = 15.0, 0.01, 0.01
#: Times for which the arm is watched under a weight, and after its end [s].
_HANGING, _SWINGING = 3.0, 1.0
_UP = 0.05
#: A weight pulls the flange down by so much, of which the first part does not count [m].
_FALL, _BEGINNING = 0.1, 0.02
#: Depth at which the controller ends a fall that this program has not ended, as a deviation from the set-point [m].
_DEEPEST_FALL = 0.15
#: Time for which a compliant arm is watched without a weight [s].
_FREE = 0.5


def hang(arm: Arm, person: Person, before: Array) -> None:
    """Let a person hang the weight on the flange.

    Args:
        arm: at rest.
        person: hangs it.
        before: external force without it, base axes, shape (3,) [N].

    Raises:
        Unfit: no force shows.
    """
    expect(
        arm,
        person,
        PersonTask.HANG,
        lambda s: before[2] - s.wrench.force[2] > 0.5 * WEIGHT,
        "the weight's force",
    )


@step(
    movement=Movement(
        "Nothing but the approach",
        "0 deg",
        f"then the arm holds its position; hang {MASS:g} kg on the flange and drop it when you are asked to",
    )
)
def stiffness(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the flange sink under a weight as far as the assumed stiffness of the axes gives, and stay there?"""
    rest = watch(arm, 0.5)
    q = np.array([state.q for state in rest]).mean(axis=0)
    height = float(np.mean([state.pose.z for state in rest]))
    hang(arm, person, np.mean([state.wrench.force for state in rest], axis=0))
    hanging = watch(arm, _HANGING)
    sinks = [height - state.pose.z for state in hanging]
    early, late = (
        float(np.mean(sinks[len(sinks) // 3 : len(sinks) // 2])),
        float(np.mean(sinks[-len(sinks) // 5 :])),
    )
    down = model.jacobian(arm.robot, q)[2]
    expected = WEIGHT * float(np.sum(down**2 / STIFFNESS))
    person.does(PersonTask.DROP)
    arm.wait_until(lambda s: s.wrench.force[2] > -0.5 * WEIGHT, timeout=60.0)
    swinging = watch(arm, _SWINGING)
    above = max(state.pose.z for state in swinging) - height
    return (
        near("the measured flange sinks by", 1000 * late, 1000 * expected, 500 * expected, "mm"),
        at_least("part of it that is left after two seconds", late / early if early else 0.0, 0.8),
        at_most("without the weight it swings above its height by", above / expected, 0.5),
        at_most(
            "and comes back to it within", 1000 * abs(swinging[-1].pose.z - height), 100 * expected, "mm"
        ),
    )


def _sinking() -> CartesianImpedance:
    """Vertically compliant. The controller itself ends a fall, by its depth or speed, if this program does not."""
    mode = compliance("z", frame="base")
    return CartesianImpedance(
        mode.stiffness,
        damping=mode.damping,
        nullspace_stiffness=mode.nullspace_stiffness,
        max_velocity=mode.max_velocity,
        max_deviation={"z": _DEEPEST_FALL},
        frame=mode.frame,
    )


@step(
    movement=Movement(
        "The flange",
        f"down by {_DEEPEST_FALL:g} m at most, pulled by the weight",
        f"{1000 * GUIDED[0]:g} mm/s; the arm is compliant vertically: hang {MASS:g} kg on the flange and drop it "
        "and drop it when you are asked to",
    ),
    needs=("cartesian_impedance",),
)
def guiding(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does a direction without stiffness resist a weight as assumed, by a critical damper, below the bound of speed?"""
    handle = arm.start(hold(PATIENCE), mode=_sinking())
    handle.wait_started(PATIENCE)
    free = watch(arm, _FREE)
    begin = free[-1].pose.z
    across = model.jacobian(arm.robot, free[-1].q)
    person.does(PersonTask.HANG)
    falling = []
    for state in handle.states():
        falling.append(state)
        if state.pose.z < begin - _FALL:
            break
    handle.cancel()
    handle.wait()
    person.does(PersonTask.DROP)
    steady = [state for state in falling if state.pose.z < begin - _BEGINNING]
    if len(steady) < 3:
        raise Unfit(f"the weight moved the flange by less than {_FALL:g} m within {PATIENCE:g} s")
    seconds = np.array([state.stamp - steady[0].stamp for state in steady]) * 1e-9
    speed = -float(np.polyfit(seconds, [state.pose.z for state in steady], 1)[0])
    inertia = np.linalg.inv(across @ np.linalg.inv(model.mass_matrix(arm.robot, free[-1].q)) @ across.T)
    damper = 2.0 * float(np.sqrt(GUIDED_STIFFNESS[2] * inertia[2, 2]))
    return (
        at_most("without the weight it sinks by", 1000 * abs(begin - free[0].pose.z), 10.0, "mm"),
        near("weight by the speed with which it sinks", WEIGHT / speed, damper, 0.5 * damper, "N s/m"),
        at_most("which is", speed, GUIDED[0], "m/s"),
    )


def _above_block(arm: Arm, person: Person) -> None:
    """Bring the flange closely above the block."""
    person.does(PersonTask.PLACE_BLOCK)
    touch(arm, "-z", distance=DEEPEST, force=_FORCE, frame="base", speed_mps=0.02, retreat=_ABOVE)
    arm.wait_for_rest()


@step(
    movement=Movement(
        "The flange", f"down onto the block, by {DEEPEST:g} m at most, and up again", "20 mm/s"
    ),
    needs=("lin_rel",),
)
def stopping(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does a force condition end a motion as soon as assumed, and does the arm brake within the motion's limits?"""
    _above_block(arm, person)
    down = lin_rel(z=-3 * _ABOVE, frame="base", speed_mps=_SLOWLY)
    handle = arm.start(down, until=force > _FORCE)
    states = tuple(handle.states())
    result = handle.wait()
    rest = arm.wait_for_rest()
    down_to = rest.pose_cmd.z
    forces = [float(np.linalg.norm(state.wrench.force)) for state in states]
    # The force is above the threshold for a few milliseconds: states at a low rate may all miss them.
    reached = min(_FORCE, 0.95 * max(forces))
    first = next(state for state, felt in zip(states, forces, strict=True) if felt >= reached)
    arm.move(lin_rel(z=_UP, frame="base", speed_mps=0.05))
    return (
        at_most(
            f"largest force of a motion at {1000 * _SLOWLY:g} mm/s that ends at {_FORCE:g} N",
            result.peak_force,
            1.6 * _FORCE,
            "N",
        ),
        at_most(
            "the set-point goes on behind the contact by",
            1000 * (first.pose_cmd.z - down_to),
            1.0,
            "mm",
        ),
        at_least("force that is left at rest", result.rest_force, 0.4 * _FORCE, "N"),
    )


@step(
    movement=Movement(
        "The flange", f"down onto the block, by {DEEPEST:g} m at most, and up again", "20 mm/s"
    ),
    needs=("lin_rel", "joint_impedance"),
)
def relaxing(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the arm, after a contact, go on without force at the position where it is?"""
    _above_block(arm, person)
    result = arm.move(
        lin_rel(z=-3 * _ABOVE, frame="base", speed_mps=_SLOWLY), until=force > _FORCE, then="relax"
    )
    rest = arm.wait_for_rest()
    apart = float(np.abs(rest.q_cmd - rest.q).max())
    arm.move(lin_rel(z=_UP, frame="base", speed_mps=0.05))
    return (
        at_most("force that is left at rest", result.rest_force, 5.0, "N"),
        at_most("set-point and measured position are apart by", 1000 * apart, 1.0, "mrad"),
    )
