"""Scenarios: contacts with people and objects."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.testing.catalogue.modes import held, let_go
from heptarm.testing.measure import Unfit, above, baseline, below, fresh, holds, near, watch
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import DEEPEST, HOME
from heptarm.values.condition.force import Force, force
from heptarm.values.condition.reaction import Retreat
from heptarm.values.condition.signals import io
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.result import Cause
from heptarm.values.tool import Workpiece

_LONG = 60.0


@scenario(
    line=8,
    rows="H6 H7 G18",
    risk=Risk.CONTACT,
    operator=True,
    space=0.2,
    needs=("conditions", "joint_impedance"),
)
def reaction(arm: Arm) -> None:
    """A collision ends a motion at once, then the arm is compliant; the result shows the collision."""
    bump = force > 20
    handle = arm.start(lin_rel(y=0.15, frame="base", speed_mps=0.03), until=bump)
    arm.wait_until(lambda s: np.linalg.norm(s.dq) > 0.01, timeout=20.0)
    arm.operator.start_push((0.0, -28.0, 0.0), duration=_LONG)
    result = handle.wait()
    holds(result.cause is Cause.CONDITION and result.stopped_by == bump, f"ended by {result.stopped_by}")
    arm.operator.start_push((0.0, -9.0, 0.0), duration=_LONG)
    arm.wait_until(lambda s: np.abs(s.tau_ext).max() < 8.0, timeout=20.0)
    rests = arm.wait_for_rest()
    compliant = held(arm, JointImpedance(300.0))
    watch(arm, 0.5)
    above(fresh(arm).pose.distance_to(rests.pose), 5e-3, "then a light push moves it by", unit="m")
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    let_go(arm, compliant)


@scenario(line=8, rows="H1 H8", risk=Risk.CONTACT, operator=True, space=0.2, needs=("cartesian_impedance",))
def plane(arm: Arm) -> None:
    """Compliant in one plane only; guided too far, the arm moves back by itself."""
    start = arm.wait_for_rest()
    mode = CartesianImpedance((200.0, 200.0, 5000.0, 300.0, 300.0, 300.0), damping=0.9, frame="base")
    compliant = held(arm, mode)
    arm.operator.start_push((0.0, 14.0, -14.0), duration=_LONG)
    led = arm.wait_until(lambda s: s.pose.distance_to(start.pose) > 0.05, timeout=20.0)
    offset = led.pose.xyz - start.pose.xyz
    above(abs(float(offset[1])), 0.045, "guided in the plane by", unit="m")
    below(abs(float(offset[2])), 0.006, "across it by", unit="m")
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    back = arm.start(ptp(HOME, speed=0.3), when="replace")
    holds(compliant.wait().cause is Cause.REPLACED and back.wait().arrived, "it returned")
    near(arm.wait_for_rest().q, HOME, 2e-3, "home", unit="rad")


@scenario(
    line=8, rows="H7 H3", risk=Risk.CONTACT, space=0.3, needs=("conditions", "lin_rel", "joint_impedance")
)
def relaxing(arm: Arm) -> None:
    """At a contact the cabinet lets the arm relax, or move back along its path; the result has the forces."""
    contact = force > 15
    arm.move(lin_rel(z=-0.05, frame="base", speed_mps=0.1), until=contact)
    down = lin_rel(z=-DEEPEST + 0.05, frame="base", speed_mps=0.03)
    relaxed = arm.move(down, until=contact, then="relax")
    if relaxed.stopped_by is None:
        raise Unfit(f"there is no table within {DEEPEST - 0.05:g} m below the flange")
    above(relaxed.peak_force, 13.0, "largest force", unit="N")
    below(relaxed.rest_force, 0.7 * relaxed.peak_force, "force after relaxing", unit="N")
    arm.move(lin_rel(z=0.02, frame="base", speed_mps=0.1))
    retreated = arm.move(down, until=contact, then=Retreat(0.01))
    holds(retreated.stopped_by == contact and retreated.fired_at is not None, "it touched again")
    assert retreated.fired_at is not None
    back = float(arm.wait_for_rest().pose.xyz[2] - retreated.fired_at.pose.xyz[2])
    near(back, 0.01, 0.004, "it moved back by", unit="m")
    below(retreated.rest_force, 8.0, "force then", unit="N")


@scenario(line=8, rows="H14 H18", risk=Risk.CONTACT, operator=True, space=0.02)
def waits(arm: Arm) -> None:
    """The arm waits for a contact in the pushed states."""
    rest = baseline(arm).force
    arm.operator.start_push((0.0, 0.0, -12.0), duration=0.5)
    state = arm.wait_until(lambda s: s.wrench.force[2] - rest[2] < -8.0, timeout=20.0)
    near(state.wrench.force[:2], rest[:2], 3.0, "it came from above: force across", unit="N")
    arm.wait_until(lambda s: abs(s.wrench.force[2] - rest[2]) < 2.0, timeout=20.0)


@scenario(line=8, rows="H15 H13 I5", risk=Risk.CONTACT, operator=True, space=0.3,
          needs=("conditions", "workpieces", "io"), signals=("MediaFlange.UserButton",))  # fmt: skip
def pick(arm: Arm) -> None:
    """Pick and place: down to the table, up with a workpiece, wait for a button, put it down."""
    start = arm.wait_for_rest().pose
    contact = Force(frame="base").along("z") > 8
    part = Workpiece("scenario-part", mass=0.8, com=(0.0, 0.0, 0.03))
    down = lin_rel(z=-DEEPEST + 0.05, frame="base", speed_mps=0.15)
    result = arm.move(down, until=contact)
    if result.stopped_by is None:
        raise Unfit("there is no table below the flange")
    arm.move(lin_rel(z=0.03, frame="base", speed_mps=0.2))
    arm.wait_for_rest()
    with arm.attached(part):
        aside = Pose.of(start.xyz + [0.0, 0.12, 0.0], start.quat)
        arm.move(lin(aside, speed_mps=0.4))
        waiting = arm.start(hold(_LONG), until=io.user_button)
        arm.wait_until(lambda _: waiting.started, timeout=20.0)
        arm.operator.set_signal("UserButton", True)
        holds(waiting.wait().stopped_by == io.user_button, "a person pressed the button")
        arm.operator.set_signal("UserButton", False)
        holds(arm.move(down, until=contact).stopped_by == contact, "put down on the table")
        arm.wait_for_rest()
    holds(fresh(arm).workpiece == "", "the hand is empty")
    arm.move([lin_rel(z=0.1, frame="base", speed_mps=0.4), ptp(HOME + deg(0, 0, 0, 0, 0, 0, 1))])


@scenario(line=8, rows="H11", risk=Risk.CONTACT, operator=True, space=0.2, needs=("joint_impedance",))
def led(arm: Arm) -> None:
    """A compliant arm is guided by hand and stays where it was guided: the measured pose becomes the set-point."""
    start = arm.wait_for_rest()
    with arm.servo(
        "joint", rate=50, speed=0.5, acceleration=1.0, mode=JointImpedance(200.0), watchdog=2.0
    ) as servo:
        arm.operator.start_push((0.0, 20.0, 0.0), duration=1.0)
        first = arm.state.stamp
        while servo.tick() and arm.state.stamp < first + 1.5e9:
            servo.set(arm.state.q)
    there = arm.wait_for_rest()
    above(there.pose.distance_to(start.pose), 0.02, "guided by", unit="m")
    near(fresh(arm, after=0.2).pose.xyz, there.pose.xyz, 2e-3, "and it stays there", unit="m")
