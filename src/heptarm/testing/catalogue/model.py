"""Scenarios: the client's model compared with the measurements of the robot."""

from __future__ import annotations

import numpy as np

from heptarm import model
from heptarm.arm.arm import Arm
from heptarm.testing.measure import above, baseline, below, holds, near, note, record
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.motion.line import lin_rel
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import Pose, deg
from heptarm.values.robot import ROBOTS

#: With A2, A4 or A6 nearer to zero, the noise of a sensor decides about Status, and E1 is that of any posture [rad].
_SINGULAR = 0.01
#: States on each side of a place whose difference makes a velocity there.
_GAP = 4


@scenario(line=11, rows="K1 K13 K14 G8 G9", risk=Risk.STILL)
def forward(arm: Arm) -> None:
    """Forward kinematics equals the pose that the cabinet reports, as matrix, quaternion and angles."""
    state = arm.wait_for_rest()
    reported = arm.pose("flange")
    made = Pose.from_matrix(model.forward(arm.robot, state.q))
    near(made.xyz, reported.xyz, 2e-4, "place of the flange", unit="m")
    near(made.angle_to(reported), 0.0, 1e-3, "its orientation is off by", unit="rad")
    again = Pose.xyz_abc(*reported.xyz, *reported.abc)
    near(again.matrix, reported.matrix, 1e-9, "the same from its angles")
    near(np.linalg.det(reported.rotation), 1.0, 1e-9, "determinant of its rotation")
    for name, robot in ROBOTS.items():
        near(
            model.forward(robot, np.zeros(7))[2, 3],
            robot.d_bs + robot.d_se + robot.d_ew + robot.d_wf,
            1e-12,
            f"height of the stretched {name}",
            unit="m",
        )
        holds(robot.links.mass.shape == (7,), f"inertial data of the {name} are there")


@scenario(line=11, rows="K4 K5", risk=Risk.STILL)
def inverse(arm: Arm) -> None:
    """Inverse kinematics finds the current joint positions, all other configurations, and the one nearest to a hint."""
    here = arm.wait_for_rest()
    q, reported = here.q, here.redundancy
    pose = Pose.from_matrix(model.forward(arm.robot, q))
    near(
        model.solve(arm.robot, pose, near=q.tolist()), q, 1e-9, "joints from the pose and a hint", unit="rad"
    )
    again = model.solve(arm.robot, pose, e1=reported.e1, status=reported.status)
    near(
        model.forward(arm.robot, again),
        pose.matrix,
        1e-6,
        "E1 and Status of the cabinet lead to the same pose",
    )
    if np.abs(q[[1, 3, 5]]).min() > _SINGULAR:
        near(again, q, 2e-3, "joints from the pose, E1 and Status as the cabinet reports them", unit="rad")
    else:
        note("A2, A4 or A6 is near 0 here: E1 and Status belong to more than one posture")
    bent = HOME + deg(10, 5, 15, 10, -10, 5, 20)
    pose = Pose.from_matrix(model.forward(arm.robot, bent))
    found = model.solve_all(arm.robot, pose)
    above(len(found), 1.5, "arm positions that lead to another pose")
    for solution in found:
        near(model.forward(arm.robot, solution), pose.matrix, 1e-9, "each does")
    near(model.solve(arm.robot, pose, near=bent.tolist()), bent, 1e-9, "the one next to a hint", unit="rad")


@scenario(line=11, rows="K1 K2 K5", risk=Risk.STILL)
def in_bulk(arm: Arm) -> None:
    """Kinematics of a thousand poses at once equal those of one pose, and keep arm angle and Status."""
    here = arm.wait_for_rest().q
    q = HOME + np.random.default_rng(1).uniform(
        -0.1, 0.1, (1000, 7)
    )  # away from singularities, where `here` may be
    q[0] = here
    poses, jacobians = model.forward_batch(arm.robot, q), model.jacobian_batch(arm.robot, q)
    near(poses[0][:3, 3], arm.pose("flange").xyz, 2e-4, "place of the flange, of the first pose", unit="m")
    for row in (0, 1, 999):
        near(poses[row], model.forward(arm.robot, q[row]), 1e-12, f"pose {row}")
        near(jacobians[row], model.jacobian(arm.robot, q[row]), 1e-12, f"Jacobian {row}")
    own = model.redundancy_batch(arm.robot, q[1:])
    found = model.solve_batch(arm.robot, poses[1:], e1=own.e1, status=own.status)
    near(found, q[1:], 1e-6, "joints from poses, E1 and Status", unit="rad")
    again = model.redundancy_batch(arm.robot, found)
    near(np.angle(np.exp(1j * (again.e1 - own.e1))), 0.0, 1e-6, "E1 changes by", unit="rad")
    holds(bool((again.status == own.status).all()), "and Status does not")


@scenario(line=11, rows="K2 K3 K6 G2", space=0.15, needs=("ptp",))
def jacobian(arm: Arm) -> None:
    """The Jacobian maps measured joint velocities to the measured velocity of the flange and of a point on it."""
    recording = record(arm, ptp(HOME + deg(12, 4, -6, 5, 6, 8, 10), speed=0.25))
    spans = recording.t[2 * _GAP :] - recording.t[: -2 * _GAP]
    speeds = np.abs(recording.q_cmd[2 * _GAP :] - recording.q_cmd[: -2 * _GAP]).max(axis=1) / spans
    first = int(np.argmax(speeds))  # at full speed the velocity changes least
    a, b = recording.states[first], recording.states[first + 2 * _GAP]
    seconds = float(recording.t_pose[first + 2 * _GAP] - recording.t_pose[first])
    q = (a.q_cmd + b.q_cmd) / 2
    dq = (b.q_cmd - a.q_cmd) / float(spans[first])
    matrix = model.jacobian(arm.robot, q)
    velocity = (b.pose_cmd.xyz - a.pose_cmd.xyz) / seconds
    above(float(np.linalg.norm(velocity)), 0.005, "speed of the flange", unit="m/s")
    near(matrix[:3] @ dq, velocity, 0.02 * float(np.linalg.norm(velocity)) + 2e-4, "J dq", unit="m/s")
    lever = Pose.at(0.0, 0.05, 0.1)
    seen = ((b.pose_cmd @ lever).xyz - (a.pose_cmd @ lever).xyz) / seconds
    at = (Pose.from_matrix(model.forward(arm.robot, q)) @ lever).xyz
    near(
        model.jacobian(arm.robot, q, at)[:3] @ dq,
        seen,
        0.02 * float(np.linalg.norm(seen)) + 2e-4,
        "J dq of a point of the last link",
        unit="m/s",
    )
    still = model.nullspace(arm.robot, q) @ dq
    near(matrix @ still, np.zeros(6), 1e-9, "what is left of it in the null space moves the flange by")
    above(model.manipulability(arm.robot, q), 0.0, "manipulability")


@scenario(line=11, rows="K10 G3", risk=Risk.STILL, virtual=True)
def gravity(arm: Arm) -> None:
    """At rest the measured torques equal the gravity torques of the model."""
    state = arm.wait_for_rest()
    off = (baseline(arm).tau - model.gravity(arm.robot, state.q)) / arm.robot.tau_max
    near(off, np.zeros(7), 0.01, "measured torques are off by this fraction of the highest")


def _evenly_sampled(t: Array) -> list[int]:
    """The indices with all states around them: a busy machine loses some, and differences over a gap say nothing."""
    usual = _GAP * float(np.median(np.diff(t)))
    before, after = t[_GAP:-_GAP] - t[: -2 * _GAP], t[2 * _GAP :] - t[_GAP:-_GAP]
    even = (abs(before - after) < 0.05 * usual) & (before + after < 2.1 * usual)
    return [int(k) + _GAP for k in np.flatnonzero(even)]


@scenario(line=11, rows="K7 K8 K9 K11 K12", space=0.5, virtual=True, needs=("ptp",))
def dynamics(arm: Arm) -> None:
    """Mass matrix, Coriolis and centrifugal torques explain the measured torques of a fast motion, and vice versa."""
    recording = record(arm, ptp(HOME + deg(50, -20, 10, 30, 20, -20, 40), speed=0.8))
    evenly = _evenly_sampled(recording.t)
    middle = [k for k in evenly if 0.15 < k / len(recording.states) < 0.85]
    above(len(middle), 9, "moments with all states around them")
    worst, largest, undone, unequal = 0.0, 0.0, 0.0, 0.0
    for k in middle:
        a, here, b = recording.states[k - _GAP], recording.states[k], recording.states[k + _GAP]
        half = 0.5 * float(recording.t[k + _GAP] - recording.t[k - _GAP])
        dq = (b.q_cmd - a.q_cmd) / (2 * half)
        ddq = (b.q_cmd - 2 * here.q_cmd + a.q_cmd) / half**2
        made = model.inverse_dynamics(arm.robot, here.q, dq, ddq)
        moved = made - model.gravity(arm.robot, here.q)
        parts = model.mass_matrix(arm.robot, here.q) @ ddq + model.coriolis_matrix(arm.robot, here.q, dq) @ dq
        given_back = model.forward_dynamics(arm.robot, here.q, dq, made)
        largest = max(largest, float(np.abs(moved).max()))
        worst = max(worst, float(np.abs(here.tau - made).max()))
        undone = max(undone, float(np.abs(given_back - ddq).max()))
        unequal = max(unequal, float(np.abs(parts - moved).max()))
    below(undone, 1e-6, "forward dynamics give ddq back, off by up to", unit="rad/s²")
    below(unequal, 1e-9, "M ddq + C dq is off by up to", unit="Nm")
    note(f"movement takes up to {largest:.1f} Nm")
    below(worst, 0.15 * largest + 3.0, "measured torque is off by up to", unit="Nm")


@scenario(line=11, rows="K15 F13 B15", risk=Risk.STILL, needs=("ptp", "lin_rel"))
def limits(arm: Arm) -> None:
    """The client knows the joint limits: targets beyond them are refused, and nothing moves."""
    from heptarm.errors import HeptarmError, LimitError

    before = arm.wait_for_rest().q
    q: Array = before.copy()
    q[1] = arm.robot.q_max[1] + 0.1
    try:
        arm.move(ptp(q))
        holds(False, "a target behind a limit of A2 is refused")
    except LimitError as error:
        holds("A2" in error.text and "deg" in error.text, f"refused by name and range: {error.text}")
    try:
        arm.move(lin_rel(z=3.0, frame="base"))
        holds(False, "a line out of the workspace is refused")
    except HeptarmError as error:
        holds(error.code != 0, f"the cabinet's planner gives the reason: {error.text}")
    near(arm.wait_for_rest().q, before, 1e-4, "and the arm is where it was", unit="rad")
