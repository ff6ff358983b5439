"""Directions, taps, and the bands of a collision guard."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import heptarm as ha
from heptarm.skills.taps import TapCounter, TapWatch
from heptarm.values.condition.condition import AnyOf
from heptarm.values.condition.contact import direction_of
from heptarm.values.condition.force import JointTorqueOutside
from heptarm.values.state import Groups, Joints, State, Torques


def state(tau_ext: list[float], dq: float = 0.0) -> State:
    zeros = np.zeros(7)
    return State(
        Groups(
            joints=Joints(1, zeros, zeros, np.full(7, dq)),
            torques=Torques(1, zeros, np.array(tau_ext), zeros),
        )
    )


def test_directions() -> None:
    assert direction_of("z").tolist() == [0, 0, 1] and direction_of("-x").tolist() == [-1, 0, 0]
    assert direction_of([0, 3, 4]) == pytest.approx([0, 0.6, 0.8])
    for wrong in ("w", [0, 0, 0], [1, 2]):
        with pytest.raises(ha.ShapeError, match="direction"):
            direction_of(wrong)


def pushes(taps: TapCounter, *spans: tuple[float, float]) -> list[int]:
    """Counts after each push of 20 N, given by begin and end, as 100 Hz see them."""
    seen, counts = 0, []
    for begin, end in spans:
        while seen * 0.01 < end + 0.05:
            t = seen * 0.01
            taps.see(t, 20.0 if begin <= t < end else 1.0)
            seen += 1
        counts.append(taps.count)
    return counts


def test_taps_are_short_and_soon_after_one_another() -> None:
    assert pushes(TapCounter(force=8.0), (0.5, 0.6), (1.0, 1.1)) == [1, 2]
    assert pushes(TapCounter(force=8.0), (0.5, 0.6), (2.5, 2.6)) == [1, 1]  # too late
    assert pushes(TapCounter(force=8.0), (0.5, 0.6), (1.0, 2.0), (2.2, 2.3)) == [
        1,
        0,
        1,
    ]  # a long push is no tap
    assert pushes(TapCounter(force=30.0), (0.5, 0.6)) == [0]


def test_a_guard_is_a_condition_round_its_baseline() -> None:
    guard = ha.CollisionGuard.of([10, 11, 12, 13, 14, 15, 16], baseline=[1, -2, 0, 0, 0, 0, 0])
    assert isinstance(guard.condition, AnyOf) and guard.condition.parts == guard.parts
    assert guard.parts[1] == JointTorqueOutside(1, -13.0, 9.0)
    assert guard.collision(state([10.9, 8.9, 0, 0, 0, 0, 0])) is None
    found = guard.collision(state([0, -15.0, 0, 0, 0, 0, 0]))
    assert found is not None and (found.joint, found.torque, found.allowed) == (1, -13.0, 11.0)
    assert str(found) == "A2: -13.0 Nm external torque, allowed are 11.0 Nm"
    assert guard.named(guard.parts[1], None).joint == 1
    assert not guard.is_moving


def test_speed_widens_the_bands() -> None:
    guard = ha.CollisionGuard.of(10.0, margin=20.0)
    assert guard.is_moving
    assert guard.collision(state([0, 0, 15.0, 0, 0, 0, 0])) is not None
    assert guard.collision(state([0, 0, 15.0, 0, 0, 0, 0], dq=0.5)) is None
    assert guard.collision(state([0, 0, 15.0, 0, 0, 0, 0], dq=np.nan)) is not None


@pytest.mark.parametrize(
    "given",
    [
        {"threshold": 0.0},
        {"threshold": [1.0] * 6},
        {"threshold": 499.0, "baseline": [2.0] * 7},
        {"margin": -1.0},
    ],
)
def test_wrong_bands_are_refused(given: dict[str, object]) -> None:
    with pytest.raises(ha.CommandRejected):
        ha.CollisionGuard.of(**{"threshold": 10.0} | given)  # type: ignore[arg-type]


def test_errors_carry_what_was_seen() -> None:
    found = ha.Collision(3, 30.0, 20.0)
    error = ha.CollisionDetected("collision", collision=found)
    assert error.collision is found and isinstance(error, ha.MotionAborted)
    assert isinstance(ha.NoContact("nothing"), ha.MotionError)
    contact = ha.Contact(ha.Pose.at(z=0.1), np.zeros(3), 0.1, np.zeros(7), ha.Result(ha.Cause.CONDITION))
    assert np.isnan(contact.spread)
    assert replace(contact, first=replace(contact, pose=ha.Pose.at(z=0.3))).spread == pytest.approx(0.2)


def test_taps_stand_out_from_what_acts_all_the_time() -> None:
    def taps(level: float, strong: float = 20.0) -> int:
        """Two pushes on an arm under a constant force, after 5 s."""
        watch, count = TapWatch(force=8.0), 0
        for i in range(700):
            t = 0.01 * i
            push = strong if 5.0 <= t < 5.1 or 5.5 <= t < 5.6 else 0.0
            rises = level if t > 0.2 else 0.0  # a load is attached to it
            count = watch.see(t, np.array([0.0, rises, 3.0 + push]))
            if t >= 5.7:
                break
        return count

    assert taps(0.0) == 2 and taps(0.0, strong=5.0) == 0
    assert taps(10.0) == 2
    for wrong in ({"force": 0.0}, {"force": 501.0}, {"gap": 0.0}):
        with pytest.raises(ha.LimitError):
            TapWatch(**wrong)
