"""What cases are made of: their registry, goals, and what is to be seen of the arm.

A case takes a client; the arm is at rest, follows, and all parameters have their defaults.
"""

from __future__ import annotations

from collections.abc import Callable
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
