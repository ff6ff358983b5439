"""Scenarios: the state that the robot reports."""

from __future__ import annotations

import time

import numpy as np

from heptarm import model
from heptarm.arm.arm import Arm
from heptarm.testing.measure import baseline, below, fresh, holds, near, record, watch
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg


@scenario(line=9, rows="G1 G2 G4 G5 G6 G7 G10 G11 G12 G14 G16 G17 G23", risk=Risk.STILL)
def whole(arm: Arm) -> None:
    """One state has joints, torques, pose, wrench, safety and mode, each group with its own time stamp."""
    state = fresh(arm)
    near(state.q, state.q_cmd, 0.01, "measured and commanded joints agree", unit="rad")
    near(state.dq, np.zeros(7), 0.01, "joint speeds at rest", unit="rad/s")
    holds(state.tau.shape == state.tau_ext.shape == (7,), "torques of all joints, measured and external")
    near(state.tau_ext[3], 0.0, 5.0, "external torque of A4", unit="Nm")
    near(state.pose.xyz, arm.pose(state=state).xyz, 1e-6, "place of the motion frame", unit="m")
    near(float(np.linalg.norm(state.pose.quat)), 1.0, 1e-9, "norm of its quaternion")
    below(float(np.linalg.norm(state.wrench.force)), 30.0, "nobody pushes: force", unit="N")
    holds(state.wrench.force_inaccuracy.shape == (3,), "the force comes with its inaccuracy")
    holds(state.safety.ready_to_move and state.safety.mastered, "ready to move, mastered")
    holds(state.safety.mode.value in ("t1", "t2", "aut"), f"operation mode {state.safety.mode.value}")
    groups = (
        state.joints,
        state.torques,
        state.groups.pose,
        state.groups.wrench,
        state.motion,
        state.groups.safety,
    )
    holds(all(group is not None and group.stamp > 0 for group in groups), "each group has its own time stamp")


@scenario(line=9, rows="G2", space=0.1, needs=("ptp",))
def velocity(arm: Arm) -> None:
    """The filtered joint velocity is the derivative of the measured positions, with a small delay."""
    recording = record(arm, ptp(HOME + deg(0, 0, 0, 0, 0, 0, 30), speed=0.3))
    reported = np.array([state.dq[6] for state in recording.states])
    peak = 0.3 * arm.robot.dq_max[6] if arm.speed >= 0.3 else arm.speed * arm.robot.dq_max[6]
    near(np.nanmax(reported), peak, 0.05 * peak, "top speed of A7", unit="rad/s")
    steps, moved = np.diff(recording.t), np.diff([state.q[6] for state in recording.states])
    whole = steps < 0.03  # a busy machine leaves states out
    offset = np.nansum((reported[1:] * steps)[whole])
    near(offset, moved[whole].sum(), 0.05 * np.radians(30), "its integral", unit="rad")


@scenario(line=9, rows="G10 G11 G18 H18", risk=Risk.CONTACT, operator=True, space=0.02)
def push(arm: Arm) -> None:
    """The wrench shows a push, and the external joint torques are J^T f."""
    rest, force = baseline(arm), np.array([12.0, -8.0, -15.0])
    arm.operator.start_push(force, duration=60.0)
    arm.wait_until(lambda s: np.linalg.norm(s.wrench.force - rest.force - force) < 2.0, timeout=20.0)
    watch(arm, 0.3)
    seen, state = baseline(arm), arm.state
    near(seen.force - rest.force, force, 1.0, "force at the flange, base axes", unit="N")
    matrix = model.jacobian(arm.robot, state.q)
    tau_ext = seen.tau_ext - rest.tau_ext
    near(tau_ext, matrix[:3].T @ force, 1.0, "external torques", unit="Nm")
    made = np.linalg.lstsq(matrix.T, tau_ext, rcond=None)[0]
    near(made[:3], force, 1.0, "the force estimated from the torques here", unit="N")
    turned = arm.wrench("flange", axes="flange", state=state).force
    own = arm.pose("flange", state=state).rotation.T @ state.wrench.force
    near(turned, own, 1.0, "in the flange's axes", unit="N")
    arm.operator.start_push(0.0 * force, duration=0.0)
    arm.wait_until(lambda s: np.linalg.norm(s.wrench.force - rest.force) < 2.0, timeout=20.0)


@scenario(line=9, rows="G15 G21 E16", space=0.1, needs=("ptp",))
def stream(arm: Arm) -> None:
    """States arrive at the requested rate without duplicates, with the cabinet's time and the running motion."""
    handle = arm.start(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 20), speed=0.2))
    states = watch(arm, 0.5)
    stamps = np.array([state.stamp for state in states])
    holds((np.diff(stamps) > 0).all(), "time stamps increase")
    periods = np.diff(stamps) * 1e-9  # a busy machine skips some
    near(periods[np.abs(periods - 0.01).argmin()], 0.01, 0.002, "period of the states", unit="s")
    below(len(stamps), (stamps[-1] - stamps[0]) * 1e-9 / 0.01 + 3, "number of states")
    seen = [state.motion for state in states if state.motion is not None]
    holds(any(motion.id == handle.id for motion in seen), "they name the motion that runs")
    handle.wait()
    rested = arm.wait_for_rest().motion
    holds(rested is not None and not rested.active, "and that nothing runs any more")


@scenario(line=9, rows="G15 E16", space=0.1, needs=("ptp",))
def every(arm: Arm) -> None:
    """A loop that is slower than the states, and begins late, has every state of a motion to its end."""
    handle = arm.start(ptp(HOME + deg(0, 0, 0, 0, 0, 0, 15), speed=0.2))
    arm.wait_until(lambda _: handle.started, timeout=20.0)  # one opened before has earlier states as well
    live = arm.states(until=handle).to_numpy()
    late = handle.states()
    slow = []
    for state in late:
        slow.append(state.q)
        time.sleep(0.004)
    result = handle.wait()
    holds(len(slow) == len(live["q"]) > 10, f"{len(slow)} states, as many as were received")
    near(np.array(slow), live["q"], 0.0, "the same states", unit="rad")
    holds((live["motion"][:-1] == handle.id).all(), "none is of another motion")
    spans = live["stamp"][live["motion"] == handle.id]
    near((spans[-1] - spans[0]) * 1e-9, result.duration, 0.2, "they reach from begin to end", unit="s")


@scenario(line=9, rows="D26 G19", space=0.05, needs=("hold",))
def mode(arm: Arm) -> None:
    """The state has the active control mode with its parameters; the limits of the robot are available."""
    from heptarm.values.mode.impedance import JointImpedance
    from heptarm.values.mode.mode import Position

    holds(fresh(arm).mode == Position(), "position control while nothing runs")
    compliant = JointImpedance((800, 800, 800, 800, 300, 300, 300), damping=0.6)
    handle = arm.start(hold(20.0), mode=compliant)
    state = arm.wait_until(lambda s: s.mode == compliant, timeout=10.0)
    holds(state.mode == compliant, f"in force: {state.mode}")
    handle.cancel()
    handle.wait()
    robot = arm.robot
    holds(
        (robot.q_min < 0).all() and (robot.dq_max > 0.5).all(), "limits of position and speed, joint by joint"
    )
