"""Scenarios: motions between two points."""

from __future__ import annotations

import numpy as np

from heptarm import model
from heptarm.arm.arm import Arm
from heptarm.testing.measure import above, below, holds, near, note, record
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp, ptp_home
from heptarm.values.pose import Pose, Redundancy, deg

#: Accuracy at the end of a motion [m], [rad].
_PLACE, _ANGLE = 5e-4, 2e-3
#: KUKA's transport position.
TRANSPORT: Array = deg(0, 25, 0, 90, 0, 0, 0)


def _off_line(points: Array, start: Array, end: Array) -> float:
    """Largest distance of points from a line [m]."""
    along = (end - start) / np.linalg.norm(end - start)
    lever = points - start
    return float(np.linalg.norm(lever - np.outer(lever @ along, along), axis=1).max())


@scenario(line=1, rows="C1 B1 E1 G1", needs=("ptp",))
def ptp_joints(arm: Arm) -> None:
    """PTP to joint positions: the call returns when the arm has arrived."""
    target = HOME + deg(12, -4, 6, 8, -5, 6, 15)
    result = arm.move(ptp(target))
    holds(result.arrived, f"the result is: {result.cause.value}")
    assert result.state is not None
    near(result.state.q, target, 1e-3, "measured joints", unit="rad")
    near(arm.wait_for_rest().dq, np.zeros(7), 0.01, "and the arm rests", unit="rad/s")


@scenario(line=1, rows="C2 C23 G13", needs=("ptp_pose",))
def ptp_pose(arm: Arm) -> None:
    """PTP to a pose, and to the same pose with another arm angle: the flange stays, the elbow moves."""
    start = arm.wait_for_rest()
    target = start.pose @ Pose.xyz_abc(0.02, 0.06, -0.05, *deg(20, 5, 0))
    arm.move(ptp(target, near=HOME))
    there = arm.wait_for_rest()
    near(there.pose.xyz, target.xyz, _PLACE, "place", unit="m")
    near(there.pose.angle_to(target), 0.0, _ANGLE, "orientation is off by", unit="rad")
    wanted = Redundancy(there.redundancy.e1 + 0.4, there.redundancy.status)
    arm.move(ptp(target, redundancy=wanted))
    turned = arm.wait_for_rest()
    near(turned.pose.xyz, target.xyz, _PLACE, "place with another E1", unit="m")
    near(turned.redundancy.e1, wanted.e1, _ANGLE, "E1 as the cabinet reports it", unit="rad")
    near(turned.redundancy.status, wanted.status, 0, "Status")
    above(float(np.abs(turned.q - there.q).max()), 0.1, "a joint has turned by", unit="rad")


@scenario(line=1, rows="C3 F5", needs=("lin",))
def straight(arm: Arm) -> None:
    """LIN: the flange moves on a straight line at the programmed speed while it rotates."""
    start = arm.wait_for_rest().pose
    target = start @ Pose.xyz_abc(0.03, 0.12, -0.02, *deg(25, 0, 0))
    recording = record(arm, lin(target, speed_mps=0.06))
    there = arm.wait_for_rest().pose
    near(there.xyz, target.xyz, _PLACE, "place", unit="m")
    near(there.angle_to(target), 0.0, _ANGLE, "orientation is off by", unit="rad")
    below(_off_line(recording.xyz, start.xyz, target.xyz), 5e-4, "offset from the line", unit="m")
    near(np.median(recording.speeds), 0.06, 0.003, "speed on the path", unit="m/s")
    middle = recording.states[
        int(
            np.argmin(
                np.abs(
                    recording.xyz @ (target.xyz - start.xyz)
                    - (start.xyz + target.xyz) / 2 @ (target.xyz - start.xyz)
                )
            )
        )
    ]
    near(
        middle.pose.angle_to(start),
        start.angle_to(target) / 2,
        0.03,
        "halfway it has turned half",
        unit="rad",
    )


@scenario(line=1, rows="C4 C5 C6", needs=("lin_rel",))
def relative(arm: Arm) -> None:
    """LIN_REL by an offset in the axes of the base and of the tool, with a rotation."""
    start = arm.wait_for_rest().pose
    arm.move(lin_rel(y=0.05, z=0.04, frame="base", speed_mps=0.2))
    there = arm.wait_for_rest().pose
    near(there.xyz - start.xyz, (0, 0.05, 0.04), _PLACE, "offset in the base", unit="m")
    arm.move(lin_rel(x=0.04, z=0.03, a=0.3, c=-0.1, speed_mps=0.2))
    near_pose(arm, there @ Pose.xyz_abc(0.04, 0, 0.03, 0.3, 0, -0.1), "in the tool's axes")


def near_pose(arm: Arm, wanted: Pose, what: str) -> None:
    """Check that the arm is at rest with its motion frame at a pose."""
    pose = arm.wait_for_rest().pose
    near(pose.xyz, wanted.xyz, _PLACE, f"place, {what}", unit="m")
    near(pose.angle_to(wanted), 0.0, _ANGLE, f"orientation, {what}, is off by", unit="rad")


@scenario(line=1, rows="C24 C25", needs=("lin_rel", "frames"))
def frames(arm: Arm) -> None:
    """Targets and offsets in a taught frame of the project."""
    from heptarm.testing.measure import Unfit

    if not arm.frames:
        raise Unfit("the project has no taught frames")
    name = next(iter(arm.frames))
    start = arm.wait_for_rest().pose
    before = arm.pose(reference=name)
    arm.move(lin_rel(x=0.04, y=0.02, frame=name, speed_mps=0.2))
    arm.wait_for_rest()
    offset = arm.pose(reference=name).xyz - before.xyz
    near(offset, (0.04, 0.02, 0.0), _PLACE, f"offset in the axes of {name}", unit="m")
    arm.move(lin(before, frame=name, speed_mps=0.2))
    near_pose(arm, start, f"back, by a target in {name}")


@scenario(line=1, rows="C19 C20", space=1.3, needs=("ptp",))
def named(arm: Arm) -> None:
    """Home with all axes at zero, and the transport position."""
    for what, target in (("stretched", np.zeros(7)), ("transport position", TRANSPORT)):
        arm.move(ptp(target))
        near(arm.wait_for_rest().q, target, 1e-3, what, unit="rad")


@scenario(line=1, rows="C19", space=1.3, virtual=True, needs=("ptp_home",))
def project_home(arm: Arm) -> None:
    """PTP to the home position of the cabinet's project, which the client need not know."""
    first = arm.move(ptp_home()).arrived
    there = arm.wait_for_rest().q
    arm.move(ptp(HOME))
    holds(first and arm.move(ptp_home()).arrived, "it arrives")
    near(arm.wait_for_rest().q, there, 1e-3, "always at the same joints", unit="rad")


@scenario(line=1, rows="C21", space=0.02, needs=("hold",))
def position_hold(arm: Arm) -> None:
    """A hold lasts for its duration and keeps the position."""
    recording = record(arm, hold(0.5))
    above(recording.result.duration, 0.45, "duration", unit="s")
    below(recording.result.duration, 1.0, "duration", unit="s")
    below(float(np.abs(recording.q - recording.q[0]).max()), 1e-3, "no joint moves by more than", unit="rad")


@scenario(line=1, rows="C22", space=0.15, needs=("ptp",))
def one_axis(arm: Arm) -> None:
    """A target built from the state moves one axis; the other six stay."""
    target = arm.wait_for_rest().q_cmd.copy()
    target[4] += 0.3
    recording = record(arm, ptp(target))
    near(recording.states[-1].q[4], target[4], 2e-3, "A5", unit="rad")
    others = np.delete(recording.q - recording.q[0], 4, axis=1)
    below(float(np.abs(others).max()), 1e-3, "the others move by at most", unit="rad")


@scenario(line=1, rows="F1 F2 F3 F4", space=0.3, needs=("ptp",))
def joint_speeds(arm: Arm) -> None:
    """Speed, acceleration and jerk as fractions of the axes' maxima, for all axes or one by one."""
    robot, fraction = arm.robot, min(0.4, arm.speed)
    there = HOME + deg(16, 0, 0, 0, 0, 0, 25)
    recording = record(arm, ptp(there, speed=fraction))
    tops = np.abs(recording.rates).max(axis=0) / robot.dq_max
    near(float(tops.max()), fraction, 0.03 * fraction, "fastest axis, fraction of its maximum")
    slow = np.full(7, fraction)
    slow[0] = fraction / 4
    recording = record(arm, ptp(HOME, speed=slow))
    top = float(np.abs(recording.rates[:, 0]).max() / robot.dq_max[0])
    near(top, fraction / 4, 0.03 * fraction, "A1 alone slowed down")
    there = HOME + deg(0, 0, 0, 0, 0, 0, 12)
    arm.move(ptp(HOME))
    times = [
        record(arm, ptp(target, speed=fraction, acceleration=acceleration, jerk=jerk)).moving
        for target, acceleration, jerk in ((there, 1.0, 1.0), (HOME, 0.1, 1.0), (there, 1.0, 0.03))
    ]
    above(times[1], times[0] + 0.1, "with a tenth of the acceleration it takes", unit="s")
    above(times[2], times[0] + 0.1, "with 3 % of the jerk it takes", unit="s")


@scenario(line=1, rows="F5 F6 F7 F8", space=0.3, needs=("lin_rel",))
def path_speeds(arm: Arm) -> None:
    """Speed, acceleration and jerk along a path, and those of its rotation."""
    recording = record(
        arm, lin_rel(y=0.08, frame="base", speed_mps=0.07, acceleration_mps2=0.2, jerk_mps3=50.0)
    )
    near(float(recording.speeds.max()), 0.07, 0.003, "top speed", unit="m/s")
    middles = (recording.t_pose[1:] + recording.t_pose[:-1]) / 2  # a state may be missing: a longer interval
    rates = np.diff(recording.speeds[::3]) / np.diff(middles[::3])
    near(float(np.abs(rates).max()), 0.2, 0.03, "largest acceleration", unit="m/s²")
    gentle = record(arm, lin_rel(y=-0.08, frame="base", speed_mps=0.07, acceleration_mps2=0.2, jerk_mps3=0.5))
    above(gentle.moving, recording.moving + 0.2, "with a small jerk it takes", unit="s")
    turning = record(arm, lin_rel(a=0.25, speed_radps=0.3, acceleration_radps2=1.0, jerk_radps3=50.0))
    near(float(turning.turns.max()), 0.3, 0.015, "top speed of the rotation", unit="rad/s")
    slow = record(arm, lin_rel(a=-0.25, speed_radps=0.3, acceleration_radps2=0.4, jerk_radps3=50.0))
    above(slow.moving, turning.moving + 0.2, "with less acceleration of it", unit="s")
    smooth = record(arm, lin_rel(a=0.25, speed_radps=0.3, acceleration_radps2=1.0, jerk_radps3=1.0))
    above(smooth.moving, turning.moving + 0.2, "with a small jerk of it", unit="s")


@scenario(line=1, rows="F12", space=0.2, needs=("ptp", "override"))
def override(arm: Arm) -> None:
    """The application override slows down the running motion at once."""
    fraction = min(0.3, arm.speed)
    handle = arm.start(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 60), speed=fraction))
    full = fraction * arm.robot.dq_max[6]
    arm.wait_until(lambda s: abs(s.dq[6]) > 0.95 * full, timeout=20.0)
    arm.set_override(0.25)
    state = arm.wait_until(lambda s: 0.2 * full < abs(s.dq[6]) < 0.3 * full, timeout=20.0)
    near(abs(state.dq[6]), 0.25 * full, 0.05 * full, "speed of A7 at an override of 0.25", unit="rad/s")
    arm.set_override(1.0)
    arm.wait_until(lambda s: abs(s.dq[6]) > 0.9 * full or handle.done, timeout=20.0)
    holds(handle.wait().arrived, "and it arrives")


@scenario(line=1, rows="C23", risk=Risk.STILL)
def reach(arm: Arm) -> None:
    """Reachability of a pose, and its arm angles, are known before anything moves."""
    from heptarm.errors import Unreachable

    pose = Pose.from_matrix(model.forward(arm.robot, HOME))
    spans = model.intervals(arm.robot, pose, model.redundancy(arm.robot, HOME.tolist()).status)
    above(sum(high - low for low, high in spans), 0.5, "arm angles that reach the pose, in total", unit="rad")
    try:
        model.solve(arm.robot, Pose.of((2.0, 0.0, 0.5)))
        holds(False, "a pose out of reach is reported")
    except Unreachable as error:
        note(error.text)
