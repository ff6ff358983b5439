"""Short runs of what the benchmarks promise of FRI through the whole stack: sine, torques, table, wild wishes."""

from __future__ import annotations

import pytest

import heptarm as ha
from bench import fri_guard, fri_hold
from tests.arm.test_fri import patient

#: Slow enough for a machine that does other things as well.
PERIOD = 5


@patient
def test_a_sine_is_followed(arm: ha.Arm) -> None:
    found = fri_hold.track(arm, 3.0, period_ms=PERIOD)
    assert found.messages > 300 and found.report["lost"] == 0
    assert found.delayed < 2e-3


@patient
def test_torques_alone_balance_the_arm(arm: ha.Arm) -> None:
    found = fri_hold.balance(arm, 4.0, settled=3.0, period_ms=PERIOD)
    assert found.stood > 0.5 and found.way == pytest.approx(1.0, abs=0.05)
    assert found.error < 5e-3


@patient
def test_a_wrench_holds_ten_newtons_on_the_table(arm: ha.Arm) -> None:
    found = fri_hold.press(arm, 3.0, settled=2.0, period_ms=PERIOD)
    assert found.stood > 0.5
    assert found.least > 9.5 and found.most < 10.5


@patient
def test_wild_wishes_move_the_arm_within_its_limits(arm: ha.Arm) -> None:
    found = fri_guard.wild(arm, period_ms=PERIOD)
    assert found.stood and found.inside
    assert 0.1 < found.speed < 1.05 and found.reached < 0.01
    for word in fri_guard.NAMED:
        assert any(word in line for line in found.limited), found.limited
