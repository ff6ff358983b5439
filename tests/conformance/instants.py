"""Feedback that agrees with itself, and goals with times, velocities or accelerations instead of positions."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from heptarm.values.checks import Array
from tests.conformance.case import (
    REST,
    TOUCH,
    aborted,
    case,
    goal,
    last,
    point,
    rests,
    step,
    succeeds,
    swing,
    tolerances,
)
from tests.conformance.client import Client, ReceivedFeedback


def consistent(
    reported: list[ReceivedFeedback], wanted: TrajectoryGoal, here: Array, joints: tuple[str, ...]
) -> None:
    """All numbers of a message belong to one instant of a trajectory of positions only."""
    times = np.array([0.0, *(one.time for one in wanted.points)])
    order = [wanted.joints.index(joint) for joint in joints]
    path = np.vstack([here, *(np.array(one.q)[order] for one in wanted.points)])
    assert reported
    for one in reported:
        there = np.array([np.interp(one.time, times, path[:, joint]) for joint in range(7)])
        # messages have whole nanoseconds; the arm starts from its set-point
        np.testing.assert_allclose(one.desired.q, there, atol=2e-3)
        np.testing.assert_allclose(one.error, one.desired.q - one.actual.q, atol=1e-9)
        if one.index is not None:
            passed = [int((times[1:] < one.time + rounding).sum()) for rounding in (-1e-8, 1e-8)]
            assert one.index in passed, (one.index, one.time)


@case
def desired_time_and_index_belong_to_one_instant(client: Client) -> None:
    here = rests(client)
    path = swing(client)
    wanted = goal(client, *(point(0.2 * k, here + path * np.sin(1.0 + k)) for k in range(1, 6)))
    consistent(client.feedback(succeeds(client, wanted)), wanted, here, client.joints)


@case
def times_and_indices_of_feedback_never_fall(client: Client) -> None:
    here = rests(client)
    path = swing(client)
    wanted = goal(client, *(point(0.15 * k, here + 0.2 * k * path) for k in range(1, 6)))
    reported = client.feedback(succeeds(client, wanted))
    for a, b in itertools.pairwise(reported):
        assert a.time <= b.time and a.elapsed <= b.elapsed
        assert a.index is None or b.index is None or a.index <= b.index
    assert all(0.0 <= one.time <= wanted.points[-1].time + 60.0 for one in reported)


@case
def feedback_of_permuted_joints_belongs_to_one_instant(client: Client) -> None:
    here = rests(client)
    path = swing(client)
    order = [6, 2, 0, 1, 5, 3, 4]
    points = tuple(
        TrajectoryPoint(time, tuple((here + size * path)[order].tolist()))
        for time, size in ((0.4, 0.5), (0.9, 1.0))
    )
    wanted = TrajectoryGoal(tuple(client.joints[i] for i in order), points)
    consistent(client.feedback(succeeds(client, wanted)), wanted, here, client.joints)


@case
def feedback_begins_before_the_first_point_and_ends_after_the_last(client: Client) -> None:
    here = rests(client)
    path = swing(client)
    wanted = goal(client, point(0.6, here + path / 2), point(1.0, here + path))
    numbers = [one.index for one in client.feedback(succeeds(client, wanted)) if one.index is not None]
    assert not numbers or (numbers[0] <= 1 and max(numbers) <= 2)


@case
def at_full_speed_both_times_are_equal(client: Client) -> None:
    reported = client.feedback(succeeds(client, step(client, time=1.0)))
    for one in reported:
        if one.time < 1.0 - 1e-6:  # a spline has speeds and no times
            assert abs(one.time - one.elapsed) < (1e-6 if client.timely else 0.6), one


# ------------------------------------------------------------------------------------- an end that moves


def moving_end(client: Client) -> tuple[TrajectoryGoal, Array]:
    here = rests(client)
    away = 0.1 * (np.arange(7) == 6) * (-1.0 if here[6] > 0 else 1.0)
    moving = tuple((2.0 * away).tolist())
    points = (point(0.5, here + away / 2, dq=moving), point(1.0, here + 1.5 * away, dq=moving))
    return goal(client, *points), here + 1.5 * away


@case
def an_end_that_moves_succeeds_with_the_default_tolerances(client: Client) -> None:
    assert client.set(allow_nonzero_velocity_at_trajectory_end=True)
    wanted, there = moving_end(client)
    sent = client.send(wanted)
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED and ended.code is ErrorCode.SUCCESSFUL, ended
    assert np.abs(rests(client) - there).max() < 0.1, "nobody goes on for it: the arm brakes"


@case
def an_end_that_moves_may_be_followed_by_a_goal(client: Client) -> None:
    assert client.set(allow_nonzero_velocity_at_trajectory_end=True)
    wanted, _ = moving_end(client)
    sent = client.send(wanted)
    assert client.result(sent).outcome is GoalOutcome.SUCCEEDED
    succeeds(client, step(client))


@case
def an_end_that_moves_fails_where_the_arm_does_not_follow(client: Client) -> None:
    assert client.set(allow_nonzero_velocity_at_trajectory_end=True)
    wanted, _ = moving_end(client)
    client.behave("frozen")
    sent = client.send(replace(wanted, goal_time=0.2))
    aborted(client.result(sent), ErrorCode.GOAL_TOLERANCE_VIOLATED)


# ------------------------------------------------------------------------------------------ integration


@case
def velocities_alone_where_it_is_allowed(client: Client) -> None:
    assert client.set(allow_integration_in_goal_trajectories=True)
    here = rests(client)
    speed = swing(client)
    points = (
        TrajectoryPoint(0.5, dq=tuple(speed.tolist())),
        TrajectoryPoint(1.0, dq=tuple(speed.tolist())),
        TrajectoryPoint(1.5, dq=REST),
    )
    sent = client.send(TrajectoryGoal(client.joints, points))
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    np.testing.assert_allclose(client.place().q, here + speed, atol=TOUCH)


@case
def accelerations_alone_where_it_is_allowed(client: Client) -> None:
    assert client.set(allow_integration_in_goal_trajectories=True)
    here = rests(client)
    change = swing(client)
    one, other = tuple(change.tolist()), tuple((-change).tolist())
    points = (
        TrajectoryPoint(0.5, ddq=one),
        TrajectoryPoint(1.0, ddq=REST),
        TrajectoryPoint(1.5, ddq=other),
        TrajectoryPoint(2.0, ddq=REST),
    )
    sent = client.send(TrajectoryGoal(client.joints, points))
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    # the speed is 0.25, 0.5, 0.25 and 0 of the acceleration, so the trapezoids add up to half of it
    np.testing.assert_allclose(client.place().q, here + change / 2.0, atol=TOUCH)


@case
def points_without_any_numbers_are_rejected_even_there(client: Client) -> None:
    assert client.set(allow_integration_in_goal_trajectories=True)
    assert not client.send(TrajectoryGoal(client.joints, (TrajectoryPoint(1.0),))).accepted
    short = TrajectoryPoint(1.0, dq=(0.0,) * 6)
    assert not client.send(TrajectoryGoal(client.joints, (short,))).accepted


@case
def integration_into_a_limit_is_rejected(client: Client) -> None:
    assert client.set(allow_integration_in_goal_trajectories=True)
    fast = tuple((0.5 * (np.arange(7) == 1)).tolist())
    points = (TrajectoryPoint(1.0, dq=fast), TrajectoryPoint(9.0, dq=fast), TrajectoryPoint(10.0, dq=REST))
    assert not client.send(TrajectoryGoal(client.joints, points)).accepted


# ------------------------------------------------------------------------------------- absurd times


@case
def rejects_a_trajectory_of_years(client: Client) -> None:
    assert not client.send(step(client, time=1e8)).accepted
    succeeds(client, step(client, time=0.4, size=0.5))


@case
def rejects_a_start_in_years(client: Client) -> None:
    assert not client.send(step(client, start=client.now() + 1e7)).accepted


@case
def an_absurd_goal_time_does_no_harm(client: Client) -> None:
    succeeds(client, step(client, time=0.4, size=0.5, goal_time=1e9))


# ------------------------------------------------------------------------------------- cmd_timeout


@case
def the_command_timeout_ends_what_would_wait_for_ever(client: Client) -> None:
    assert client.set(constraints__goal_time=0.2, cmd_timeout=0.5)
    client.behave("frozen")
    sent = client.send(step(client, time=0.3, goal_time=-1.0))
    ended = client.result(sent)
    aborted(ended, ErrorCode.GOAL_TOLERANCE_VIOLATED)
    assert "cmd_timeout" in ended.text


@case
def a_command_timeout_within_the_goal_time_does_not_count(client: Client) -> None:
    assert client.set(constraints__goal_time=1.0, cmd_timeout=0.1)
    client.behave("frozen")
    sent = client.send(step(client, time=0.3, goal_tolerance=tolerances(client, 0.0)))
    ended = client.result(sent)
    aborted(ended, ErrorCode.GOAL_TOLERANCE_VIOLATED)
    assert "cmd_timeout" not in ended.text


@case
def a_negative_command_timeout_is_refused(client: Client) -> None:
    assert not client.set(cmd_timeout=-1.0)


# ------------------------------------------------------------------------------------- the topic


@case
def a_trajectory_on_the_topic_replaces_another_without_a_stop(client: Client) -> None:
    here = rests(client)
    away = 0.4 * (np.arange(7) == 6) * (-1.0 if here[6] > 0 else 1.0)
    for k in range(1, 5):
        wanted = goal(client, point(0.8, here + 0.25 * k * away))
        client.topic(wanted)
        client.sleep(0.2)
    for _ in range(1000):
        if np.abs(rests(client) - last(wanted, client)).max() < TOUCH:
            return
    raise AssertionError("the last one is not followed to its end")
