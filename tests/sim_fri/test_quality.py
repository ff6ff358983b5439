"""The quality rule, as its docstring states it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heptarm.fri.protocol.messages import Quality
from heptarm.sim.fri.quality import LOST_PERIODS, LOST_TIME, QualityMeter

MS = 1_000_000


def fed(receive_ms: int, answers: list[int | None]) -> QualityMeter:
    """A meter after receive periods with answers after these delays [ns], or without."""
    meter = QualityMeter(receive_ms * MS)
    replies = []
    for period, latency in enumerate(answers):
        now = period * receive_ms * MS
        meter.asked(period, now)
        if latency is not None:
            replies.append((now + latency, period, latency))
    for _, period, latency in sorted(replies):
        meter.answered(period, latency)
    meter.advance(len(answers) * receive_ms * MS + receive_ms * MS * (1 + LOST_PERIODS) + LOST_TIME)
    return meter


@pytest.mark.parametrize(
    ("lost", "late", "quality"),
    [
        (0, 0, Quality.EXCELLENT),
        (1, 0, Quality.EXCELLENT),
        (0, 4, Quality.EXCELLENT),
        (2, 0, Quality.GOOD),
        (0, 5, Quality.GOOD),
        (5, 0, Quality.GOOD),
        (0, 20, Quality.GOOD),
        (6, 0, Quality.FAIR),
        (0, 21, Quality.FAIR),
        (0, 100, Quality.FAIR),
        (25, 0, Quality.FAIR),
        (26, 0, Quality.POOR),
        (100, 0, Quality.POOR),
    ],
)
def test_so_many_lost_or_late_in_a_hundred(lost: int, late: int, quality: Quality) -> None:
    latencies: list[int | None] = [None] * lost + [2 * MS] * late + [MS] * (100 - lost - late)
    meter = fed(1, latencies)
    assert meter.quality is quality
    assert (meter.counts.lost, meter.counts.late) == (lost, late)


def test_quality_is_earned() -> None:
    meter = QualityMeter(MS)
    classes = []
    for period in range(100):
        meter.asked(period, period * MS)
        meter.answered(period, 100_000)
        classes.append(meter.advance(period * MS))
    assert classes.index(Quality.FAIR) == 74 and classes.index(Quality.GOOD) == 94
    assert classes.index(Quality.EXCELLENT) == 98


def test_silence_at_1_khz_is_noticed_after_26_ms() -> None:
    meter = fed(1, [100_000] * 200)
    start = 10_000
    for period in range(start, start + 40):
        meter.asked(period, period * MS)
        if meter.advance(period * MS) < Quality.GOOD:
            break
    assert period - start == 26


@pytest.mark.parametrize(("receive_ms", "window"), [(1, 100), (10, 100), (20, 50), (50, 20), (100, 20)])
def test_the_window_lasts_about_a_second(receive_ms: int, window: int) -> None:
    assert QualityMeter(receive_ms * MS).window == window


def test_an_answer_after_it_was_lost_changes_nothing() -> None:
    meter = QualityMeter(MS)
    meter.asked(0, 0)
    meter.advance(MS + LOST_TIME)
    assert meter.counts.lost == 1
    assert not meter.answered(0, 30 * MS) and meter.counts.late == 0
    assert not meter.answered(7, 0)  # never asked


def test_latency_and_jitter_are_those_of_the_answers() -> None:
    steady, uneven = fed(1, [300_000] * 100), fed(1, [100_000, 500_000] * 50)
    assert steady.latency_ns == 300_000 and steady.jitter_ns == 0
    assert uneven.latency_ns == pytest.approx(300_000, rel=0.1)
    assert uneven.jitter_ns == pytest.approx(400_000, rel=0.1)


@given(
    st.lists(st.none() | st.integers(0, 40 * MS), max_size=250),
    st.integers(1, 20),
)
def test_every_receive_period_is_judged_once_and_by_the_rule(
    answers: list[int | None], receive_ms: int
) -> None:
    meter = fed(receive_ms, answers)
    counts = meter.counts
    assert counts.on_time + counts.late + counts.lost == len(answers)
    assert counts.on_time == sum(a is not None and a <= receive_ms * MS for a in answers)
    part = meter.fraction
    expected = (
        Quality.EXCELLENT
        if part >= 0.99 - 1e-12
        else Quality.GOOD
        if part >= 0.95 - 1e-12
        else Quality.FAIR
        if part >= 0.75 - 1e-12
        else Quality.POOR
    )
    assert meter.quality is expected
