"""States: groups with their own stamps; a missing group raises an error."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from heptarm.errors import StaleState
from heptarm.values.pose import Pose, Redundancy
from heptarm.values.result import Cause, Result
from heptarm.values.state import (
    GROUP_NAMES,
    Cartesian,
    Groups,
    Joints,
    MotionStatus,
    OperationMode,
    Safety,
    State,
    Torques,
    Wrench,
)

SEVEN = np.arange(7.0)


def full() -> State:
    groups = Groups(
        joints=Joints(1_000, SEVEN, SEVEN + 1, SEVEN + 2),
        torques=Torques(2_000, SEVEN + 3, SEVEN + 4, SEVEN + 5),
        pose=Cartesian(3_000, Pose.at(x=0.5), Pose.at(x=0.6), Redundancy(0.1, 2, 10)),
        wrench=Wrench(2_500, np.array([1.0, 2, 3]), np.array([4.0, 5, 6])),
        motion=MotionStatus(2_600, id=7, progress=0.5),
        safety=Safety(500, OperationMode.AUT, ready_to_move=True),
    )
    return State(groups, sampled=10_000_000, clock=lambda: 12_000_000)


def test_short_names_reach_into_the_groups() -> None:
    s = full()
    assert s.q.tolist() == SEVEN.tolist()
    assert s.q_cmd[0] == 1
    assert s.dq[0] == 2
    assert (s.tau[0], s.tau_ext[0], s.tau_cmd[0]) == (3, 4, 5)
    assert (s.pose.x, s.pose_cmd.x) == (0.5, 0.6)
    assert s.redundancy.status == 2
    assert s.wrench.array.tolist() == [1, 2, 3, 4, 5, 6]
    assert s.safety.ready_to_move
    assert s.motion is not None
    assert s.motion.active


class Received:
    """A state as it is received: makes its groups when they are asked for."""

    def __init__(self) -> None:
        self.stamp, self.made = 3_000, list[str]()

    def make(self, name: str) -> object:
        self.made.append(name)
        return getattr(full().groups, name)


def test_the_groups_of_a_received_state_are_made_once_at_their_first_use() -> None:
    received = Received()
    s = State(Groups.of(received), sampled=10_000_000)
    assert s.stamp == 3_000
    assert received.made == []
    assert s.q.tolist() == SEVEN.tolist()
    assert s.q_cmd[0] == 1
    assert s.groups.io is None
    assert s.groups.io is None
    assert received.made == ["joints", "io"]
    assert s == State(full().groups, sampled=10_000_000)
    assert sorted(received.made) == sorted(GROUP_NAMES)
    with pytest.raises(AttributeError, match="'Groups' object has no attribute 'joint'"):
        s.groups.joint  # type: ignore[attr-defined]  # noqa: B018


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_received_state_may_be_copied_and_pickled(copied: Callable[[State], State]) -> None:
    s = State(Groups.of(Received()))
    assert copied(s) == s == State(full().groups)
    assert replace(s.groups, io=None).pose is s.groups.pose


def test_stamps_and_age() -> None:
    s = full()
    assert s.stamp == 3_000
    assert s.age == pytest.approx(0.002)
    assert State().stamp == 0
    assert math.isnan(State().age)


@pytest.mark.parametrize(
    ("name", "group"),
    [
        ("q", "joints"),
        ("q_cmd", "joints"),
        ("dq", "joints"),
        ("tau", "torques"),
        ("tau_ext", "torques"),
        ("tau_cmd", "torques"),
        ("pose", "pose"),
        ("pose_cmd", "pose"),
        ("redundancy", "pose"),
        ("wrench", "wrench"),
        ("safety", "safety"),
    ],
)
def test_a_missing_group_is_named(name: str, group: str) -> None:
    with pytest.raises(StaleState, match=f"no group '{group}'"):
        getattr(State(), name)


def test_equal_by_value_and_read_only() -> None:
    assert full() == full()
    assert hash(full()) == hash(full())
    with pytest.raises(ValueError, match="read-only"):
        full().q[0] = 1.0


def test_wrench_validity() -> None:
    zero = np.zeros(3)
    assert Wrench(0, zero, zero).valid()  # the cabinet does not report it
    assert Wrench(0, zero, zero, zero + 5, zero + 5).valid()
    assert not Wrench(0, zero, zero, np.array([0.0, 0, 20]), zero).valid()
    assert not Wrench(0, zero, zero, zero, zero + 11).valid()
    assert Wrench(0, zero, zero, zero + 20, zero).valid(force=30.0)


def test_result() -> None:
    assert Result(Cause.FINISHED, full(), 1e-5, 1.5).arrived
    assert not Result(Cause.CANCELLED).arrived
    assert math.isnan(Result(Cause.DROPPED).residual)
    assert Cause("finished") is Cause.FINISHED
    assert Result(Cause.FAILED, text="why") == Result(Cause.FAILED, text="why")


def test_causes_are_those_of_the_protocol() -> None:
    from heptarm.wire import messages

    assert [c.value for c in Cause] == [c.name.lower() for c in messages.Cause]
    assert [m.value for m in OperationMode] == [m.name.lower() for m in messages.OperationMode]
    bits = [b.name.lower() for b in messages.SafetyBits if b.name and b.value and b.name != "UNKNOWN"]
    assert [name for name in Safety.__dataclass_fields__ if name not in ("stamp", "mode")] == bits
