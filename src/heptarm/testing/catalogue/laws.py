"""Scenarios: the ready control laws in FRI sessions, each against what it promises."""

from __future__ import annotations

import math

import numpy as np

from heptarm import laws
from heptarm.arm.arm import Arm
from heptarm.arm.fri.session import Fri
from heptarm.fri.guard.joint_guard import Limits
from heptarm.fri.loop.user_api import State as FriState
from heptarm.laws.ready import ReadyLaw
from heptarm.model.kinematics import forward
from heptarm.testing.measure import NotShown, above, baseline, below, near
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.mode.impedance import CartesianImpedance, JointImpedance
from heptarm.values.mode.mode import Mode

#: Time between two messages [ms].
_PERIOD = 5
#: Longest push [s].
_LONG = 60.0
#: What a torque law runs on: the cabinet compensates gravity and adds nothing.
_COMPLIANT = JointImpedance(stiffness=0.0)


def _session(arm: Arm, law: ReadyLaw, mode: Mode | None = None) -> Fri:
    limits = Limits.of(arm.robot, fraction=min(1.0, max(arm.speed, 0.01)))
    return arm.fri(law.kind, period_ms=_PERIOD, law=law, mode=mode, limits=limits)


def _run(session: Fri, seconds: float) -> FriState:
    """Wait in the cabinet's time; the state then.

    Raises:
        NotShown: the session has ended; leaving its block raises why.
    """
    end = session.state.t + seconds
    while session.state.t < end:
        if not session.wait(0.01):
            raise NotShown("the session ended early")
    return session.state


def _place(arm: Arm, q: Array) -> Array:
    """Position of the flange in the base, shape (3,) [m]."""
    return np.asarray(forward(arm.robot, q)[:3, 3])


@scenario(line=3, rows="E20", space=0.1, virtual=True, needs=("fri_torque",))
def cartesian_impedance(arm: Arm) -> None:
    """Torques hold the flange on a spring, and move it to a goal that changes while they do."""
    law = laws.cartesian_impedance(posture=HOME, speed=0.1)
    with _session(arm, law, _COMPLIANT) as session:
        begin = _place(arm, _run(session, 0.2).q)
        session.params.goal = session.memory.goal + [0.0, 0.04, 0.0, 0.0, 0.0, 0.0, 0.0]
        moved = _place(arm, _run(session, 1.2).q) - begin
        near(moved, (0.0, 0.04, 0.0), 3e-3, "the flange moved by", unit="m")
        below(float(session.memory.saturated), 1.0, "cycles in which it was limited")


@scenario(line=3, rows="E20", space=0.1, virtual=True, needs=("fri_torque",))
def joint_impedance(arm: Arm) -> None:
    """Torques hold the joints on springs, and move one of them to a goal."""
    with _session(arm, laws.joint_impedance(), _COMPLIANT) as session:
        _run(session, 0.2)
        goal = HOME + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.2]
        session.params.goal = goal
        near(_run(session, 1.2).q, goal, 0.01, "positions", unit="rad")


@scenario(line=8, rows="E20", risk=Risk.CONTACT, operator=True, space=0.2, needs=("fri_torque",))
def free_guiding(arm: Arm) -> None:
    """Pushed by hand, the arm moves freely in a box and stops at its virtual wall."""
    begin, force = _place(arm, HOME), 15.0
    wall = 0.03
    law = laws.free_guiding(box=(begin - [1.0, 1.0, 1.0], begin + [1.0, wall, 1.0]), wall_stiffness=1500.0)
    with _session(arm, law, _COMPLIANT) as session:
        arm.operator.start_push((0.0, force, 0.0), duration=_LONG)
        _run(session, 2.0)
        beyond, pushing = _place(arm, session.state.q)[1] - begin[1] - wall, session.memory.force
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
        near(beyond, force / 1500.0, 4e-3, "behind the wall it rests", unit="m")
        near(pushing, (0.0, -force, 0.0), 3.0, "force of the wall", unit="N")


@scenario(line=8, rows="E20", risk=Risk.CONTACT, operator=True, space=0.3, needs=("fri_position",))
def admittance(arm: Arm) -> None:
    """A push moves the flange of a position-controlled arm like a mass in a damper; without it the arm stands."""
    force, damping, rest = 20.0, 200.0, baseline(arm)
    band = 3.0 + float(np.linalg.norm(rest.force))  # beyond what the sensors show while nobody pushes
    moment_band = 0.5 + float(np.linalg.norm(rest.torque))
    law = laws.admittance(dead_band=band, moment_dead_band=moment_band, damping=(damping,) * 3 + (8.0,) * 3)
    pushed = rest.force + [0.0, force, 0.0]
    due = (1.0 - band / float(np.linalg.norm(pushed))) * pushed / damping
    with _session(arm, law) as session:
        _run(session, 0.1)
        arm.operator.start_push((0.0, force, 0.0), duration=_LONG)
        first = _run(session, 0.5)
        last = _run(session, 0.5)
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
        speed = (_place(arm, last.q) - _place(arm, first.q)) / (last.t - first.t)
        near(speed[1], due[1], 0.02, "speed along the push", unit="m/s")
        _run(session, 0.5)
        stands = session.state.q
        below(float(np.abs(_run(session, 0.3).q - stands).max()), 1e-3, "then it moves by", unit="rad")


@scenario(line=5, rows="E20", space=0.1, needs=("fri_position",))
def minimum_jerk(arm: Arm) -> None:
    """A goal that changes on the way is reached without a stop, and at the time that the law foretold."""
    with _session(arm, laws.minimum_jerk(speed=0.4 * arm.speed * arm.robot.dq_max)) as session:
        _run(session, 0.1)
        session.params.goal = HOME + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.15]
        _run(session, 0.2)
        goal = HOME + [0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.1]
        session.params.goal = goal
        _run(session, 0.02)
        above(float(np.abs(session.memory.dq).max()), 0.01, "on the way, fastest joint", unit="rad/s")
        _run(session, float(session.memory.left) + 0.1)
        near(session.state.q_sent, goal, 1e-6, "positions", unit="rad")


@scenario(line=5, rows="E20", space=0.1, needs=("fri_position",))
def jerk_limited(arm: Arm) -> None:
    """Goals that come while the arm moves are reached as fast as the limits of each joint allow, without overshoot."""
    speed, acceleration = 0.4 * arm.speed * arm.robot.dq_max, 0.2 * arm.speed * arm.robot.ddq_max
    jerk = 0.2 * arm.speed * arm.robot.dddq_max
    goal = HOME + [0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 0.15]
    with _session(arm, laws.jerk_limited(speed=speed, acceleration=acceleration, jerk=jerk)) as session:
        _run(session, 0.1)
        for part in (0.3, 0.7, 0.2):  # as from a camera
            session.params.goal = HOME + part * (goal - HOME)
            _run(session, 0.05)
        session.params.goal = goal
        due = 0.15 / speed[6] + speed[6] / acceleration[6] + acceleration[6] / jerk[6]
        _run(session, 1.2 * due + 0.1)
        near(session.state.q_sent, goal, 1e-6, "positions", unit="rad")
        sent = np.array([state.q_sent for state in session.history(400) if np.isfinite(state.q_sent).all()])
        below(float((sent - goal)[:, 5:].max()), 1e-6, "overshoot", unit="rad")


@scenario(line=5, rows="E20", space=0.1, needs=("fri_position",))
def low_pass(arm: Arm) -> None:
    """A goal passes through a filter of second order: its response to a step, without overshoot."""
    frequency, step = 0.5, 0.05
    with _session(arm, laws.low_pass(frequency=frequency)) as session:
        _run(session, 0.1)
        session.params.goal = HOME + [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, step]
        _run(session, 1.5)
        states = [state for state in session.history(400) if state.is_answered]
    t = np.array([state.t for state in states])
    q = np.array([state.q_sent[6] for state in states]) - HOME[6]
    (moved,) = np.nonzero(q > 1e-9)
    due = 2.0 * math.pi * frequency * (t[moved] - t[moved[0]] + _PERIOD * 1e-3)
    near(q[moved], step * (1.0 - (1.0 + due) * np.exp(-due)), 0.03 * step, "response", unit="rad")


@scenario(line=8, rows="E20", risk=Risk.CONTACT, operator=True, space=0.1, needs=("fri_position",))
def hybrid(arm: Arm) -> None:
    """Pushed along an axis of force control, the flange moves with the hand; along the others it follows a goal."""
    force, damping, rest = 20.0, 400.0, baseline(arm)
    law = laws.hybrid(
        force_axes=(0, 1, 0, 0, 0, 0),
        wrench=(0.0, -float(rest.force[1]), 0.0, 0.0, 0.0, 0.0),  # what the sensors show while nobody pushes
        damping=(damping,) * 3 + (40.0,) * 3,
        speed=0.1,
    )
    with _session(arm, law) as session:
        begin = _place(arm, _run(session, 0.1).q)
        session.params.goal = session.memory.goal + [0.02, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
        arm.operator.start_push((0.0, force, 0.0), duration=_LONG)
        first = _run(session, 0.5)
        last = _run(session, 0.5)
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
        speed = (_place(arm, last.q) - _place(arm, first.q)) / (last.t - first.t)
        near(speed[1], force / damping, 0.02, "speed along the push", unit="m/s")
        moved = _place(arm, last.q) - begin
        near(moved[[0, 2]], (0.02, 0.0), 4e-3, "moved across the push by", unit="m")


@scenario(line=5, rows="E20", risk=Risk.CONTACT, operator=True, space=0.05, needs=("fri_position",))
def low_pass_readings(arm: Arm) -> None:
    """The filtered force follows a push as its corner frequency allows, while the arm holds its place."""
    frequency, force, rest = 1.0, 20.0, baseline(arm)
    with _session(arm, laws.low_pass_readings(frequency=frequency)) as session:
        _run(session, 0.3)
        arm.operator.start_push((0.0, force, 0.0), duration=_LONG)
        _run(session, 1.0)
        shown = session.memory.wrench[1] - rest.force[1]
        arm.operator.start_push((0.0, 0.0, 0.0), duration=0.0)
        near(shown, force, 3.0, "force after six time constants", unit="N")
        _run(session, 0.1)
        fading = session.memory.wrench[1] - rest.force[1]
        near(
            fading, force * math.exp(-2.0 * math.pi * frequency * 0.1), 5.0, "0.1 s after the push", unit="N"
        )


@scenario(line=8, rows="E20", space=0.05, virtual=True, needs=("fri_wrench",))
def search(arm: Arm) -> None:
    """A force that draws a growing spiral moves the flange by the force over the stiffness."""
    stiffness, amplitude = 1500.0, 9.0
    compliant = CartesianImpedance((stiffness,) * 3 + (150.0,) * 3, frame="base")
    law = laws.search(push=(0.0, 0.0, -5.0), amplitude=amplitude, frequency=1.0, rise=1.0)
    with _session(arm, law, compliant) as session:
        begin = _place(arm, session.start.q)
        _run(session, 1.2)
        near(float(session.memory.done), 1.0, 0.0, "the spiral has its full size")
        _run(session, 1.0)
        states = session.history(200)
    across = np.linalg.norm([(_place(arm, state.q) - begin)[:2] for state in states], axis=1)
    near(float(across.max()), amplitude / stiffness, 0.3 * amplitude / stiffness, "radius", unit="m")
