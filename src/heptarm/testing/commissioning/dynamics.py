"""Steps: masses, highest accelerations and the shape of motions."""

from __future__ import annotations

import numpy as np

from heptarm import model
from heptarm.arm.arm import Arm
from heptarm.testing.commissioning.person import Person
from heptarm.testing.commissioning.step import Comparison, Movement, at_most, largest, near, same, step
from heptarm.testing.measure import MotionStates, fresh, record
from heptarm.testing.stage import HOME
from heptarm.values.checks import Array
from heptarm.values.motion.line import Lin, lin
from heptarm.values.motion.motion import hold
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import Spl, spl, spline
from heptarm.values.pose import Pose, deg
from heptarm.values.result import Cause, Result
from heptarm.values.robot import ACCELERATION, JERK
from heptarm.values.state import State

#: A7 alone turns: the flange stays where it is.
_TURN = 60.0
_ALONE = deg(0, 0, 0, 0, 0, 0, _TURN)
_A7 = 6
#: Fractions of the assumed acceleration and jerk that are programmed, so that ramps last long enough to be seen.
_GENTLE, _SMOOTH = 0.05, 0.01
#: Time over which a velocity or an acceleration is taken from sampled positions [s].
_WINDOW = 0.08
#: Longest motion here [s], and speed below which an axis rests [rad/s].
_LONGEST, _AT_REST = 60.0, 5e-3


@step(
    movement=Movement(
        "The whole arm", "to three postures, each axis by at most 30 deg", "a tenth of every axis' speed"
    ),
    needs=("ptp",),
)
def gravity(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Do the torques that hold the arm fit the assumed masses and centres of mass?"""
    compared = []
    for offset in ((0, 0, 0, 0, 0, 0, 0), (0, -20, 0, 20, 0, 20, 0), (0, 20, 10, 30, 30, 20, 0)):
        arm.move(ptp(HOME + deg(*offset)))
        arm.wait_for_rest()
        state = fresh(arm)
        expected = model.gravity(arm.robot, state.q)
        for axis in (1, 3):
            posture = " ".join(f"{angle:.0f}" for angle in np.degrees(state.q))
            compared.append(
                near(
                    f"torque of A{axis + 1} at {posture} deg",
                    float(state.tau[axis]),
                    float(expected[axis]),
                    5.0,
                    "Nm",
                )
            )
    return tuple(compared)


def _slopes(times: Array, values: Array, window: float = _WINDOW) -> tuple[Array, Array]:
    """Times of the middles of windows, and the slopes over them, each of shape (n,)."""
    found, middles = [], []
    for start, time in enumerate(times):
        end = int(np.searchsorted(times, time + window))
        if end < len(times):
            found.append((values[end] - values[start]) / (times[end] - time))
            middles.append((times[end] + time) / 2.0)
    return np.array(middles), np.array(found)


def _peak(recording: MotionStates) -> float:
    """Largest acceleration of A7's set-point [rad/s²]."""
    times, velocities = _slopes(recording.t, recording.q_cmd[:, _A7])
    return largest(_slopes(times, velocities)[1])


@step(movement=Movement("A7", f"by {_TURN:.0f} deg and back, twice", "a tenth of its speed"), needs=("ptp",))
def acceleration(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Are the highest acceleration and jerk of an axis those that are assumed?"""
    peak = _peak(record(arm, ptp(HOME + _ALONE, acceleration=_GENTLE)))
    arm.move(ptp(HOME))
    smooth = _peak(record(arm, ptp(HOME + _ALONE, jerk=_SMOOTH)))
    arm.move(ptp(HOME))
    speed = arm.speed * float(arm.robot.dq_max[_A7])
    return (
        near("highest acceleration of A7", peak / _GENTLE, ACCELERATION, 0.2 * ACCELERATION, "rad/s²"),
        # a ramp of jerk j up to the velocity v has the acceleration sqrt(v j) in its middle
        near("highest jerk of A7", smooth**2 / speed / _SMOOTH, JERK, 0.4 * JERK, "rad/s³"),
    )


def _braking_time(times: Array, positions: Array, speed: float) -> float:
    """Time from full speed to rest [s].

    Args:
        times: of the samples [s].
        positions: of an axis that moves at full speed and then brakes [rad].
        speed: the full speed [rad/s].
    """
    middles, velocities = _slopes(times, positions, 0.02)
    full = np.flatnonzero(velocities > 0.97 * speed)
    resting = np.flatnonzero(velocities > 0.03 * speed)
    return float(middles[resting[-1]] - middles[full[-1]]) if len(full) else float("nan")


@step(movement=Movement("A7", "by less than 60 deg and back", "a tenth of its speed"), needs=("ptp",))
def braking(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does a cancelled motion brake at the axes' acceleration limit?"""
    pushed = arm.states(duration=_LONGEST)
    handle = arm.start(ptp(HOME + _ALONE))
    states: list[State] = []
    stopped = False
    for state in pushed:
        states.append(state)
        if not stopped and state.q_cmd[_A7] - HOME[_A7] > np.radians(_TURN / 3):
            arm.stop()
            stopped = True
        if handle.done and largest(state.dq) < _AT_REST:
            break
    pushed.close()
    seen = MotionStates(Result(Cause.STOPPED), tuple(states))
    speed = arm.speed * float(arm.robot.dq_max[_A7])
    time = _braking_time(seen.t, seen.q_cmd[:, _A7], speed)
    # so slow a motion brakes in two halves of the highest jerk before it reaches the highest acceleration
    return (
        near("time from full speed to rest", time, 2.0 * float(np.sqrt(speed / JERK)), 0.08, "s"),
        at_most("A7 moves on after the brake began by", np.degrees(speed * time), 3.0, "deg"),
    )


@step(movement=Movement("The flange", "40 mm along y and 40 mm down", "20 mm/s"), needs=("spline",))
def spline_segments(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the cabinet report when each segment of a spline begins?"""
    start = arm.wait_for_rest().pose

    def at(y: float, z: float) -> Pose:
        return Pose.of(start.xyz + (0.0, y, z), start.quat)

    points: list[Spl | Lin] = [
        spl(at(0.02, -0.02)),
        spl(at(0.04, -0.04)),
        lin(at(0.04, -0.02)),
        spl(at(0.02, 0.0)),
    ]
    handle = arm.start(spline(points, speed_mps=0.02))
    handle.wait()
    seen = sum(event.kind == "segment" for event in handle.events())
    return (same("segments that were reported to begin", str(seen), str(len(points))),)


@step(
    movement=Movement("Nothing but the approach", "0 deg", "then the arm holds its position"), needs=("hold",)
)
def short_hold(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does a hold that is shorter than a cycle of the application end at once?"""
    result = arm.move(hold(0.001))
    return (
        at_most("a hold of 1 ms lasts", float(result.duration), 0.5, "s"),
        same("it ends as", result.cause.value, "finished"),
    )
