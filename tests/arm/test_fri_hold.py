"""Short runs of the FRI benchmarks through the whole stack: sine, torques, table, invalid commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import pytest

import heptarm as ha
from bench.fri import guard as fri_guard
from bench.fri import hold as fri_hold
from bench.measure.cabinet import Cabinet
from tests.arm.test_fri import patient
from tests.retry import retry

SPEED = 1.0  # FRI answers within milliseconds of this machine's time

#: Slow enough for a busy machine.
PERIOD = 5


def complete(session: fri_hold.Session) -> None:
    """A benchmark keeps the records of a session that ended early; a test repeats it."""
    if session.error is not None:
        raise session.error


Found = TypeVar("Found", fri_hold.Tracking, fri_hold.Balance, fri_hold.Press)


def measured(run: Callable[[], Found], is_good: Callable[[Found], bool]) -> Found:
    """What a run finds; again if it is not good and answers of this machine came late or never."""

    def busy(found: Found | Exception) -> str:
        if isinstance(found, Exception) or is_good(found):
            return ""
        return "FRI answers came late" if found.session.late or found.session.lost else ""

    return retry(run, busy)


@pytest.mark.long  # tests/sim_fri/test_laws.py has it without the stack
@patient
def test_a_sine_is_followed(arm: ha.Arm) -> None:
    found = measured(lambda: fri_hold.track(arm, 3.0, period_ms=PERIOD), lambda one: one.delayed < 2e-3)
    complete(found.session)
    assert found.session.messages > 300 and found.session.report["lost"] == 0
    assert found.delayed < 2e-3


@pytest.mark.long
@patient
def test_torques_alone_balance_the_arm(arm: ha.Arm) -> None:
    found = measured(
        lambda: fri_hold.balance(arm, 4.0, settled=3.0, period_ms=PERIOD),
        lambda one: one.error < 5e-3 and abs(one.reached - 1.0) < 0.05,
    )
    complete(found.session)
    assert found.held_for > 0.5 and found.reached == pytest.approx(1.0, abs=0.05)
    assert found.error < 5e-3


@patient
def test_a_wrench_holds_ten_newtons_on_the_table(arm: ha.Arm) -> None:
    found = measured(
        lambda: fri_hold.press(arm, 3.0, settled=2.0, period_ms=PERIOD),
        lambda one: one.least > 9.5 and one.most < 10.5,
    )
    complete(found.session)
    assert found.held_for > 0.5
    assert found.least > 9.5 and found.most < 10.5


@patient
def test_wild_commands_move_the_arm_within_its_limits(arm: ha.Arm) -> None:
    found = fri_guard.wild(arm, period_ms=PERIOD)
    assert found.survived and found.inside
    # after late answers of a busy machine the arm catches up
    assert 0.1 < found.speed < 1.2 and found.reached < 0.01
    for word in fri_guard.NAMED:
        assert any(word in line for line in found.limited), found.limited


def test_a_session_that_ends_early_keeps_what_it_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """An emergency stop comes in the middle of it."""
    take = fri_hold.Tape.take

    def run() -> fri_hold.Tracking:
        pressed: list[object] = []
        with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=5.0) as arm:

            def stopping(tape: fri_hold.Tape) -> None:
                take(tape)
                if not pressed and len(tape.t) > 300:
                    pressed.append(cabinet.operate("emergency_stop"))

            monkeypatch.setattr(fri_hold.Tape, "take", stopping)
            return fri_hold.track(arm, 60.0, period_ms=PERIOD)

    def busy(found: fri_hold.Tracking | Exception) -> str:
        lost = isinstance(found, fri_hold.Tracking) and isinstance(found.session.error, ha.QualityLost)
        return "FRI answers came late" if lost else ""

    found = retry(run, busy)
    assert found.session.error is not None and 0.5 < found.session.lasted < 30.0
    assert found.session.messages > 300
