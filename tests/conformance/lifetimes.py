"""Feedback over the life of a goal, and streams beside goals."""

from __future__ import annotations

import itertools

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import (
    REST,
    TOUCH,
    aborted,
    arrives,
    case,
    feedback_of,
    goal,
    long,
    point,
    rests,
    stays,
    step,
    succeeds,
    swing,
    under_way,
    undisturbed,
)
from tests.conformance.client import Client, ReceivedFeedback
from tests.conformance.streams import paced, streamed

#: Feedback may be this late on a busy machine [s].
LATE = 0.3


@case
def velocities_of_feedback_belong_to_its_positions(client: Client) -> None:
    def measured() -> list[ReceivedFeedback]:
        sent = succeeds(client, step(client, time=1.0))
        return feedback_of(client, sent, lambda found: len(found) > 2)

    reported = undisturbed(client, measured)
    for a, b in itertools.pairwise(reported):
        dt = b.time - a.time
        if dt > 0.0 and b.time < 1.0:
            mean = (b.desired.q - a.desired.q) / dt
            # the trapezoidal rule is exact but for the curvature of a cubic's velocity
            np.testing.assert_allclose(mean, (a.desired.dq + b.desired.dq) / 2.0, atol=2e-3 + 0.2 * dt**2)


@case
def feedback_ends_with_its_goal(client: Client) -> None:
    sent = succeeds(client, step(client))
    for _ in range(20):
        count = len(feedback_of(client, sent))  # it takes another path than the result
        client.sleep(LATE)
        if len(client.feedback(sent)) == count:
            return
    raise AssertionError("the feedback does not end")


@case
def feedback_of_the_next_goal_begins_at_its_start(client: Client) -> None:
    def measured() -> list[ReceivedFeedback]:
        succeeds(client, step(client, time=0.8))
        return feedback_of(client, succeeds(client, step(client, time=0.5)))

    reported = undisturbed(client, measured)
    assert 0.0 <= reported[0].time < LATE
    assert max(one.time for one in reported) < 0.5 + 60.0


@case
def feedback_of_a_goal_that_takes_anothers_place_begins_at_its_start(client: Client) -> None:
    def measured() -> list[ReceivedFeedback]:
        here = client.place().q
        first = client.send(long(client))
        under_way(client, here)
        second = succeeds(client, step(client, time=1.0))
        assert client.result(first).outcome in client.preempted
        assert max(one.time for one in feedback_of(client, first)) < 5.0
        return feedback_of(client, second)

    assert 0.0 <= undisturbed(client, measured)[0].time < LATE


@case
def feedback_of_some_joints_has_all_of_them(client: Client) -> None:
    assert client.set(allow_partial_joints_goal=True)
    here = rests(client)
    there = float(here[6] + (-0.1 if here[6] > 0 else 0.1))
    wanted = TrajectoryGoal((client.joints[6],), (TrajectoryPoint(0.6, (there,)),))
    sent = client.send(wanted)
    assert sent.accepted and client.result(sent).outcome is GoalOutcome.SUCCEEDED
    for one in feedback_of(client, sent):
        assert one.joints == client.joints
        np.testing.assert_allclose(one.desired.q[:6], here[:6], atol=2e-3)


@case
def feedback_of_a_frozen_arm_has_its_error(client: Client) -> None:
    here = rests(client)
    wanted = step(client, time=0.5, goal_time=0.3)
    client.behave("frozen")
    sent = client.send(wanted)
    aborted(client.result(sent), ErrorCode.GOAL_TOLERANCE_VIOLATED)
    reported = feedback_of(
        client, sent, lambda found: bool(found) and bool(np.abs(found[-1].error).max() > 0.05)
    )
    for one in reported:
        np.testing.assert_allclose(one.actual.q, here, atol=2e-3)
        np.testing.assert_allclose(one.error, one.desired.q - one.actual.q, atol=1e-9)


@case
def at_half_the_speed_trajectory_time_is_half_of_the_time_that_passed(client: Client) -> None:
    client.override(0.5)

    def measured() -> list[ReceivedFeedback]:
        reported = feedback_of(client, succeeds(client, step(client, time=0.8)))
        return [one for one in reported if one.elapsed > 0.4 and one.time < 0.75]

    under = undisturbed(client, measured)
    assert under
    for one in under:
        assert 0.35 < one.time / one.elapsed < 0.65, (one.time, one.elapsed)


@case
def feedback_of_a_cancelled_goal_stays_on_its_path(client: Client) -> None:
    here = rests(client)
    away = 3.0 * swing(client)
    sent = client.send(goal(client, point(3.0, here + away)))
    under_way(client, here, 0.02)
    assert client.cancel(sent)
    assert client.result(sent).outcome is GoalOutcome.CANCELED
    for one in feedback_of(client, sent):
        along = float((one.desired.q - here) @ away / (away @ away))
        np.testing.assert_allclose(one.desired.q, here + along * away, atol=3e-3)


# ------------------------------------------------------------------------------- streams beside goals


@case
def a_stream_that_comes_in_pairs_is_followed_to_its_end(client: Client) -> None:
    here, rate, count = rests(client), 25.0, 20
    away = 0.1 * (np.arange(7) == 6) * (-1.0 if here[6] > 0 else 1.0)

    def send(k: int) -> None:
        for half in (k - 0.5, k):
            client.topic(goal(client, point(0.5 / rate, here + half / count * away)))

    paced(client, rate, count, send)
    arrives(client, here + away)


@case
def a_stream_of_one_position_holds_the_arm(client: Client) -> None:
    here = rests(client)
    paced(client, 50.0, 30, lambda k: client.topic(goal(client, point(0.02, here, dq=REST))))
    stays(client, here)


@case
def a_stream_may_follow_a_cancelled_goal(client: Client) -> None:
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    assert client.cancel(sent)
    assert client.result(sent).outcome is GoalOutcome.CANCELED
    rests(client)
    _, last = streamed(client, seconds=0.4)
    arrives(client, last)
    assert np.abs(client.place().q - last).max() < TOUCH
