"""Goals that succeed: points, stamps, feedback."""

from __future__ import annotations

import itertools

import numpy as np

from heptarm.ros.trajectory.goal import GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import REST, TOUCH, case, goal, last, point, stays, step, succeeds, swing
from tests.conformance.client import Client

# ------------------------------------------------------------------------------------------ success


@case
def one_point(client: Client) -> None:
    wanted = goal(client, point(0.5, client.place().q + swing(client)))
    succeeds(client, wanted)
    client.sleep(0.3)
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH, "it holds that point"


@case
def one_point_with_velocity(client: Client) -> None:
    wanted = step(client, time=0.5)
    succeeds(client, wanted)
    stays(client, client.place().q)


@case
def several_points(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    wanted = goal(client, *(point(0.3 * (k + 1), here + path * np.sin(1.0 + k)) for k in range(4)))
    sent = succeeds(client, wanted)
    reported = client.feedback(sent)
    assert reported
    for one in reported:
        before = sum(p.time < one.time for p in wanted.points)
        # a message is made in one step and the step may be right at a point's time
        assert one.index is None or abs(one.index - before) <= 1, (one.index, one.time)
    numbers = [one.index for one in reported if one.index is not None]
    assert numbers == sorted(numbers)


@case
def several_points_with_velocities(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    travel = [
        point(0.3 * k, here + 0.2 * k * path, dq=tuple(0.6 * path if k < 4 else REST)) for k in (1, 2, 3)
    ]
    succeeds(client, goal(client, *travel, point(1.4, here + 0.9 * path, dq=REST)))


@case
def points_with_accelerations(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    middle = point(0.5, here + path / 2, dq=tuple(1.8 * path / 1.0), ddq=REST)
    succeeds(client, goal(client, middle, point(1.0, here + path, dq=REST, ddq=REST)))


@case
def the_first_point_may_be_now(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    succeeds(client, goal(client, point(0.0, here, dq=REST), point(0.6, here + path, dq=REST)))


@case
def a_goal_to_where_the_arm_is(client: Client) -> None:
    here = client.place().q
    succeeds(client, goal(client, point(0.0, here)))
    stays(client, here)


@case
def joints_in_any_order(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    order = [3, 0, 6, 1, 5, 2, 4]
    there = here + path
    wanted = TrajectoryGoal(
        tuple(client.joints[i] for i in order), (TrajectoryPoint(0.6, tuple(there[order].tolist()), dq=REST),)
    )
    succeeds(client, wanted)
    assert np.abs(client.place().q - there).max() < TOUCH


@case
def feedback_is_in_the_arms_order_and_adds_up(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    there = here + path
    backwards = tuple(reversed(client.joints))
    sent = succeeds(
        client, TrajectoryGoal(backwards, (TrajectoryPoint(1.2, tuple(there[::-1].tolist()), dq=REST),))
    )
    reported = client.feedback(sent)
    assert len(reported) >= 3
    for one in reported:
        assert one.joints == client.joints
        np.testing.assert_allclose(one.error, one.desired.q - one.actual.q, atol=1e-9)
        low, high = np.minimum(here, there) - TOUCH, np.maximum(here, there) + TOUCH
        assert ((one.desired.q >= low) & (one.desired.q <= high)).all()
    assert all(a.elapsed <= b.elapsed for a, b in itertools.pairwise(reported))


@case
def the_next_goal_begins_where_the_last_ended(client: Client) -> None:
    for _ in range(3):
        succeeds(client, step(client, time=0.4, size=0.5))


@case
def an_empty_return(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    travel = (point(0.4, here + path), point(0.8, here))
    succeeds(client, goal(client, *travel))
    assert np.abs(client.place().q - here).max() < TOUCH


# ------------------------------------------------------------------------------------- stamps


@case
def a_start_in_the_future_is_waited_for(client: Client) -> None:
    here = client.place().q
    now = client.now()
    wanted = step(client, time=0.4, start=now + 0.8)
    sent = client.send(wanted)
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    before = [q for time, q in client.track(now) if time < now + 0.75]
    assert np.abs(np.array(before) - here).max() < 2e-3, "nothing moves before"
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH


@case
def a_trajectory_partly_in_the_past_is_joined(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    wanted = goal(
        client,
        point(0.0, here),
        point(0.4, here + path / 4),
        point(3.0, here + path),
        start=client.now() - 1.0,
    )
    sent = succeeds(client, wanted)
    first = client.feedback(sent)[0]
    if first.index is not None:
        assert first.index == 2, "the points of the past are not gone to"


@case
def an_end_in_the_future_is_accepted(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    succeeds(client, goal(client, point(2.2, here + path / 2), start=client.now() - 0.2))
