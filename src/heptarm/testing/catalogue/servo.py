"""Scenarios: streams of targets that the arm follows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.arm.motion.servo import JointServo, PoseServo, Servo
from heptarm.errors import CollisionForeseen, HeptarmError, MissingExtra, MotionAborted, Starved
from heptarm.testing.measure import Unfit, above, below, fresh, holds, near, note
from heptarm.testing.scenario import Risk, scenario
from heptarm.values.checks import Array
from heptarm.values.pose import Pose
from heptarm.values.result import Cause
from heptarm.values.state import State

_A7 = np.array([0.0, 0, 0, 0, 0, 0, 1.0])
#: Targets per second [Hz], and the watchdog: long, since a busy machine is none of the robot's business [s].
_RATE, _PATIENT = 50.0, 2.0
#: Longest wait for answers, and for datagrams that get through [s].
_ANSWER = 20.0
#: States on a line that tell its speed.
_ENOUGH = 12
#: Least time between two states whose difference is a speed [ns].
_APART_NS = 20_000_000


def stream(arm: Arm, servo: Servo, seconds: float, target: Callable[[float], object]) -> tuple[State, ...]:
    """Call `target` with the cabinet time since now [s], tick by tick; the states that were seen."""
    first = arm.state.stamp
    states: dict[int, State] = {}
    while servo.tick():
        state = arm.state
        states[state.stamp] = state
        t = (state.stamp - first) * 1e-9
        target(t)
        if t > seconds:
            break
    return tuple(states.values())


def _swing(arm: Arm, servo: JointServo, start: Array) -> float:
    """Move A7 away and back; return the largest distance [rad]."""
    far = 0.0
    for begin, end in ((0.0, 0.15), (0.15, 0.0)):

        def target(t: float, begin: float = begin, end: float = end) -> None:
            servo.set(start + (begin + (end - begin) * min(t / 0.8, 1.0)) * _A7)

        first = arm.state.stamp
        while servo.tick():
            state = arm.state
            far = max(far, float(state.q[6] - start[6]))
            target((state.stamp - first) * 1e-9)
            late = state.stamp - first > 10e9
            there = abs(state.q[6] - start[6] - end) < 5e-3 and abs(state.dq[6]) < 0.05  # not in passing
            if late or (there and state.stamp - first > 0.8e9):
                break
    return far


@scenario(line=5, rows="E2 E12 E13", space=0.1, needs=("servo",))
def joints(arm: Arm) -> None:
    """SmartServo, joint targets: the arm follows; targets are not acknowledged, states arrive meanwhile."""
    with arm.servo("joint", rate=_RATE, speed=0.5, acceleration=1.0, watchdog=_PATIENT) as servo:
        start = servo.start.q
        far = _swing(arm, servo, start)
    near(far, 0.15, 0.01, "A7 swung by", unit="rad")
    near(arm.wait_for_rest().q, start, 5e-3, "and came back", unit="rad")
    stats = servo.stats
    holds(stats.refused == 0 and stats.received == stats.sent, f"{stats.sent} targets sent, all received")
    below(stats.set_median, 2e-3, "median cost of a target here", unit="s")
    holds(servo.result is not None and servo.result.cause is Cause.CANCELLED, "it ended when the block did")


@scenario(line=5, rows="O12", space=0.1, needs=("servo",))
def datagrams(arm: Arm) -> None:
    """Servo targets and states by UDP: none waits for a lost one, and what does not get through goes over TCP."""
    link = arm.connection.link
    if reason := link.open_datagrams(timeout=_ANSWER):
        raise Unfit(reason)
    try:
        arm.wait_until(lambda _: link.datagrams is not None and link.datagrams.gets_through, timeout=_ANSWER)
        with arm.servo("joint", rate=_RATE, speed=0.5, acceleration=1.0, watchdog=_PATIENT) as servo:
            start = servo.start.q
            far = _swing(arm, servo, start)
        near(far, 0.15, 0.01, "A7 swung by", unit="rad")
        near(arm.wait_for_rest().q, start, 5e-3, "and came back", unit="rad")
        report, counts = link.datagrams, link.datagram_counts(timeout=_ANSWER)
        assert report is not None
        above(report.states, 0, "states by datagram")
        holds(report.targets == servo.stats.sent, f"each of {servo.stats.sent} targets was sent by datagram")
        above(counts.accepted, report.targets / 2, "datagrams that counted in the cabinet")
        note(
            f"{report.targets_over_tcp} targets over TCP as well, round trip {1e3 * report.round_trip:.2f} ms"
        )
    finally:
        arm.reconnect()  # without datagrams


@scenario(line=5, rows="E5", space=0.1, needs=("servo_direct",))
def direct(arm: Arm) -> None:
    """DirectServo, joint targets: the arm moves directly to them."""
    with arm.servo(
        "joint", rate=_RATE, engine="direct", speed=0.8, acceleration=1.0, watchdog=_PATIENT
    ) as servo:
        start = servo.start.q
        far = _swing(arm, servo, start)
    near(far, 0.15, 0.01, "A7 swung by", unit="rad")
    near(arm.wait_for_rest().q, start, 5e-3, "and came back", unit="rad")


@scenario(line=5, rows="E3 E6", space=0.15, needs=("servo_pose",))
def poses(arm: Arm) -> None:
    """Pose targets, smart and direct; one that cannot be reached is held back and reported, the arm continues."""
    for engine in ("smart", "direct"):
        with arm.servo(
            "pose",
            rate=_RATE,
            engine=engine,
            speed=0.5,
            acceleration=1.0,
            watchdog=_PATIENT,
        ) as servo:
            start = servo.start.pose

            def target(t: float, start: Pose = start, servo: PoseServo = servo) -> None:
                fraction = (1.0 - np.cos(np.pi * min(t / 1.5, 1.0))) / 2
                servo.set(Pose.of(start.xyz + fraction * np.array([0.0, 0.06, 0.03]), start.quat))

            stream(arm, servo, 2.0, target)
            if engine == "smart":
                for _ in range(3):
                    servo.set(Pose.of([3.0, 0.0, 0.0], start.quat))
                    servo.tick()
                target(2.0)
        near(arm.wait_for_rest().pose.xyz - start.xyz, (0.0, 0.06, 0.03), 1e-3, f"offset, {engine}", unit="m")
        if engine == "smart":
            stats = servo.stats
            reasons = [slowdown.reason for slowdown in stats.slowdowns]
            holds(stats.held == 3 and "out of reach" in "".join(reasons), f"held back: {reasons}")


@scenario(line=5, rows="E7 E8 B17", space=0.1, needs=("servo",))
def velocities(arm: Arm) -> None:
    """Targets with the velocity to pass them at, and a stream of velocities: A7 moves as far as commanded."""
    speed = 0.2
    with arm.servo("joint", rate=_RATE, speed=0.5, acceleration=1.0, watchdog=_PATIENT) as servo:
        start = servo.start.q

        def target(t: float) -> None:
            servo.set(start + speed * min(t, 1.5) * _A7, speed * _A7 if t < 1.5 else 0 * _A7)

        states = stream(arm, servo, 2.2, target)
    seen = [abs(s.dq[6]) for s in states if 0.6e9 < s.stamp - states[0].stamp < 1.3e9]
    above(float(np.median(seen)), 0.5 * speed, "speed of A7", unit="rad/s")
    near(arm.wait_for_rest().q[6] - start[6], 1.5 * speed, 0.03, "offset of A7", unit="rad")


@scenario(line=5, rows="E7", space=0.1, needs=("servo",))
def joint_velocities(arm: Arm) -> None:
    """Joint velocities: A7 turns at the commanded speed, and comes to rest when nothing is commanded any more."""
    speed = 0.2
    with arm.servo("velocity", rate=_RATE, speed=0.5, watchdog=_PATIENT) as servo:
        states = stream(arm, servo, 1.5, lambda _: servo.set(speed * _A7))
        seen = [state.dq[6] for state in states if state.stamp - states[0].stamp > 0.6e9]
        near(float(np.median(seen)), speed, 0.3 * speed, "speed of A7", unit="rad/s")
        rest = stream(arm, servo, 1.5, lambda _: None)[-1]
        holds(servo.active, "silence leaves the stream open")
    near(rest.dq[6], 0.0, 0.01, "speed of A7 after silence", unit="rad/s")


@scenario(line=5, rows="E9", space=0.15, needs=("servo",))
def twist(arm: Arm) -> None:
    """Cartesian velocities: the flange moves and turns as commanded."""
    speed, turn = 0.04, 0.1
    with arm.servo("twist", frame="base", rate=_RATE, speed=0.5, watchdog=_PATIENT) as servo:
        start = servo.start.pose
        states = stream(arm, servo, 1.5, lambda _: servo.set([0.0, speed, 0.0, 0.0, 0.0, turn]))
    first, last = (next(s for s in states if s.stamp - states[0].stamp > t) for t in (0.5e9, 1.3e9))
    seconds = (last.stamp - first.stamp) * 1e-9
    near(last.pose.y - first.pose.y, speed * seconds, 0.35 * speed, "distance along y", unit="m")
    near(last.pose.angle_to(first.pose), turn * seconds, 0.35 * turn, "turned", unit="rad")
    near(last.pose.xyz[[0, 2]], start.xyz[[0, 2]], 5e-3, "x and z", unit="m")


@scenario(line=5, rows="C28", space=0.1, needs=("servo_pose",))
def kept_clear(arm: Arm) -> None:
    """Targets too near to a body that the model foresees are refused; the arm is held at the last good one."""
    try:
        from heptarm.sim.collision import CollisionModel

        above_it = arm.wait_for_rest().pose.xyz - [0.0, 0.0, 0.08]
        box = ",".join(f"{number:.4f}" for number in [*above_it[:2], above_it[2] - 0.01, 0.1, 0.1, 0.02])
        model = CollisionModel(arm.robot.name, boxes=[box], margin=0.02)
    except MissingExtra as error:
        raise Unfit(error.text) from None
    reason, depth = "", 0.0
    with arm.servo("pose", rate=_RATE, speed=0.3, keep_clear_of=model, watchdog=_PATIENT) as servo:
        start = last = servo.start.pose
        while servo.tick() and not reason and depth < 0.1:
            depth += 0.004
            try:
                last = servo.set(Pose.of(start.xyz - [0.0, 0.0, depth], start.quat))
            except CollisionForeseen as error:
                reason = error.text
        while servo.tick() and arm.state.pose.distance_to(last) > 2e-3 and servo.t < _ANSWER:
            servo.set(last)
        gap = min(clearance.distance for clearance in model.clearances(arm.state.q))
        held = servo.stats.held
    holds(held == 1, f"{held} target was refused: {reason}")
    near(gap, 0.022, 0.005, "distance that is left", unit="m")


@scenario(line=5, rows="E14 E15 F10", space=0.15, needs=("servo",))
def jump(arm: Arm) -> None:
    """The arm approaches a distant target within the limits of speed and acceleration."""
    tops, times = [], []
    for fraction, acceleration, shortest in ((0.1, 0.5, None), (0.1, 0.02, None), (0.3, 1.0, 1.0)):
        with arm.servo(
            "joint",
            rate=_RATE,
            speed=fraction,
            acceleration=acceleration,
            watchdog=_PATIENT,
            min_trajectory_time=shortest,
            goal_timeout=100.0,
        ) as servo:
            goal = servo.start.q + 0.12 * _A7
            first, top, sent = arm.state.stamp, 0.0, False
            while servo.tick() and abs(arm.state.q[6] - goal[6]) > 2e-3:
                if shortest is None or not sent:
                    servo.set(goal)
                sent = True
                top = max(top, abs(float(arm.state.dq[6])))
                if arm.state.stamp - first > 15e9:
                    break
            times.append((arm.state.stamp - first) * 1e-9)
            tops.append(top / arm.robot.dq_max[6])
        near(arm.wait_for_rest().q[6], goal[6], 5e-3, "A7", unit="rad")
    below(tops[0], 0.11, "top speed at a limit of 0.1, fraction of the maximum")
    above(times[1], times[0] + 0.1, "with a small acceleration it takes", unit="s")
    above(times[2], 0.7, "with a shortest trajectory of 1 s it takes", unit="s")


@scenario(line=5, rows="E14", space=0.1, risk=Risk.FAULT, virtual=True, needs=("servo",))
def starved(arm: Arm) -> None:
    """When no target arrives in time, the arm stops, and the block raises an error with the reason."""
    try:
        with arm.servo("joint", rate=_RATE, watchdog=0.3) as servo:
            servo.tick()
            servo.set(servo.start.q + 0.2 * _A7)
            arm.wait_until(lambda _: not servo.active, timeout=20.0)
        holds(False, "the missed watchdog is an error")
    except Starved as error:
        note(error.text)
    rests = arm.wait_for_rest()
    near(fresh(arm, after=0.2).q, rests.q, 1e-3, "the arm rests", unit="rad")


@scenario(line=5, rows="B14 F13", space=0.1, needs=("servo", "ptp"))
def exclusive(arm: Arm) -> None:
    """During a servo motion another motion is refused; targets beyond the limits are clamped."""
    from heptarm.values.motion.ptp import ptp

    with arm.servo("joint", rate=_RATE, watchdog=_PATIENT) as servo:
        servo.tick()
        far = servo.start.q.copy()
        far[6] = 10.0
        near(servo.set(far)[6], arm.robot.q_max[6], 1e-9, "what was sent for A7", unit="rad")
        servo.set(servo.start.q)
        try:
            arm.start(ptp(servo.start.q), when="reject")
            holds(False, "the motion is refused")
        except (MotionAborted, HeptarmError) as error:
            note(error.text)
        servo.tick()
        servo.set(servo.start.q)
        holds(servo.active, "and the stream continues")


def _line(arm: Arm, limit: float) -> tuple[Pose, Pose, list[State]]:
    """A straight line by servo targets, to and fro by turns: its start, its goal and the states on it."""
    with arm.servo(
        "lin", rate=_RATE, speed_mps=limit / arm.speed, acceleration_mps2=1.0, watchdog=_PATIENT
    ) as servo:
        start = servo.start.pose
        step = 1.0 if start.y < 0.04 else -1.0
        goal = Pose.of(start.xyz + [0.0, 0.08 * step, 0.04 * step], start.quat)
        state = arm.state
        states: dict[int, State] = {}
        until = state.stamp + 15e9
        while servo.tick() and state.pose.distance_to(goal) > 5e-4 and state.stamp < until:
            servo.set(goal)
            states[state.stamp] = state
            state = arm.state
    return start, goal, list(states.values())


@scenario(line=5, rows="E4 F11", space=0.2, needs=("servo_lin",))
def lines(arm: Arm) -> None:
    """SmartServoLIN: the flange approaches pose targets on straight lines, within the limits along each axis."""
    limit = 0.06
    for _ in range(5):  # a machine that stands still for the time of a line sees nothing of it
        start, goal, seen = _line(arm, limit)
        if len(seen) > _ENOUGH:
            break
    near(arm.wait_for_rest().pose.xyz, goal.xyz, 1e-3, "place", unit="m")
    offset = np.array([s.pose.xyz for s in seen]) - start.xyz
    stamps = np.array([s.groups.pose.stamp for s in seen if s.groups.pose is not None])
    along = (goal.xyz - start.xyz) / np.linalg.norm(goal.xyz - start.xyz)
    below(
        float(np.linalg.norm(offset - np.outer(offset @ along, along), axis=1).max()),
        1e-3,
        "offset from the line",
        unit="m",
    )
    speeds = []  # between poses far enough apart for the noise of the sensors
    for place, stamp in zip(offset, stamps):
        later = np.flatnonzero(stamps - stamp >= _APART_NS)[:1]
        speeds += [float(np.abs(offset[k] - place).max() / (stamps[k] - stamp) * 1e9) for k in later]
    top = max(speeds)
    near(top, limit, 0.2 * limit, "top speed along an axis", unit="m/s")
