"""Goals that end early: preempted or cancelled."""

from __future__ import annotations

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome
from heptarm.values.checks import Array
from tests.conformance.case import (
    REST,
    TOUCH,
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
    undisturbed,
)
from tests.conformance.client import Client, SentGoal

# ------------------------------------------------------------------------------------- preemption


@case
def a_goal_takes_the_place_of_another(client: Client) -> None:
    here = client.place().q
    first = client.send(long(client))
    under_way(client, here)
    wanted = step(client, time=0.6, size=-0.5)
    second = client.send(wanted)
    assert first.accepted and second.accepted
    ended = client.result(first)
    assert ended.outcome in client.preempted and ended.code is ErrorCode.INVALID_GOAL, ended
    assert client.result(second).outcome is GoalOutcome.SUCCEEDED
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH


@case
def many_goals_in_a_row_and_only_the_last_succeeds(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    sent = []
    for k in range(5):
        # only the last one may end: a busy machine may take long to send the next
        time = 1.0 if k == 4 else 5.0
        sent.append(client.send(goal(client, point(time, here + path * (-1) ** k * 0.5, dq=REST))))
        client.sleep(0.1)
    ends = [client.result(one) for one in sent]
    assert all(end.outcome in client.preempted for end in ends[:-1])
    assert ends[-1].outcome is GoalOutcome.SUCCEEDED


@case
def a_goal_with_a_future_start_takes_the_place_at_once(client: Client) -> None:
    here = client.place().q
    first = client.send(long(client))
    under_way(client, here)
    here = client.place().q
    second = client.send(goal(client, point(0.6, here, dq=REST), start=client.now() + 1.0))
    assert second.accepted
    ended = client.result(first)
    assert ended.outcome in client.preempted and ended.code is ErrorCode.INVALID_GOAL, ended
    assert client.result(second).outcome is GoalOutcome.SUCCEEDED
    assert np.abs(client.place().q - here).max() < TOUCH


@case
def no_jump_when_a_goal_takes_the_place_of_another(client: Client) -> None:
    def replaced() -> float:
        here = client.place().q
        client.send(long(client))
        under_way(client, here, 0.05)
        here = client.place().q
        second = client.send(goal(client, point(1.2, here, dq=REST)))
        assert second.accepted
        assert client.result(second).outcome is GoalOutcome.SUCCEEDED
        return max(float(np.abs(one.error).max()) for one in client.feedback(second))

    assert undisturbed(client, replaced) < 0.05


# ------------------------------------------------------------------------------------- cancelling


@case
def cancelling_brakes_and_holds(client: Client) -> None:
    here = client.place().q
    wanted = long(client)
    sent = client.send(wanted)
    under_way(client, here, 0.03)
    assert client.cancel(sent)
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.CANCELED and ended.code is ErrorCode.SUCCESSFUL, ended
    rest = rests(client)
    assert np.abs(rest - here).max() > 0.02, "it was under way"
    assert np.abs(rest - last(wanted, client)).max() > 0.02, "it did not go to the end"
    stays(client, rest)


@case
def cancelling_goes_straight_on_while_it_brakes(client: Client) -> None:
    here = client.place().q
    joint = 6
    sign = -1.0 if here[joint] > 0 else 1.0
    sent = client.send(goal(client, point(4.0, here + sign * 1.8 * (np.arange(7) == joint))))
    under_way(client, here, 0.3)
    before = client.place()
    client.cancel(sent)
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.CANCELED, ended
    rest = rests(client)
    # 0.45 rad/s at 2 rad/s² need 0.05 rad; some time passes between looking and braking
    assert sign * (rest[joint] - before.q[joint]) > 0.02
    assert sign * (rest[joint] - here[joint]) < 1.7, "it did not go to the end"
    assert np.abs(np.delete(rest - here, joint)).max() < 5e-3


def _mid_air(client: Client, far: float) -> tuple[SentGoal, float]:
    """A7 moves at 0.4 rad/s and has passed this angle [rad]: its goal, and its direction."""
    here = client.place().q
    sign = -1.0 if here[6] > 0 else 1.0
    sent = client.send(goal(client, point(4.0, here + sign * 1.6 * (np.arange(7) == 6))))
    assert sent.accepted
    under_way(client, here, far)
    return sent, sign


def _brakes(client: Client) -> tuple[Array, Array]:
    """Cancel a motion of A7: times [s] and positions [rad] of every joint state from then on."""
    sent, sign = _mid_air(client, 0.2)
    begin = client.now()
    client.cancel(sent)
    assert client.result(sent).outcome is GoalOutcome.CANCELED
    rests(client)
    track = client.track(begin)
    times, travel = np.array([time for time, _ in track]), np.array([sign * q[6] for _, q in track])
    apart = (
        np.diff(times, prepend=-1.0) > 2e-3
    )  # stamps may be nearer where the clocks' difference was corrected
    return times[apart], travel[apart]


@case
def cancelling_makes_no_jump(client: Client) -> None:
    times, travel = undisturbed(client, lambda: _brakes(client))
    # a spline may go faster between two points than the trajectory does, and a stream falters on a busy machine
    speeds = np.diff(travel) / np.diff(times)
    assert travel[-1] - travel[0] > 5e-3, "it was under way"
    assert speeds.max() < 1.2, speeds
    assert speeds.min() > -0.1, speeds


@case
def cancelling_brakes_as_the_parameter_reports(client: Client) -> None:
    assert client.set(max_deceleration_on_cancel=0.5)
    found: list[float] = []
    # a stream that falters on a busy machine brakes, too; no such run can pass by chance
    while not found or (len(found) < 5 and not 0.3 < found[-1] < 0.8):
        times, travel = undisturbed(client, lambda: _brakes(client))
        left = travel[-1] - travel
        # with constant deceleration the square root of the remaining distance falls linearly
        inside = (left > 0.01) & (left < 0.1)
        assert inside.sum() > 5, left
        slope, _ = np.polyfit(times[inside], np.sqrt(left[inside]), 1)
        found.append(float(2.0 * slope**2))
    assert 0.3 < found[-1] < 0.8, f"the arm has braked with {found} rad/s²"


@case
def a_goal_right_after_a_cancellation_is_accepted(client: Client) -> None:
    here = client.place().q
    first = client.send(long(client))
    under_way(client, here)
    client.cancel(first)
    wanted = step(client, time=0.8, size=-0.5)
    second = client.send(wanted)
    assert second.accepted
    assert client.result(first).outcome is GoalOutcome.CANCELED
    assert client.result(second).outcome is GoalOutcome.SUCCEEDED
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH


@case
def cancelling_before_a_future_start(client: Client) -> None:
    here = client.place().q
    sent = client.send(step(client, start=client.now() + 3.0))
    client.sleep(0.1)
    assert client.cancel(sent)
    assert client.result(sent).outcome is GoalOutcome.CANCELED
    stays(client, here)


@case
def cancelling_an_ended_goal_does_nothing(client: Client) -> None:
    first = succeeds(client, step(client, time=0.3, size=0.3))
    wanted = step(client, time=0.8)
    second = client.send(wanted)
    client.sleep(0.2)
    client.cancel(first)
    assert client.result(second).outcome is GoalOutcome.SUCCEEDED


@case
def the_deceleration_is_a_parameter(client: Client) -> None:
    def braked() -> float:
        sent, sign = _mid_air(client, 0.15)
        client.cancel(sent)
        client.result(sent)
        # the last report is close to where the arm started to brake; a client may look much later
        return sign * float(rests(client)[6] - client.feedback(sent)[-1].actual.q[6])

    paths = []
    for deceleration in (8.0, 0.5):
        assert client.set(max_deceleration_on_cancel=deceleration)
        paths.append(undisturbed(client, braked))
    assert paths[1] > paths[0] + 0.05, paths
