"""The benchmark of lost clients goes to its end: what disturbs it is repeated, counted and reported."""

from __future__ import annotations

from math import isnan, nan

import pytest

from bench.measure.figure import Figure
from bench.trust.lost_client import SLACK, LossOutcome, figures

GOOD = LossOutcome(0.01, retaken=True)
NOISY = LossOutcome(0.9, retaken=False, error="Timeout: nothing moves", is_noisy=True)


def made(*outcomes: LossOutcome) -> tuple[Figure, Figure]:
    rest, following = figures("lost_ptp_killed", outcomes, 3)
    return rest, following


def test_disturbed_losses_do_not_count_once_enough_are_undisturbed() -> None:
    rest, following = made(GOOD, NOISY, GOOD, GOOD)
    assert (rest.value, rest.ok, following.value, following.ok) == (0.01, True, 3, True)
    assert rest.detail["disturbed"] == 1 and rest.detail["errors"] == [NOISY.error]


@pytest.mark.parametrize(
    "bad", [LossOutcome(2 * SLACK, retaken=True), LossOutcome(error="NotInControl: other")]
)
def test_an_undisturbed_loss_that_ends_badly_fails(bad: LossOutcome) -> None:
    rest, following = made(GOOD, bad, GOOD)
    assert False in (rest.ok, following.ok)


def test_too_many_disturbed_losses_decide_nothing() -> None:
    rest, following = made(GOOD, *5 * [NOISY])
    assert rest.ok is None and following.ok is None
    rest, following = made(*3 * [LossOutcome(nan, error="Timeout: x", is_noisy=True)])
    assert isnan(rest.value) and rest.ok is None and following.value == 0
