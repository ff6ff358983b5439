"""Parts of cases: their registry, goals, and checks of the arm.

A case takes a client; the arm is at rest, follows commands, and all parameters have their defaults.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

import heptarm as ha
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, Tolerance, TrajectoryGoal, TrajectoryPoint
from heptarm.values.checks import Array
from tests.conformance.client import Client, ReceivedFeedback, ReceivedResult, SentGoal
from tests.conformance.stage import Stage
from tests.retry import reported, retry

Case = Callable[[Client], None]
Found = TypeVar("Found")
CASES: dict[str, Case] = {}

_OWN_BRAKES = "a motion of the cabinet brakes by the cabinet's own limits"
_PLANNED = "a spline of the cabinet is planned as a whole, so it cannot be extended"
_SPEEDS = "a spline of the cabinet has speeds and no times"
_AT_REST = "a spline of the cabinet ends at rest, so such a goal is refused"
#: Cases that do not apply to an execution, and why.
UNFIT: dict[str, dict[str, str]] = {
    "spline": {
        "the_deceleration_is_a_parameter": _OWN_BRAKES,
        "cancelling_brakes_as_the_parameter_reports": _OWN_BRAKES,
        "points_streamed_at_50_hz_are_followed": _PLANNED,
        "points_streamed_at_100_hz_are_followed": _PLANNED,
        "points_streamed_at_250_hz_are_followed": _PLANNED,
        "windows_of_moveit_servo_are_followed": _PLANNED,
        "a_stream_that_breaks_off_ends_at_its_last_point": _PLANNED,
        "a_stream_may_lose_messages": _PLANNED,
        "a_stream_goes_on_after_a_pause": _PLANNED,
        "a_stream_turns_back": _PLANNED,
        "a_slow_stream_is_followed_to_its_end": _PLANNED,
        "points_with_time_stamps_are_followed": _PLANNED,
        "streamed_joints_may_have_any_order": _PLANNED,
        "windows_without_velocities_that_break_off_end_at_their_last_point": _PLANNED,
        "a_stream_takes_the_place_of_a_goal": _PLANNED,
        "a_goal_takes_the_place_of_a_stream": _PLANNED,
        "what_is_wrong_in_a_stream_is_left_out": _PLANNED,
        "a_stream_of_some_joints_where_it_is_allowed": _PLANNED,
        "deactivating_ends_a_stream": _PLANNED,
        "an_old_window_is_left_out": _PLANNED,
        "velocities_of_feedback_belong_to_its_positions": _SPEEDS,
        "at_half_the_speed_trajectory_time_is_half_of_the_time_that_passed": _SPEEDS,
        "a_stream_that_comes_in_pairs_is_followed_to_its_end": _PLANNED,
        "a_stream_of_one_position_holds_the_arm": _PLANNED,
        "a_stream_may_follow_a_cancelled_goal": _PLANNED,
        "an_end_that_moves_where_it_is_allowed": _AT_REST,
        "an_end_that_moves_succeeds_with_the_default_tolerances": _AT_REST,
        "an_end_that_moves_may_be_followed_by_a_goal": _AT_REST,
        "an_end_that_moves_fails_where_the_arm_does_not_follow": _AT_REST,
    }
}

#: A small displacement, different for every joint so that a mix-up shows [rad].
STEP = np.array([0.05, -0.03, 0.04, 0.06, -0.05, 0.07, 0.1])
#: The arm moves near this position [rad].
HOME = np.array([0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, 0.0])
#: Largest error of an arm that has arrived [rad].
TOUCH = 0.012
#: A gap in the messages that shows a stalled machine, after which a trajectory continues with a jerk [s].
STALL = 0.08
REST = (0.0,) * 7


def case(function: Case) -> Case:
    """Register a case under its function's name."""
    CASES[function.__name__] = function
    return function


# -------------------------------------------------------------------------------------------- goals


def point(time: float, q: Array, **more: tuple[float, ...]) -> TrajectoryPoint:
    return TrajectoryPoint(time, tuple(float(value) for value in q), **more)


def goal(client: Client, *points: TrajectoryPoint, **more: object) -> TrajectoryGoal:
    return TrajectoryGoal(client.joints, points, **more)  # type: ignore[arg-type]


def swing(client: Client) -> Array:
    """A small displacement of all joints, back and forth, so that many cases do not move the arm away."""
    side = float((client.place().q - HOME) @ STEP)
    return -STEP if side > 0.0 else STEP


def step(client: Client, *, time: float = 0.6, size: float = 1.0, **more: object) -> TrajectoryGoal:
    """A goal a little away, at rest."""
    there = client.place().q + size * swing(client)
    return goal(client, point(time, there, dq=REST), **more)


def tolerances(client: Client, position: float, **more: float) -> tuple[Tolerance, ...]:
    return tuple(Tolerance(joint, position, **more) for joint in client.joints)


def last(wanted: TrajectoryGoal, client: Client) -> Array:
    """Final positions of a goal, in the arm's order."""
    values = dict(zip(wanted.joints, wanted.points[-1].q))
    return np.array([values[joint] for joint in client.joints])


def succeeds(client: Client, wanted: TrajectoryGoal) -> SentGoal:
    def attempt() -> tuple[SentGoal, ReceivedResult]:
        sent = client.send(wanted)
        assert sent.accepted, sent
        return sent, client.result(sent)

    sent, ended = retry(attempt, lambda outcome: reported(outcome[1].text) if type(outcome) is tuple else "")
    assert ended.outcome is GoalOutcome.SUCCEEDED and ended.code is ErrorCode.SUCCESSFUL, ended
    if len(wanted.joints) == 7:
        assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH
    return sent


def long(client: Client, **more: object) -> TrajectoryGoal:
    """A goal that something else ends; it takes long enough for a busy machine."""
    return step(client, time=5.0, size=5.0, **more)


def stays(client: Client, before: Array, *, near: float = 2e-3) -> None:
    """The arm has not moved, and does not."""
    client.sleep(0.15)
    assert np.abs(client.place().q - before).max() < near


def quiet(client: Client) -> bool:
    """Whether no joint states come any more."""
    last = client.track(0.0)[-1][0]
    client.sleep(0.3)
    return not client.track(np.nextafter(last, np.inf))


def arrives(client: Client, there: Array) -> None:
    """Wait until the arm is at a position, at rest."""
    for _ in range(1000):
        if np.abs(rests(client) - there).max() < TOUCH:
            return
    raise AssertionError("the arm does not arrive")


def under_way(client: Client, here: Array, far: float = 0.01) -> None:
    """Wait until the arm has moved this far from a position [rad]; an execution may start late."""
    for _ in range(1000):
        if np.abs(client.place().q - here).max() > far:
            return
        client.sleep(0.02)
    raise AssertionError("the arm does not move")


def rests(client: Client) -> Array:
    """Wait for rest; returns the position."""
    for _ in range(200):
        before = client.place()
        client.sleep(0.05)
        after = client.place()
        # an arm whose plant had no processor time seems to rest, except for its velocity
        if np.abs(after.q - before.q).max() < 2e-4 and np.abs([before.dq, after.dq]).max() < 0.01:
            return after.q
    raise AssertionError("the arm does not come to rest")


def newest(arm: ha.Arm) -> ha.State:
    """The state of an arm that a test has connected; a busy machine may hand it over late."""
    for _ in range(1000):
        try:
            return arm.state
        except ha.StaleState:
            time.sleep(0.02)
    raise AssertionError("no states come")


def braked(stage: Stage) -> None:
    """Wait until the cabinet has ended the motion of a silent node; a busy one is late, too."""
    with ha.connect(stage.target, control=False, watchdog=5.0, timeout=30.0) as arm:
        for _ in range(1000):
            if not newest(arm).motion.active:
                return
            time.sleep(0.02)
    raise AssertionError("the cabinet does not end the motion")


def undisturbed(client: Client, measure: Callable[[], Found]) -> Found:
    """Discard measurements during stalls of the machine, which the stamps of joint states reveal."""
    for _ in range(30):
        begin = client.now()
        found = measure()
        times = [time for time, _ in client.track(begin)]
        if np.diff(times).max() < STALL:
            return found
    raise AssertionError("the machine stands still again and again")


def feedback_of(
    client: Client, sent: SentGoal, enough: Callable[[list[ReceivedFeedback]], bool] = bool
) -> list[ReceivedFeedback]:
    """Wait for feedback of a goal that has ended: it takes another path than the result."""
    for _ in range(1000):
        if enough(found := client.feedback(sent)):
            return found
        client.sleep(0.02)
    raise AssertionError("the feedback does not come")


def aborted(ended: ReceivedResult, code: ErrorCode) -> None:
    assert ended.outcome is GoalOutcome.ABORTED and ended.code is code, ended
    assert ended.text, "the client receives the reason"
