"""The surroundings of goals: parameters, the override, the topic, the node's state."""

from __future__ import annotations

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import (
    REST,
    TOUCH,
    aborted,
    arrives,
    case,
    goal,
    last,
    long,
    point,
    rests,
    stays,
    step,
    succeeds,
    swing,
    under_way,
)
from tests.conformance.client import Client

# ------------------------------------------------------------------------------------- parameters


@case
def an_end_that_moves_where_it_is_allowed(client: Client) -> None:
    assert client.set(
        allow_nonzero_velocity_at_trajectory_end=True, constraints__stopped_velocity_tolerance=0.0
    )
    here = client.place().q
    sign = -1.0 if here[6] > 0 else 1.0
    moving = tuple(sign * 0.2 * (np.arange(7) == 6))
    sent = client.send(goal(client, point(0.6, here + sign * 0.1 * (np.arange(7) == 6), dq=moving)))
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    rest = rests(client)
    assert abs(rest[6] - here[6]) < 0.3, "nobody goes on for it: the arm brakes"


@case
def some_joints_where_it_is_allowed(client: Client) -> None:
    assert client.set(allow_partial_joints_goal=True)
    here = client.place().q
    some = (client.joints[6], client.joints[3])
    sent = client.send(TrajectoryGoal(some, (TrajectoryPoint(0.6, (here[6] + 0.1, here[3] + 0.05)),)))
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    moved = client.place().q - here
    assert abs(moved[6] - 0.1) < TOUCH and abs(moved[3] - 0.05) < TOUCH
    assert np.abs(np.delete(moved, [3, 6])).max() < 2e-3, "the others hold"


@case
def a_parameter_out_of_its_range_is_refused(client: Client) -> None:
    assert not client.set(max_deceleration_on_cancel=-1.0)
    assert not client.set(execution="teleport")


# ------------------------------------------------------------------------------------- the override


def _scaled(client: Client, factor: float) -> None:
    here = client.place().q
    path = swing(client)
    client.override(factor)
    client.sleep(0.5)
    wanted = goal(client, point(0.5, here + path, dq=REST))
    for _ in range(2):
        sent = client.send(wanted)
        ended = client.result(sent)
        assert ended.outcome is GoalOutcome.SUCCEEDED, ended
        reported = client.feedback(sent)
        for one in [one for one in reported if one.elapsed > 0.3]:
            late = one.time - factor * one.elapsed
            # a spline of the cabinet takes less time than a trajectory that is slower than it need be
            assert abs(late) < (0.02 if client.timely else 0.4), (one.time, one.elapsed)
        assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH
        wanted = goal(client, point(0.5, here, dq=REST))


@case
def a_quarter_of_the_speed_takes_four_times_as_long(client: Client) -> None:
    _scaled(client, 0.25)


@case
def a_little_less_speed_takes_a_little_longer(client: Client) -> None:
    _scaled(client, 0.87)


@case
def full_speed_takes_its_time(client: Client) -> None:
    _scaled(client, 1.0)


# --------------------------------------------------------------------------- topic, deactivation, others


@case
def a_trajectory_on_the_topic_is_followed(client: Client) -> None:
    wanted = step(client, time=0.5)
    client.topic(wanted)
    arrives(client, last(wanted, client))


@case
def a_trajectory_on_the_topic_takes_a_goals_place(client: Client) -> None:
    here = client.place().q
    first = client.send(long(client))
    under_way(client, here)
    wanted = step(client, time=0.5, size=-0.5)
    client.topic(wanted)
    ended = client.result(first)
    assert ended.outcome in client.preempted and ended.code is ErrorCode.INVALID_GOAL, ended
    arrives(client, last(wanted, client))


@case
def a_goal_takes_the_place_of_a_trajectory_on_the_topic(client: Client) -> None:
    here = client.place().q
    client.topic(long(client))
    under_way(client, here)
    succeeds(client, step(client, time=0.6, size=-0.5))


@case
def deactivating_ends_a_goal(client: Client) -> None:
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    client.activate(on=False)
    try:
        aborted(client.result(sent), ErrorCode.INVALID_GOAL)
        rest = rests(client)
        stays(client, rest)
    finally:
        client.activate(on=True)
    succeeds(client, step(client))


@case
def an_arm_at_its_goal_holds_it(client: Client) -> None:
    wanted = step(client, time=0.4)
    succeeds(client, wanted)
    client.sleep(1.0)
    stays(client, last(wanted, client), near=TOUCH)


@case
def a_goal_as_moveit_sends_it(client: Client) -> None:
    """All joints, stamp 0, first point now and here, full points, no tolerances."""
    here = client.place().q
    path = swing(client)
    duration, count = 1.2, 25
    points = []
    for x in np.linspace(0.0, 1.0, count):
        s, v, a = 10 * x**3 - 15 * x**4 + 6 * x**5, 30 * x**2 * (1 - x) ** 2, 60 * x - 180 * x**2 + 120 * x**3
        rate = path * v / duration
        points.append(
            point(float(x * duration), here + s * path, dq=tuple(rate), ddq=tuple(path * a / duration**2))
        )
    succeeds(client, goal(client, *points))
