"""Goals that a server refuses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, TrajectoryGoal, TrajectoryPoint
from tests.conformance.case import CASES, REST, TOUCH, Case, case, last, stays, step, succeeds
from tests.conformance.client import Client


@dataclass(frozen=True)
class Refusal:
    """A goal that must be rejected, with its code where there are codes."""

    change: Callable[[Client, TrajectoryGoal], TrajectoryGoal]
    code: ErrorCode


def _points(wanted: TrajectoryGoal, **changes: object) -> TrajectoryGoal:
    """The same changes for the last point."""
    return replace(wanted, points=(*wanted.points[:-1], replace(wanted.points[-1], **changes)))  # type: ignore[arg-type]


def _with(wanted: TrajectoryGoal, values: tuple[float, ...], index: int, value: float) -> tuple[float, ...]:
    changed = list(values)
    changed[index] = value
    return tuple(changed)


def _earlier(wanted: TrajectoryGoal, time: float) -> TrajectoryGoal:
    first = replace(wanted.points[0], time=time, dq=())
    return replace(wanted, points=(first, wanted.points[0]))


_J, _G = ErrorCode.INVALID_JOINTS, ErrorCode.INVALID_GOAL
REFUSALS: dict[str, Refusal] = {
    "an_empty_goal": Refusal(lambda c, g: TrajectoryGoal((), ()), _J),
    "no_points": Refusal(lambda c, g: replace(g, points=()), _G),
    "no_names": Refusal(lambda c, g: replace(g, joints=()), _J),
    "an_unknown_name": Refusal(lambda c, g: replace(g, joints=("elbow", *g.joints[1:])), _J),
    "a_name_in_capitals": Refusal(lambda c, g: replace(g, joints=tuple(n.swapcase() for n in g.joints)), _J),
    "a_joint_twice": Refusal(lambda c, g: replace(g, joints=(g.joints[0], *g.joints[:6])), _J),
    "too_few_joints": Refusal(
        lambda c, g: replace(g, joints=g.joints[:6], points=(TrajectoryPoint(0.6, g.points[0].q[:6]),)), _J
    ),
    "too_many_joints": Refusal(
        lambda c, g: replace(
            g, joints=(*g.joints, "A8"), points=(TrajectoryPoint(0.6, (*g.points[0].q, 0.0)),)
        ),
        _J,
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
    "an_end_elsewhere_that_is_due_now": Refusal(
        lambda c, g: replace(_points(g, time=0.39), start=c.now() - 0.39), _G
    ),
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
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended
    assert np.abs(client.place().q - last(wanted, client)).max() < TOUCH


@case
def an_old_goal_is_refused_and_the_one_under_way_finished(client: Client) -> None:
    wanted = step(client, time=1.0)
    sent = client.send(wanted)
    client.sleep(0.2)
    assert not client.send(replace(wanted, start=client.now() - 3.0)).accepted
    ended = client.result(sent)
    assert ended.outcome is GoalOutcome.SUCCEEDED, ended


@case
def an_inactive_node_rejects(client: Client) -> None:
    client.activate(on=False)
    try:
        sent = client.send(step(client))
        assert not sent.accepted and sent.code in (None, ErrorCode.INVALID_GOAL)
    finally:
        client.activate(on=True)
    succeeds(client, step(client))
