"""Scenarios: control modes."""

from __future__ import annotations

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.handle import MotionHandle
from heptarm.errors import HeptarmError, MotionAborted, NotReady
from heptarm.testing.measure import above, baseline, below, fresh, holds, near, note, record, watch
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode, Position
from heptarm.values.mode.sine import SineImpedance
from heptarm.values.motion.circle import circ
from heptarm.values.motion.line import lin, lin_rel
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import ellipse
from heptarm.values.pose import Pose, Redundancy, deg
from heptarm.values.state import State

#: Of a force over a stiffness.
_TOLERANCE = 0.02
_TURNING = (200.0, 200.0, 200.0)
_LONG = 60.0


def held(arm: Arm, mode: Mode) -> MotionHandle:
    """A running hold in a control mode."""
    handle = arm.start(hold(_LONG), mode=mode)
    arm.wait_until(lambda s: handle.started or handle.done, timeout=20.0)
    return handle


def let_go(arm: Arm, handle: MotionHandle) -> None:
    """End a hold; raise the error that ended it earlier."""
    handle.cancel()
    handle.wait()
    arm.wait_for_rest()


def bent(arm: Arm, seconds: float = 0.3) -> Array:
    """Mean deviation of the flange from its set-point over some cabinet seconds, base axes, shape (3,) [m]."""
    return np.asarray(np.mean([s.pose.xyz - s.pose_cmd.xyz for s in watch(arm, seconds)], axis=0))


def settled(arm: Arm, *, seconds: float = 0.3) -> None:
    """Wait until no joint has moved for some cabinet seconds."""
    quiet = arm.state.stamp

    def rests(state: State) -> bool:
        nonlocal quiet
        if np.abs(state.dq).max() > 2e-3:
            quiet = state.stamp
        return state.stamp - quiet > seconds * 1e9

    arm.wait_until(rests, timeout=30.0)


@scenario(line=3, rows="D1 D25", risk=Risk.CONTACT, operator=True, space=0.02)
def stiff(arm: Arm) -> None:
    """The arm is stiff in position control and compliant in impedance control."""
    push = np.array([15.0, 0.0, 0.0])
    moved = []
    for mode in (Position(), JointImpedance(500.0), Position()):
        handle = held(arm, mode)
        arm.operator.start_push(push, duration=_LONG)
        watch(arm, 0.5)
        moved.append(float(np.linalg.norm(bent(arm))))
        arm.operator.start_push(push * 0, duration=0.0)
        let_go(arm, handle)
    below(max(moved[0], moved[2]), 1e-3, "deflection, position control, before and after", unit="m")
    above(moved[1], 3e-3, "deflection, under impedance", unit="m")


@scenario(line=3, rows="D2 D3 H11", risk=Risk.CONTACT, operator=True, space=0.1, needs=("joint_impedance",))
def joints(arm: Arm) -> None:
    """Joint impedance: each joint deflects by torque over stiffness, and returns with its damping."""
    stiffness, rest = np.array([400.0, 600.0, 400.0, 600.0, 200.0, 200.0, 100.0]), baseline(arm).tau_ext
    over = []
    for damping in (0.1, 1.0):
        handle = held(arm, JointImpedance(stiffness, damping=damping))
        arm.operator.start_push((0.0, 18.0, -10.0), duration=_LONG)
        arm.wait_until(lambda s: s.wrench.force[1] > 15.0, timeout=20.0)
        watch(arm, 0.5)
        settled(arm)
        state = fresh(arm)
        offset, wanted = state.q - state.q_cmd, (state.tau_ext - rest) / stiffness
        above(float(np.abs(offset).max()), 0.01, "largest offset of a joint", unit="rad")
        near(
            offset,
            wanted,
            _TOLERANCE * float(np.abs(wanted).max()) + 2e-3,
            "offset of each joint",
            unit="rad",
        )
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
        after = np.array([s.q[0] - s.q_cmd[0] for s in watch(arm, 1.0)])
        over.append(float((-np.sign(offset[0]) * after).max()))
        let_go(arm, handle)
    above(over[0], 2.0 * max(over[1], 1e-4), "overshoot of A1 after the release, lightly damped", unit="rad")


@scenario(line=3, rows="D4 D5 D8 D20 H1", space=0.1, virtual=True, needs=("cartesian_impedance",))
def cartesian(arm: Arm) -> None:
    """Cartesian impedance: the flange deflects by force over stiffness, far in a compliant plane, little across it."""
    stiffness = (400.0, 400.0, 4000.0, *_TURNING)
    force = (12.0, -10.0, -12.0)
    mode = CartesianImpedance(stiffness, damping=0.8, additional_force=(*force, 0, 0, 0), frame="base")
    handle = held(arm, mode)
    watch(arm, 0.6)
    settled(arm)
    wanted = np.divide(force, stiffness[:3])
    near(bent(arm), wanted, _TOLERANCE * float(np.abs(wanted).max()) + 2e-4, "offset", unit="m")
    let_go(arm, handle)


@scenario(line=3, rows="D6 D7", space=0.1, virtual=True, needs=("cartesian_impedance", "ptp_pose"))
def nullspace(arm: Arm) -> None:
    """The null-space spring pulls the elbow to its set-point while the flange stays."""
    start = arm.wait_for_rest()
    aside = Redundancy(start.redundancy.e1 + 0.3, start.redundancy.status)
    mode = CartesianImpedance(nullspace_stiffness=200.0, nullspace_damping=0.5)
    recording = record(arm, [ptp(start.pose, redundancy=aside, speed=0.3), hold(0.4)], mode=mode)
    end = recording.states[-1]
    below(end.pose.distance_to(start.pose), 2e-3, "the flange is off by", unit="m")
    above(float(np.abs(end.q - start.q).max()), 0.15, "a joint has turned by", unit="rad")
    near(end.q, end.q_cmd, 0.02, "joints and their set-points", unit="rad")
    reported = [s.mode for s in recording.states if isinstance(s.mode, CartesianImpedance)]
    holds(reported and reported[-1].nullspace_damping == 0.5, "its damping is read back")


@scenario(
    line=3, rows="D9 D10 D11", risk=Risk.CONTACT, space=0.1, operator=True, needs=("cartesian_impedance",)
)
def bounds(arm: Arm) -> None:
    """The largest force limits the controller or ends the motion; the largest speed and deviation end it."""
    compliant = (500.0, 500.0, 500.0, *_TURNING)
    far = (1e3, 1e3, 1e3, 10.0, 10.0, 10.0)
    offsets = []
    for most in (1000.0, 10.0):
        limit = (most, *far[1:])
        handle = held(arm, CartesianImpedance((2000.0,) * 3 + _TURNING, max_force=limit, frame="base"))
        arm.operator.start_push((20.0, 0.0, 0.0), duration=0.5)
        offsets.append(max(float(np.linalg.norm(s.pose.xyz - s.pose_cmd.xyz)) for s in watch(arm, 0.6)))
        let_go(arm, handle)
        arm.move(ptp(HOME))
    near(offsets[0], 20.0 / 2000.0, 5e-3, "a push of 20 N against 2000 N/m", unit="m")
    above(offsets[1], 1.5 * offsets[0], "if the control exerts no more than 10 N", unit="m")
    for words, limits in (
        ("force", {"max_force": (10.0, *far[1:]), "max_force_stops": True}),
        ("deviation", {"max_deviation": (0.01, 1, 1, 1, 1, 1)}),
        ("velocity", {"max_velocity": (0.01, 1, 1, 1, 1, 1)}),
    ):
        base = CartesianImpedance(compliant, frame="base", **limits)
        try:
            arm.move(hold(5.0), mode=SineImpedance.force(x=30.0, base=base))
            holds(False, f"the largest {words} ends the motion")
        except MotionAborted as error:
            holds(words in error.text, error.text)
        arm.wait_for_rest()
        arm.move(ptp(HOME))


@scenario(line=3, rows="D21 C15", space=0.2, needs=("cartesian_impedance", "spline", "circ"))
def motions(arm: Arm) -> None:
    """Lines, circles, ellipses and PTP in impedance control: the set-points arrive, and the arm close to them."""
    start = arm.wait_for_rest().pose
    centre = start.xyz + [0.0, 0.05, 0.0]
    end = Pose(start.xyz + [0.0, 0.1, 0.0], start.quat)
    with arm.using(CartesianImpedance((3000.0, 3000.0, 3000.0, *_TURNING))):
        for what, motion, target in (
            ("LIN", lin_rel(z=0.05, frame="base", speed_mps=0.15), start.xyz + [0, 0, 0.05]),
            ("back", lin(start, speed_mps=0.15), start.xyz),
            ("CIRC", circ(Pose(centre + [-0.05, 0, 0], start.quat), end, speed_mps=0.15), end.xyz),
            ("ellipse", ellipse(end, 0.03, centre=centre, angle=np.pi, speed_mps=0.15), start.xyz),
            ("PTP", ptp(HOME + deg(5, 0, 0, 0, 0, 0, 0)), None),
        ):
            recording = record(arm, motion)
            holds(recording.result.arrived, f"{what} arrives")
            off = np.linalg.norm(recording.xyz - recording.xyz_cmd, axis=1)
            below(float(off.max()), 0.02, f"{what}, off its set-point by", unit="m")
            if target is not None:
                near(recording.xyz_cmd[-1], target, 2e-3, f"{what}, end of its set-point", unit="m")


@scenario(line=3, rows="D22 D23 E11", space=0.1, virtual=True, needs=("cartesian_impedance", "servo"))
def online(arm: Arm) -> None:
    """The stiffness, and with it the deflection, changes while the arm follows a stream."""

    def mode(stiffness: float) -> CartesianImpedance:
        force = (0.0, 12.0, 0.0, 0, 0, 0)
        return CartesianImpedance((stiffness,) * 3 + _TURNING, additional_force=force, frame="base")

    with arm.servo("joint", rate=50, mode=mode(600.0), watchdog=2.0) as servo:
        start = servo.start.q

        def follow(wanted: float, by: float) -> float:
            """Follow until the flange has arrived, or 10 s have passed; return its position."""
            first = arm.state.stamp
            offset = np.inf
            while servo.tick() and abs(offset - wanted) > by and arm.state.stamp < first + 10e9:
                servo.set(start)
                state = arm.state
                offset = float(state.pose.xyz[1] - state.pose_cmd.xyz[1])
            return offset

        compliant = follow(12.0 / 600.0, 5e-4)
        servo.change(mode(3000.0))
        hard = follow(12.0 / 3000.0, 5e-4)
        try:
            servo.change(JointImpedance(500.0))
            holds(False, "another kind of mode is refused")
        except HeptarmError as error:
            note(error.text)
    near(compliant, 12.0 / 600.0, 2e-3, "12 N over 600 N/m", unit="m")
    near(hard, 12.0 / 3000.0, 1e-3, "12 N over 3000 N/m", unit="m")


@scenario(
    line=3, rows="D24", risk=Risk.CONTACT, operator=True, space=0.02, needs=("joint_impedance", "servo")
)
def validation(arm: Arm) -> None:
    """Impedance control does not start while the external torques exceed what the declared load explains."""
    rest = baseline(arm).tau_ext
    arm.operator.start_push((0.0, 0.0, -40.0), duration=_LONG)
    # Force and torques are read one after the other: wait for both, lest what follows sees torques of before.
    arm.wait_until(lambda s: s.wrench.force[2] < -35.0 and np.abs(s.tau_ext).max() > 12.0, timeout=20.0)
    try:
        with arm.servo("joint", mode=JointImpedance(500.0), watchdog=2.0):
            holds(False, "a servo motion under impedance is refused")
    except NotReady as error:
        holds("load" in error.text, error.text)
    arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
    arm.wait_until(lambda s: np.abs(s.tau_ext - rest).max() < 1.0, timeout=20.0)
    settled(
        arm
    )  # after the release the arm oscillates: it is slow at every turning point, and rests only later
    with arm.servo("joint", mode=JointImpedance(500.0), watchdog=2.0) as servo:
        servo.tick()
        servo.set(servo.start.q)
        holds(servo.active, "without the push it begins")
