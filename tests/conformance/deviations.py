"""Goals that the arm does not follow to their end: tolerances."""

from __future__ import annotations

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, Tolerance
from tests.conformance.case import (
    aborted,
    case,
    goal,
    point,
    rests,
    stays,
    step,
    succeeds,
    swing,
    tolerances,
)
from tests.conformance.client import Client


@case
def wide_goal_tolerances_of_one_point(client: Client) -> None:
    succeeds(client, step(client, goal_tolerance=tolerances(client, 0.1)))


@case
def wide_goal_tolerances_of_several_points(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    travel = (point(0.3, here + path / 2), point(0.7, here + path))
    succeeds(client, goal(client, *travel, goal_tolerance=tolerances(client, 0.1)))


@case
def wide_path_tolerances(client: Client) -> None:
    succeeds(client, step(client, path_tolerance=tolerances(client, 0.3)))


@case
def a_frozen_arm_leaves_its_path(client: Client) -> None:
    here = client.place().q
    client.behave("frozen")
    sent = client.send(step(client, time=4.0, path_tolerance=tolerances(client, 0.01)))
    assert sent.accepted
    ended = client.result(sent)
    aborted(ended, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert any(joint in ended.text for joint in client.joints), ended.text
    stays(client, here)


@case
def a_lagging_arm_leaves_a_narrow_path(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=4.0, size=2.0, path_tolerance=tolerances(client, 0.01)))
    aborted(client.result(sent), ErrorCode.PATH_TOLERANCE_VIOLATED)


@case
def a_lagging_arm_may_on_a_wide_path(client: Client) -> None:
    client.behave("lags")
    wanted = step(client, time=1.0, size=2.0, path_tolerance=tolerances(client, 0.4), goal_time=20.0)
    sent = client.send(wanted)
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def one_joints_path_tolerance(client: Client) -> None:
    client.behave("frozen")
    only = (Tolerance(client.joints[6], 0.01),)
    sent = client.send(step(client, time=4.0, path_tolerance=only))
    ended = client.result(sent)
    aborted(ended, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def a_path_tolerance_counts_from_the_first_sample(client: Client) -> None:
    here = client.place().q
    client.behave("frozen")
    off = here + 0.03 * (np.arange(7) == 5)
    sent = client.send(goal(client, point(0.0, off), path_tolerance=tolerances(client, 0.01)))
    assert sent.accepted
    aborted(client.result(sent), ErrorCode.PATH_TOLERANCE_VIOLATED)
    stays(client, here)


@case
def a_frozen_arm_misses_its_goal(client: Client) -> None:
    here = client.place().q
    client.behave("frozen")
    sent = client.send(step(client, time=0.4, goal_time=0.2))
    ended = client.result(sent)
    aborted(ended, ErrorCode.GOAL_TOLERANCE_VIOLATED)
    assert any(joint in ended.text for joint in client.joints), ended.text
    stays(client, here)


@case
def one_joints_goal_tolerance(client: Client) -> None:
    client.behave("frozen")
    others = [Tolerance(joint, -1.0, -1.0) for joint in client.joints[:6]]
    wanted = step(
        client, time=0.4, goal_time=0.2, goal_tolerance=(*others, Tolerance(client.joints[6], 0.02))
    )
    ended = client.result(client.send(wanted))
    aborted(ended, ErrorCode.GOAL_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def an_impossible_goal_tolerance_fails(client: Client) -> None:
    sent = client.send(step(client, time=0.4, goal_time=0.3, goal_tolerance=tolerances(client, 1e-15)))
    aborted(client.result(sent), ErrorCode.GOAL_TOLERANCE_VIOLATED)


@case
def an_impossible_goal_time_fails(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=0.5, size=2.0, goal_time=1e-8))
    aborted(client.result(sent), ErrorCode.GOAL_TOLERANCE_VIOLATED)


@case
def a_lagging_arm_has_the_goal_time_to_arrive(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=0.5, goal_time=20.0))
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def erased_tolerances_are_not_enforced(client: Client) -> None:
    client.behave("frozen")
    none = tolerances(client, -1.0, velocity=-1.0)
    sent = client.send(step(client, time=0.4, path_tolerance=none, goal_tolerance=none))
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def an_erased_goal_time_waits(client: Client) -> None:
    client.behave("frozen")
    assert client.set(constraints__goal_time=0.2)
    sent = client.send(step(client, time=0.3, size=0.5, goal_time=-1.0))
    client.sleep(1.2)
    client.behave("follows")
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def tolerances_in_any_order(client: Client) -> None:
    client.behave("frozen")
    mixed = (
        Tolerance(client.joints[6], 0.01),
        Tolerance(client.joints[0], 0.5),
        Tolerance(client.joints[3], 0.5),
    )
    ended = client.result(client.send(step(client, time=4.0, path_tolerance=mixed)))
    aborted(ended, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def a_goals_tolerances_are_forgotten_after_it(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=4.0, size=2.0, path_tolerance=tolerances(client, 0.005)))
    aborted(client.result(sent), ErrorCode.PATH_TOLERANCE_VIOLATED)
    rests(client)
    sent = client.send(step(client, time=0.8, goal_time=20.0))
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def a_senseless_tolerance_means_the_defaults(client: Client) -> None:
    wrong = (Tolerance(client.joints[0], -3.0),)
    succeeds(client, step(client, path_tolerance=wrong))


@case
def a_tolerance_of_an_unknown_joint_means_the_defaults(client: Client) -> None:
    client.behave("lags")
    wrong = (Tolerance("elbow", 1e-6), Tolerance(client.joints[0], 1e-6))
    sent = client.send(step(client, path_tolerance=wrong, goal_time=20.0))
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def default_tolerances_can_change(client: Client) -> None:
    client.behave("frozen")
    assert client.set(constraints__A7__trajectory=0.01)
    ended = client.result(client.send(step(client, time=4.0)))
    aborted(ended, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def velocity_tolerance_on_the_path(client: Client) -> None:
    client.behave("frozen")
    fast = (Tolerance(client.joints[6], 0.0, 0.05),)
    ended = client.result(client.send(step(client, time=2.0, path_tolerance=fast)))
    aborted(ended, ErrorCode.PATH_TOLERANCE_VIOLATED)
