"""Steps: FRI sessions, as the cabinet times and rates them. They need the option Sunrise.FRI."""

from __future__ import annotations

import itertools
import math
import statistics
import time
from contextlib import suppress

from heptarm.arm.arm import Arm
from heptarm.errors import MotionAborted, StreamError
from heptarm.fri.loop.user_api import Output, Params
from heptarm.fri.loop.user_api import State as FriState
from heptarm.fri.protocol.messages import Quality, SessionState
from heptarm.sim.fri.controller_side import MIRROR, MIRRORED, SETTLED
from heptarm.testing.commissioning.person import Person
from heptarm.testing.commissioning.step import (
    Comparison,
    Movement,
    at_least,
    at_most,
    largest,
    near,
    same,
    step,
)
from heptarm.testing.measure import Unfit
from heptarm.values.mode.impedance import JointImpedance

#: Time between two messages [ms], and messages that are kept.
_PERIOD, _HISTORY = 5, 4096
_HOLDS = Movement("Nothing but the approach", "0 deg", "then the arm holds its position below an overlay")
#: Part of the window of the quality that has to be answered before it is GOOD, in messages.
_UNTIL_GOOD = 95
#: Speed of A7 while an answer is held back [rad/s], and for how many periods it is.
_SLOW, _HELD_BACK = 0.02, 2.4
#: Torque on A7 [Nm], stiffness of its spring [Nm/rad], and by how much it is wound at least [rad].
_TORQUE, _SPRING, _WOUND = 1.0, 50.0, 5e-3
#: Time at which no answer is held back [s].
_NEVER = 1e6


def _opening(arm: Arm) -> list[FriState]:
    """Messages of a session from the first one until commands are effective, and a little longer."""
    with arm.fri("position", period_ms=_PERIOD, history=_HISTORY) as session:
        session.wait(0.3)
        return session.history()


@step(movement=_HOLDS, needs=("fri_position",))
def handshake(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """For how many messages is a session in MONITORING_READY and in COMMANDING_WAIT?"""
    seen = [state.session for state in _opening(arm)]
    ready = seen.count(SessionState.MONITORING_READY)
    waiting = seen.count(SessionState.COMMANDING_WAIT)
    return (
        at_least("messages in MONITORING_READY", ready, SETTLED),
        near("messages in COMMANDING_WAIT", waiting, MIRRORED, 5.0),
    )


@step(movement=_HOLDS, needs=("fri_position",))
def mirror(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Do the positions that a client may mirror in COMMANDING_WAIT lie within the assumed tolerance of each other?"""
    states = _opening(arm)
    waiting = [state for state in states if state.session is SessionState.COMMANDING_WAIT]
    if not waiting:
        raise Unfit("no message in COMMANDING_WAIT was seen")
    measured = max(largest(state.q - state.q_ipo) for state in waiting)
    jump = largest(states[-1].q - waiting[0].q)
    return (
        at_most("measured position beside the interpolator's", measured, MIRROR, "rad"),
        at_most("the arm moves when commands become effective by", jump, MIRROR, "rad"),
    )


@step(needs=("fri_monitor",))
def quality(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """How long does a session have to be answered until its quality is GOOD?"""
    with arm.fri("monitor", period_ms=_PERIOD, history=_HISTORY) as session:
        session.wait(1.5)
        states = session.history()
        missed = session.stats.missed
    ratings = [state.quality for state in states]
    good = next((k for k, rating in enumerate(ratings) if rating >= Quality.GOOD), len(ratings))
    return (
        near("messages until the quality is GOOD", good, _UNTIL_GOOD, 25.0),
        same("quality after 1.5 s", ratings[-1].name, Quality.EXCELLENT.name),
        at_most("answers that came too late", missed, 0),
    )


@step()
def limit_text(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Which error ends an overlay whose command is beyond a limit?"""
    text = person.reads("Error on the smartPAD after an FRI command beyond a limit, from this robot's log")
    if not text:
        raise Unfit(
            "no command has been beyond a limit: heptarm's guard prevents it, and no step provokes it"
        )
    expected = "Illegal axis delta"
    return (same("text of the error", expected if expected.lower() in text.lower() else text, expected),)


def hold_back_once(state: FriState, out: Output, params: Params) -> None:
    """A law that turns A7 slowly, and answers one message late.

    Args:
        state: the message.
        out: the command.
        params: `velocity` of A7 [rad/s], `at` time of the late answer [s], `pause` of this machine's time [s].
    """
    out.q[6] += params.velocity * min(state.t, 1.0) ** 2 / 2.0
    if math.isclose(state.t, params.at, abs_tol=_PERIOD * 5e-4):
        time.sleep(float(params.pause))


@step(
    movement=Movement("A7", "by less than 2 deg", "1.2 deg/s, by FRI commands, one of which comes late"),
    needs=("fri_position",),
)
def lost_answer(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does an overlay survive one answer that comes too late, without a jerk of the arm?"""
    pause = _HELD_BACK * _PERIOD * 1e-3 / max(arm.real_time_factor, 1e-3)
    params = {"velocity": _SLOW, "at": 0.5, "pause": pause}
    with arm.fri(
        "position", period_ms=_PERIOD, law=hold_back_once, params=params, history=_HISTORY
    ) as session:
        is_open = session.wait(1.2)
        state = session.state.session
        states = [state for state in session.history() if state.session is SessionState.COMMANDING_ACTIVE]
    steps = [largest(after.q - before.q) for before, after in itertools.pairwise(states)]
    return (
        same("the session is", state.name if is_open else "closed", SessionState.COMMANDING_ACTIVE.name),
        at_most("largest change of the position between two messages", max(steps), 1e-3, "rad"),
    )


def wind_up(state: FriState, out: Output, params: Params) -> None:
    """A law that winds the spring of A7 by a torque, within 0.3 s.

    Args:
        state: the message.
        out: the command.
        params: `torque` [Nm].
    """
    out.tau[6] = params.torque * min(state.t / 0.3, 1.0)


@step(
    movement=Movement("A7", "by less than 2 deg", "a spring of 50 Nm/rad, wound by 1 Nm; then a stop"),
    needs=("fri_torque",),
)
def torque_end(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """Does the arm stay where it is when a stop ends the torques that have wound the spring of its impedance?"""
    start = arm.state.q[6]
    with (
        suppress(MotionAborted, StreamError),
        arm.fri(
            "torque", mode=JointImpedance(_SPRING), period_ms=_PERIOD, law=wind_up, params={"torque": _TORQUE}
        ) as session,
    ):
        session.wait(0.8)
        wound = arm.state.q[6]
        arm.stop()
    if abs(wound - start) < _WOUND:
        raise Unfit(f"{_TORQUE:g} Nm have turned A7 by {math.degrees(wound - start):.2f} deg only")
    rest = arm.wait_for_rest().q[6]
    return (at_most("A7 turns after the stop by", abs(rest - wound), 0.5 * abs(wound - start), "rad"),)


@step(movement=Movement("A7", "by less than 1 deg", "1.2 deg/s, by FRI commands"), needs=("fri_position",))
def command_delay(arm: Arm, person: Person) -> tuple[Comparison, ...]:
    """By how many periods are the set-points of an overlay behind its commands?"""
    params = {"velocity": _SLOW, "at": _NEVER, "pause": 0.0}
    with arm.fri(
        "position", period_ms=_PERIOD, law=hold_back_once, params=params, history=_HISTORY
    ) as session:
        session.wait(0.8)
        states = session.history()
    moving = [
        state for state in states if state.session is SessionState.COMMANDING_ACTIVE and 0.3 < state.t < 0.6
    ]
    # the law commanded an offset of velocity t^2 / 2; FRI 2 sends no set-points, so that the measured position counts
    offsets = [
        float(state.q_cmd[6] if math.isfinite(state.q_cmd[6]) else state.q[6]) - state.q_ipo[6]
        for state in moving
    ]
    delays = [
        state.t - math.sqrt(max(0.0, 2.0 * offset / _SLOW))
        for state, offset in zip(moving, offsets, strict=True)
    ]
    if not delays:
        raise Unfit("the overlay did not last 0.3 s", hint="check the connection with heptarm doctor --fri")
    return (
        near(
            "set-points behind the commands", statistics.median(delays) * 1e3 / _PERIOD, 1.5, 0.4, "periods"
        ),
    )
