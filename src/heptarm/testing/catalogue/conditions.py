"""Scenarios: break conditions, monitored by the cabinet."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.testing.measure import above, baseline, below, fresh, holds, near, note, record
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.condition.condition import Condition
from heptarm.values.condition.force import Force, force, torque
from heptarm.values.condition.signals import Path, io, path
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.result import Cause


@scenario(line=4, rows="H3 H5 B14", risk=Risk.CONTACT, operator=True, space=0.05, needs=("conditions",))
def forces(arm: Arm) -> None:
    """Force: magnitude, along an axis, across an axis, component; each condition fires only at its push."""
    base, rest = Force(frame="base"), baseline(arm)
    leaves: tuple[tuple[Condition, tuple[float, float, float]], ...] = (
        (force > 15, (0.0, 14.0, 18.0)),
        (base.normal("z") > 12, (0.0, 0.0, -20.0)),
        (base.shear("z") > 12, (0.0, 20.0, 0.0)),
        (base.along("y").outside(-5, 12), (0.0, 20.0, 0.0)),
    )
    for condition, push in leaves:
        handle = arm.start(hold(30.0), until=condition)
        arm.operator.start_push(np.multiply(push, 1 / 3), duration=30.0)
        third = 0.25 * float(np.linalg.norm(push))
        while float(np.linalg.norm(arm.state.wrench.force - rest.force)) < third and not handle.done:
            fresh(arm)
        holds(not handle.done, f"a third of it is not enough for {condition}")
        arm.operator.start_push(push, duration=30.0)
        result = handle.wait(timeout=30.0)
        holds(
            result.cause is Cause.CONDITION and result.stopped_by == condition, f"fired: {result.stopped_by}"
        )
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
        arm.wait_until(lambda s: np.linalg.norm(s.wrench.force - rest.force) < 2.0, timeout=20.0)
    holds(arm.move(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 5))).arrived, "the next motion has no condition")


@scenario(line=4, rows="H2 H3", risk=Risk.CONTACT, operator=True, space=0.05, needs=("conditions",))
def torques(arm: Arm) -> None:
    """Torque of a joint, and about an axis of the flange; the result has the fired condition and the state."""
    either = (abs(torque[0]) > 6) | (torque.about("z") > 50)
    handle = arm.start(lin_rel(y=0.1, frame="base", speed_mps=0.02), until=either)
    arm.wait_until(lambda s: np.linalg.norm(s.dq) > 0.01, timeout=20.0)
    arm.operator.start_push((0.0, 16.0, 0.0), duration=1.0)
    result = handle.wait(timeout=30.0)
    holds(result.stopped_by == (abs(torque[0]) > 6), f"the part that fired: {result.stopped_by}")
    holds(result.fired_at is not None, "the state when it fired is reported")
    assert result.fired_at is not None
    above(abs(float(result.fired_at.tau_ext[0])), 6.0, "external torque of A1 then", unit="Nm")
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)


@scenario(line=4, rows="H4 H14", risk=Risk.CONTACT, space=0.3, needs=("conditions", "lin_rel"))
def touch(arm: Arm) -> None:
    """A relative line moves down until contact with the table; the next motion does not start."""
    from heptarm.testing.measure import Unfit
    from heptarm.testing.stage import DEEPEST

    start = arm.wait_for_rest().pose
    contact = Force(frame="base").along("z") > 8
    down = lin_rel(z=-DEEPEST + 0.05, frame="base", speed_mps=0.1)
    result = arm.move([down, lin_rel(x=0.1, frame="base")], until=contact)
    if result.stopped_by is None:
        raise Unfit(f"there is no table within {DEEPEST - 0.05:g} m below the flange")
    holds(result.item == 0 and result.fired_at is not None, "the line ended, the next motion did not begin")
    assert result.fired_at is not None
    place = result.fired_at.pose.xyz
    below(float(np.abs(place[:2] - start.xyz[:2]).max()), 3e-3, "offset from its line", unit="m")
    above(float(result.fired_at.wrench.force[2]), 6.0, "force then", unit="N")
    above(float(arm.wait_for_rest().wrench.force[2]), 5.0, "and at rest", unit="N")
    note(f"the table is {start.xyz[2] - place[2]:.3f} m below home")
    holds(arm.move(lin_rel(z=0.1, frame="base", speed_mps=0.2)).arrived, "up it goes without a condition")


@scenario(line=4, rows="H3", space=0.15, needs=("conditions", "lin_rel"))
def combined(arm: Arm) -> None:
    """And, or, not; a point on the path by distance and by time; the result names the fired part."""
    start = arm.wait_for_rest().pose
    half = path.after(0.04)
    recording = record(arm, lin_rel(y=0.1, frame="base", speed_mps=0.06), until=half | (force > 500))
    holds(recording.result.stopped_by == half, f"fired: {recording.result.stopped_by}")
    assert recording.result.fired_at is not None
    near(recording.result.fired_at.pose.distance_to(start), 0.04, 6e-3, "distance then", unit="m")
    calm = ~(force > 500) & half
    result = arm.move(lin_rel(y=-0.1, frame="base", speed_mps=0.06), until=calm)
    holds(result.cause is Cause.CONDITION and result.stopped_by == calm, f"fired: {result.stopped_by}")
    late = Path().before_end(0.02)
    before = arm.wait_for_rest().pose
    result = arm.move(lin_rel(z=0.06, frame="base", speed_mps=0.06), until=late)
    assert result.fired_at is not None
    near(result.fired_at.pose.distance_to(before), 0.04, 6e-3, "20 mm before the end: distance", unit="m")


@scenario(line=4, rows="J5 H13", operator=True, risk=Risk.CONTACT, space=0.02, needs=("conditions", "io"),
          signals=("MediaFlange.UserButton",))  # fmt: skip
def button(arm: Arm) -> None:
    """A signal ends a motion: the button on the flange."""
    handle = arm.start(hold(30.0), until=io.user_button | (force > 200))
    arm.wait_until(lambda _: handle.started, timeout=20.0)
    arm.operator.set_signal("UserButton", True)
    result = handle.wait(timeout=30.0)
    arm.operator.set_signal("UserButton", False)
    holds(result.stopped_by == io.user_button, f"fired: {result.stopped_by}")


@scenario(line=4, rows="H3", risk=Risk.CONTACT, operator=True, space=0.2, needs=("conditions", "servo_pose"))
def servo(arm: Arm) -> None:
    """A condition ends a servo motion; its delay is measured."""
    contact = Force(frame="base").along("y") < -10
    with arm.servo("pose", rate=50, speed=0.3, acceleration=0.5, watchdog=2.0, until=contact) as stream:
        start, first = stream.start.pose, arm.state.stamp
        pushed = False
        while stream.tick():
            seconds = (arm.state.stamp - first) * 1e-9
            stream.set(Pose.of(start.xyz + [0.0, 0.03 * min(seconds, 3.0), 0.0], start.quat))
            if seconds > 0.3 and not pushed:
                pushed = True
                arm.operator.start_push((0.0, -15.0, 0.0), duration=3.0)
            if seconds > 10.0:
                break
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    result = stream.result
    holds(result is not None and result.stopped_by == contact, "it ended by the condition")
    assert result is not None and result.fired_at is not None
    below(float(result.fired_at.wrench.force[1]), -8.0, "force then", unit="N")
