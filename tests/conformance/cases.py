"""Cases of the action's conformance: what upstream's suites ask of a server, in our words, and what an arm's should.

A case takes a client; the arm is at rest, follows, and all parameters have their defaults. `CASES` has them by name.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from heptarm.bridge.goal import Code, Goal, Outcome, Point, Tolerance
from heptarm.values.arrays import Array
from tests.conformance.client import Client, Ended, Sent

Case = Callable[[Client], None]
Found = TypeVar("Found")
CASES: dict[str, Case] = {}

_OWN_BRAKES = "a motion of the cabinet brakes by the cabinet's own limits"
#: What a way of execution cannot be asked, and why.
UNFIT: dict[str, dict[str, str]] = {
    "spline": {
        "the_deceleration_is_a_parameter": _OWN_BRAKES,
        "cancelling_brakes_as_the_parameter_says": _OWN_BRAKES,
        "an_end_that_moves_where_it_is_allowed": "a spline of the cabinet ends at rest, so such a goal is refused",
    }
}

#: A short way for every joint, different for each so that a mix-up shows [rad].
STEP = np.array([0.05, -0.03, 0.04, 0.06, -0.05, 0.07, 0.1])
#: Around here the arm moves [rad].
HOME = np.array([0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, 0.0])
#: An arm that has arrived is so near [rad].
TOUCH = 0.012
#: A machine from which nothing comes for so long stands still, and a trajectory goes on after that with a jerk [s].
STALL = 0.08
REST = (0.0,) * 7


def case(function: Case) -> Case:
    """Register a case under its function's name."""
    CASES[function.__name__] = function
    return function


# -------------------------------------------------------------------------------------------- goals


def point(time: float, q: Array, **more: tuple[float, ...]) -> Point:
    return Point(time, tuple(float(value) for value in q), **more)


def goal(client: Client, *points: Point, **more: object) -> Goal:
    return Goal(client.joints, points, **more)  # type: ignore[arg-type]


def swing(client: Client) -> Array:
    """A short way for all joints, back and forth: many cases do not lead the arm away."""
    side = float((client.place().q - HOME) @ STEP)
    return -STEP if side > 0.0 else STEP


def step(client: Client, *, time: float = 0.6, size: float = 1.0, **more: object) -> Goal:
    """To a place a little away, at rest there."""
    there = client.place().q + size * swing(client)
    return goal(client, point(time, there, dq=REST), **more)


def tolerances(client: Client, position: float, **more: float) -> tuple[Tolerance, ...]:
    return tuple(Tolerance(joint, position, **more) for joint in client.joints)


def last(wanted: Goal, client: Client) -> Array:
    """Where a goal ends, in the arm's order."""
    values = dict(zip(wanted.joints, wanted.points[-1].q))
    return np.array([values[joint] for joint in client.joints])


def succeeds(client: Client, wanted: Goal) -> Sent:
    sent = client.send(wanted)
    assert sent.accepted, sent
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED and ended.code is Code.SUCCESSFUL, ended
    if len(wanted.joints) == 7:
        assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH
    return sent


def long(client: Client, **more: object) -> Goal:
    """A goal that something else is to end: it takes much longer than that, on a busy machine, too."""
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
    """Wait until the arm is at a place, at rest."""
    for _ in range(1000):
        if np.abs(rests(client) - there).max() < TOUCH:
            return
    raise AssertionError("the arm does not arrive")


def under_way(client: Client, here: Array, far: float = 0.01) -> None:
    """Wait until the arm has moved so far from a place [rad]; a way of execution may take some time to begin."""
    for _ in range(1000):
        if np.abs(client.place().q - here).max() > far:
            return
        client.sleep(0.02)
    raise AssertionError("the arm does not move")


def rests(client: Client) -> Array:
    """Wait for rest; returns where it is."""
    for _ in range(200):
        before = client.place()
        client.sleep(0.05)
        after = client.place()
        # an arm whose plant had no time to go on seems to stand, but for its velocity
        if np.abs(after.q - before.q).max() < 2e-4 and np.abs([before.dq, after.dq]).max() < 0.01:
            return after.q
    raise AssertionError("the arm does not come to rest")


def aborted(ended: Ended, code: Code) -> None:
    assert ended.outcome is Outcome.ABORTED and ended.code is code, ended
    assert ended.text, "the client is told why"


# ------------------------------------------------------------------------------------ refusals: data


@dataclass(frozen=True)
class Refusal:
    """A goal that has to be rejected, with the code where codes are told."""

    change: Callable[[Client, Goal], Goal]
    code: Code


def _points(wanted: Goal, **changes: object) -> Goal:
    """The same changes for the last point."""
    return replace(wanted, points=(*wanted.points[:-1], replace(wanted.points[-1], **changes)))  # type: ignore[arg-type]


def _with(wanted: Goal, values: tuple[float, ...], index: int, value: float) -> tuple[float, ...]:
    changed = list(values)
    changed[index] = value
    return tuple(changed)


def _earlier(wanted: Goal, time: float) -> Goal:
    first = replace(wanted.points[0], time=time, dq=())
    return replace(wanted, points=(first, wanted.points[0]))


_J, _G = Code.INVALID_JOINTS, Code.INVALID_GOAL
REFUSALS: dict[str, Refusal] = {
    "an_empty_goal": Refusal(lambda c, g: Goal((), ()), _J),
    "no_points": Refusal(lambda c, g: replace(g, points=()), _G),
    "no_names": Refusal(lambda c, g: replace(g, joints=()), _J),
    "an_unknown_name": Refusal(lambda c, g: replace(g, joints=("elbow", *g.joints[1:])), _J),
    "a_name_in_capitals": Refusal(lambda c, g: replace(g, joints=tuple(n.swapcase() for n in g.joints)), _J),
    "a_joint_twice": Refusal(lambda c, g: replace(g, joints=(g.joints[0], *g.joints[:6])), _J),
    "too_few_joints": Refusal(
        lambda c, g: replace(g, joints=g.joints[:6], points=(Point(0.6, g.points[0].q[:6]),)), _J
    ),
    "too_many_joints": Refusal(
        lambda c, g: replace(g, joints=(*g.joints, "A8"), points=(Point(0.6, (*g.points[0].q, 0.0)),)), _J
    ),
    "no_positions": Refusal(lambda c, g: _points(g, q=()), _G),
    "velocities_only": Refusal(lambda c, g: _points(g, q=(), dq=REST), _G),
    "accelerations_only": Refusal(lambda c, g: _points(g, q=(), dq=(), ddq=REST), _G),
    "too_few_positions": Refusal(lambda c, g: _points(g, q=g.points[0].q[:6]), _G),
    "too_many_positions": Refusal(lambda c, g: _points(g, q=(*g.points[0].q, 0.0)), _G),
    "too_few_velocities": Refusal(lambda c, g: _points(g, dq=REST[:6]), _G),
    "too_few_accelerations": Refusal(lambda c, g: _points(g, ddq=REST[:6]), _G),
    "effort": Refusal(lambda c, g: _points(g, effort=REST), _G),
    "equal_times": Refusal(lambda c, g: _earlier(g, g.points[0].time), _G),
    "times_that_fall": Refusal(lambda c, g: _earlier(g, g.points[0].time + 0.5), _G),
    "a_negative_time": Refusal(lambda c, g: _earlier(g, -0.5), _G),
    "an_end_in_the_past": Refusal(lambda c, g: replace(g, start=c.now() - 5.0), _G),
    "an_end_that_moves": Refusal(lambda c, g: _points(g, dq=_with(g, REST, 2, 0.1)), _G),
    "nan_among_positions": Refusal(lambda c, g: _points(g, q=_with(g, g.points[0].q, 3, np.nan)), _G),
    "infinity_among_velocities": Refusal(
        lambda c, g: replace(
            g, points=(replace(g.points[0], time=0.3, dq=_with(g, REST, 1, np.inf)), g.points[0])
        ),
        _G,
    ),
    "nan_among_accelerations": Refusal(lambda c, g: _points(g, ddq=_with(g, REST, 6, np.nan)), _G),
    "a_position_beyond_a_limit": Refusal(
        lambda c, g: _points(g, time=20.0, q=_with(g, g.points[0].q, 1, 2.2)), _G
    ),
    "a_velocity_beyond_a_limit": Refusal(
        lambda c, g: replace(
            g, points=(replace(g.points[0], time=0.3, dq=_with(g, REST, 0, 9.0)), g.points[0])
        ),
        _G,
    ),
    "an_acceleration_beyond_a_limit": Refusal(lambda c, g: _points(g, ddq=_with(g, REST, 0, 99.0)), _G),
    "a_way_too_fast": Refusal(lambda c, g: _points(g, time=0.02, dq=()), _G),
    "a_jump_at_the_start": Refusal(
        lambda c, g: replace(g, points=(replace(g.points[0], time=0.0, q=_with(g, g.points[0].q, 4, 1.0)),)),
        _G,
    ),
    "several_degrees_of_freedom": Refusal(lambda c, g: replace(g, extras=("multi_dof_trajectory",)), _G),
}


def refuse(name: str) -> Case:
    def run(client: Client) -> None:
        here = client.place().q
        sent = client.send(REFUSALS[name].change(client, step(client)))
        assert not sent.accepted
        assert sent.code in (None, REFUSALS[name].code)
        stays(client, here)

    return run


CASES.update({f"rejects_{name}": refuse(name) for name in REFUSALS})


@case
def a_refused_goal_does_not_disturb_the_one_under_way(client: Client) -> None:
    wanted = step(client, time=1.0)
    sent = client.send(wanted)
    client.sleep(0.2)
    assert not client.send(replace(wanted, joints=("elbow", *wanted.joints[1:]))).accepted
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH


@case
def an_old_goal_is_refused_and_the_one_under_way_finished(client: Client) -> None:
    wanted = step(client, time=1.0)
    sent = client.send(wanted)
    client.sleep(0.2)
    assert not client.send(replace(wanted, start=client.now() - 3.0)).accepted
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended


@case
def an_inactive_node_rejects(client: Client) -> None:
    client.activate(on=False)
    try:
        sent = client.send(step(client))
        assert not sent.accepted and sent.code in (None, Code.INVALID_GOAL)
    finally:
        client.activate(on=True)
    succeeds(client, step(client))


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
    told = client.feedback(sent)
    assert told
    for one in told:
        before = sum(p.time < one.time for p in wanted.points)
        # a message is made in one step and the step may be right at a point's time
        assert one.index is None or abs(one.index - before) <= 1, (one.index, one.time)
    numbers = [one.index for one in told if one.index is not None]
    assert numbers == sorted(numbers)


@case
def several_points_with_velocities(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    way = [point(0.3 * k, here + 0.2 * k * path, dq=tuple(0.6 * path if k < 4 else REST)) for k in (1, 2, 3)]
    succeeds(client, goal(client, *way, point(1.4, here + 0.9 * path, dq=REST)))


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
    wanted = Goal(
        tuple(client.joints[i] for i in order), (Point(0.6, tuple(there[order].tolist()), dq=REST),)
    )
    succeeds(client, wanted)
    assert np.abs(client.place().q - there).max() < TOUCH


@case
def feedback_is_in_the_arms_order_and_adds_up(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    there = here + path
    backwards = tuple(reversed(client.joints))
    sent = succeeds(client, Goal(backwards, (Point(1.2, tuple(there[::-1].tolist()), dq=REST),)))
    told = client.feedback(sent)
    assert len(told) >= 3
    for one in told:
        assert one.joints == client.joints
        np.testing.assert_allclose(one.error, one.desired.q - one.actual.q, atol=1e-9)
        low, high = np.minimum(here, there) - TOUCH, np.maximum(here, there) + TOUCH
        assert ((one.desired.q >= low) & (one.desired.q <= high)).all()
    assert all(a.elapsed <= b.elapsed for a, b in itertools.pairwise(told))


@case
def the_next_goal_begins_where_the_last_ended(client: Client) -> None:
    for _ in range(3):
        succeeds(client, step(client, time=0.4, size=0.5))


@case
def an_empty_way_back(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    way = (point(0.4, here + path), point(0.8, here))
    succeeds(client, goal(client, *way))
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
    assert ended.outcome is Outcome.SUCCEEDED, ended
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


# ------------------------------------------------------------------------------------- preemption


def undisturbed(client: Client, measure: Callable[[], Found]) -> Found:
    """What is measured while the machine does not stand still, which the stamps of joint states tell."""
    for _ in range(10):
        begin = client.now()
        found = measure()
        times = [time for time, _ in client.track(begin)]
        if np.diff(times).max() < STALL:
            return found
    raise AssertionError("the machine stands still again and again")


@case
def a_goal_takes_the_place_of_another(client: Client) -> None:
    here = client.place().q
    first = client.send(long(client))
    under_way(client, here)
    wanted = step(client, time=0.6, size=-0.5)
    second = client.send(wanted)
    assert first.accepted and second.accepted
    ended = client.result(first)
    assert ended.outcome in client.preempted and ended.code is Code.INVALID_GOAL, ended
    assert client.result(second).outcome is Outcome.SUCCEEDED
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
    assert ends[-1].outcome is Outcome.SUCCEEDED


@case
def a_goal_with_a_future_start_takes_the_place_at_once(client: Client) -> None:
    here = client.place().q
    first = client.send(long(client))
    under_way(client, here)
    here = client.place().q
    second = client.send(goal(client, point(0.6, here, dq=REST), start=client.now() + 1.0))
    assert second.accepted
    ended = client.result(first)
    assert ended.outcome in client.preempted and ended.code is Code.INVALID_GOAL, ended
    assert client.result(second).outcome is Outcome.SUCCEEDED
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
        assert client.result(second).outcome is Outcome.SUCCEEDED
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
    assert ended.outcome is Outcome.CANCELED and ended.code is Code.SUCCESSFUL, ended
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
    client.result(sent)
    rest = rests(client)
    # 0.45 rad/s at 2 rad/s² need 0.05 rad; some time passes between looking and braking
    assert sign * (rest[joint] - before.q[joint]) > 0.02
    assert sign * (rest[joint] - here[joint]) < 1.7, "it did not go to the end"
    assert np.abs(np.delete(rest - here, joint)).max() < 5e-3


def _mid_air(client: Client, far: float) -> tuple[Sent, float]:
    """A7 goes at 0.4 rad/s and is so far [rad]: its goal, and in which direction it moves."""
    here = client.place().q
    sign = -1.0 if here[6] > 0 else 1.0
    sent = client.send(goal(client, point(4.0, here + sign * 1.6 * (np.arange(7) == 6))))
    assert sent.accepted
    under_way(client, here, far)
    return sent, sign


def _brakes(client: Client) -> tuple[Array, Array]:
    """Cancel A7 in mid-air: times [s] and places [rad] of every joint state from then on."""
    sent, sign = _mid_air(client, 0.2)
    begin = client.now()
    client.cancel(sent)
    assert client.result(sent).outcome is Outcome.CANCELED
    rests(client)
    track = client.track(begin)
    times, way = np.array([time for time, _ in track]), np.array([sign * q[6] for _, q in track])
    apart = np.diff(times, prepend=-1.0) > 2e-3  # stamps may be nearer where the clocks' difference was corrected
    return times[apart], way[apart]


@case
def cancelling_makes_no_jump(client: Client) -> None:
    times, way = undisturbed(client, lambda: _brakes(client))
    # a spline may go faster between two points than the trajectory does, and a stream falters on a busy machine
    speeds = np.diff(way) / np.diff(times)
    assert way[-1] - way[0] > 5e-3, "it was under way"
    assert speeds.max() < 1.2, speeds
    assert speeds.min() > -0.1, speeds


@case
def cancelling_brakes_as_the_parameter_says(client: Client) -> None:
    assert client.set(max_deceleration_on_cancel=0.5)
    found: list[float] = []
    # a stream that falters on a busy machine is another braking; none of them would be right by chance
    while not found or (len(found) < 5 and not 0.3 < found[-1] < 0.8):
        times, way = undisturbed(client, lambda: _brakes(client))
        left = way[-1] - way
        # with constant deceleration the square root of the way that is left falls evenly
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
    assert client.result(first).outcome is Outcome.CANCELED
    assert client.result(second).outcome is Outcome.SUCCEEDED
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH


@case
def cancelling_before_a_future_start(client: Client) -> None:
    here = client.place().q
    sent = client.send(step(client, start=client.now() + 3.0))
    client.sleep(0.1)
    assert client.cancel(sent)
    assert client.result(sent).outcome is Outcome.CANCELED
    stays(client, here)


@case
def cancelling_an_ended_goal_does_nothing(client: Client) -> None:
    first = succeeds(client, step(client, time=0.3, size=0.3))
    wanted = step(client, time=0.8)
    second = client.send(wanted)
    client.sleep(0.2)
    client.cancel(first)
    assert client.result(second).outcome is Outcome.SUCCEEDED


@case
def the_deceleration_is_a_parameter(client: Client) -> None:
    def braked() -> float:
        sent, sign = _mid_air(client, 0.15)
        client.cancel(sent)
        client.result(sent)
        # what was told last is nearly where the arm began to brake; a client may look much later than that
        return sign * float(rests(client)[6] - client.feedback(sent)[-1].actual.q[6])

    ways = []
    for deceleration in (8.0, 0.5):
        assert client.set(max_deceleration_on_cancel=deceleration)
        ways.append(undisturbed(client, braked))
    assert ways[1] > ways[0] + 0.05, ways


# ------------------------------------------------------------------------------------- tolerances


@case
def wide_goal_tolerances_of_one_point(client: Client) -> None:
    succeeds(client, step(client, goal_tolerance=tolerances(client, 0.1)))


@case
def wide_goal_tolerances_of_several_points(client: Client) -> None:
    here = client.place().q
    path = swing(client)
    way = (point(0.3, here + path / 2), point(0.7, here + path))
    succeeds(client, goal(client, *way, goal_tolerance=tolerances(client, 0.1)))


@case
def wide_path_tolerances(client: Client) -> None:
    succeeds(client, step(client, path_tolerance=tolerances(client, 0.3)))


@case
def a_frozen_arm_leaves_its_path(client: Client) -> None:
    here = client.place().q
    client.behave("frozen")
    sent = client.send(step(client, time=1.0, path_tolerance=tolerances(client, 0.01)))
    assert sent.accepted
    ended = client.result(sent)
    aborted(ended, Code.PATH_TOLERANCE_VIOLATED)
    assert any(joint in ended.text for joint in client.joints), ended.text
    stays(client, here)


@case
def a_lagging_arm_leaves_a_narrow_path(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=1.0, size=2.0, path_tolerance=tolerances(client, 0.01)))
    aborted(client.result(sent), Code.PATH_TOLERANCE_VIOLATED)


@case
def a_lagging_arm_may_on_a_wide_path(client: Client) -> None:
    client.behave("lags")
    wanted = step(client, time=1.0, size=2.0, path_tolerance=tolerances(client, 0.4), goal_time=20.0)
    sent = client.send(wanted)
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended


@case
def one_joints_path_tolerance(client: Client) -> None:
    client.behave("frozen")
    only = (Tolerance(client.joints[6], 0.01),)
    sent = client.send(step(client, time=1.0, path_tolerance=only))
    ended = client.result(sent)
    aborted(ended, Code.PATH_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def a_path_tolerance_counts_from_the_first_sample(client: Client) -> None:
    here = client.place().q
    client.behave("frozen")
    off = here + 0.03 * (np.arange(7) == 5)
    sent = client.send(goal(client, point(0.0, off), path_tolerance=tolerances(client, 0.01)))
    assert sent.accepted
    aborted(client.result(sent), Code.PATH_TOLERANCE_VIOLATED)
    stays(client, here)


@case
def a_frozen_arm_misses_its_goal(client: Client) -> None:
    here = client.place().q
    client.behave("frozen")
    sent = client.send(step(client, time=0.4, goal_time=0.2))
    ended = client.result(sent)
    aborted(ended, Code.GOAL_TOLERANCE_VIOLATED)
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
    aborted(ended, Code.GOAL_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def an_impossible_goal_tolerance_fails(client: Client) -> None:
    sent = client.send(step(client, time=0.4, goal_time=0.3, goal_tolerance=tolerances(client, 1e-15)))
    aborted(client.result(sent), Code.GOAL_TOLERANCE_VIOLATED)


@case
def an_impossible_goal_time_fails(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=0.5, size=2.0, goal_time=1e-8))
    aborted(client.result(sent), Code.GOAL_TOLERANCE_VIOLATED)


@case
def a_lagging_arm_has_the_goal_time_to_arrive(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=0.5, goal_time=20.0))
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended


@case
def erased_tolerances_are_not_enforced(client: Client) -> None:
    client.behave("frozen")
    none = tolerances(client, -1.0, velocity=-1.0)
    sent = client.send(step(client, time=0.4, path_tolerance=none, goal_tolerance=none))
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended


@case
def an_erased_goal_time_waits(client: Client) -> None:
    client.behave("frozen")
    assert client.set(constraints__goal_time=0.2)
    sent = client.send(step(client, time=0.3, size=0.5, goal_time=-1.0))
    client.sleep(1.2)
    client.behave("follows")
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended


@case
def tolerances_in_any_order(client: Client) -> None:
    client.behave("frozen")
    mixed = (
        Tolerance(client.joints[6], 0.01),
        Tolerance(client.joints[0], 0.5),
        Tolerance(client.joints[3], 0.5),
    )
    ended = client.result(client.send(step(client, time=1.0, path_tolerance=mixed)))
    aborted(ended, Code.PATH_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def a_goals_tolerances_are_forgotten_after_it(client: Client) -> None:
    client.behave("lags")
    sent = client.send(step(client, time=1.0, size=2.0, path_tolerance=tolerances(client, 0.005)))
    aborted(client.result(sent), Code.PATH_TOLERANCE_VIOLATED)
    rests(client)
    sent = client.send(step(client, time=0.8, goal_time=20.0))
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended


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
    assert ended.outcome is Outcome.SUCCEEDED, ended


@case
def default_tolerances_can_change(client: Client) -> None:
    client.behave("frozen")
    assert client.set(constraints__A7__trajectory=0.01)
    ended = client.result(client.send(step(client, time=1.0)))
    aborted(ended, Code.PATH_TOLERANCE_VIOLATED)
    assert client.joints[6] in ended.text


@case
def velocity_tolerance_on_the_path(client: Client) -> None:
    client.behave("frozen")
    fast = (Tolerance(client.joints[6], 0.0, 0.05),)
    ended = client.result(client.send(step(client, time=0.6, path_tolerance=fast)))
    aborted(ended, Code.PATH_TOLERANCE_VIOLATED)


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
    assert ended.outcome is Outcome.SUCCEEDED, ended
    rest = rests(client)
    assert abs(rest[6] - here[6]) < 0.3, "nobody goes on for it: the arm brakes"


@case
def some_joints_where_it_is_allowed(client: Client) -> None:
    assert client.set(allow_partial_joints_goal=True)
    here = client.place().q
    some = (client.joints[6], client.joints[3])
    sent = client.send(Goal(some, (Point(0.6, (here[6] + 0.1, here[3] + 0.05)),)))
    assert sent.accepted
    ended = client.result(sent)
    assert ended.outcome is Outcome.SUCCEEDED, ended
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
        assert ended.outcome is Outcome.SUCCEEDED, ended
        told = client.feedback(sent)
        late = [one for one in told if one.elapsed > 0.3]
        for one in late:
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
    assert ended.outcome in client.preempted and ended.code is Code.INVALID_GOAL, ended
    arrives(client, last(wanted, client))


@case
def a_goal_takes_the_place_of_a_trajectory_on_the_topic(client: Client) -> None:
    here = client.place().q
    client.topic(long(client))
    under_way(client, here)
    succeeds(client, step(client, time=0.6, size=-0.5))


@case
def an_empty_trajectory_on_the_topic_stops_a_goal(client: Client) -> None:
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    client.topic(Goal((), ()))
    ended = client.result(sent)
    assert ended.outcome is not Outcome.SUCCEEDED and ended.code is not Code.SUCCESSFUL, ended
    rest = rests(client)
    stays(client, rest)


@case
def deactivating_ends_a_goal(client: Client) -> None:
    here = client.place().q
    sent = client.send(long(client))
    under_way(client, here)
    client.activate(on=False)
    try:
        aborted(client.result(sent), Code.INVALID_GOAL)
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
