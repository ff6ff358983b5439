"""Counters and histograms of a client: what they count, where they keep it, and what a percentile is."""

from __future__ import annotations

from array import array

import pytest

from heptarm.fri.session.statistics import BINS, COUNTERS, LONGEST, Counters, Histogram


def filled(*nanos: int) -> Histogram:
    histogram = Histogram()
    for one in nanos:
        histogram.add(one)
    return histogram


def test_counters_are_written_and_read_where_they_are_asked_for() -> None:
    words = array("q", bytes(8 * (len(COUNTERS) + 4)))
    counters = Counters()
    assert set(counters.as_dict().values()) == {0}
    for number, name in enumerate(COUNTERS, start=1):
        setattr(counters, name, number)
    counters.save(words, 3)
    assert words.tolist() == [0, 0, 0, *range(1, len(COUNTERS) + 1), 0]
    again = Counters()
    again.load(words, 3)
    assert again.as_dict() == counters.as_dict() == dict(zip(COUNTERS, range(1, 100)))


def test_without_durations_percentiles_are_zero() -> None:
    assert Histogram().percentiles(0.0, 0.5, 1.0) == (0.0, 0.0, 0.0) and Histogram().longest == 0.0


def test_a_percentile_is_the_middle_of_a_microsecond() -> None:
    histogram = filled(*(1000 * micros for micros in range(100)))
    assert histogram.percentiles(0.01, 0.5, 0.99, 1.0) == pytest.approx((0.5e-6, 49.5e-6, 98.5e-6, 99.5e-6))
    assert histogram.longest == pytest.approx(99e-6)
    assert filled(3_000_000).percentiles(0.0, 1.0) == pytest.approx((3000.5e-6, 3000.5e-6)), "no empty bin"
    assert filled(999_999).percentiles(1.0) == pytest.approx((999.5e-6,)), "rounded down"


def test_what_is_negative_counts_as_zero_and_what_is_too_long_in_the_last_bin() -> None:
    assert filled(-5).percentiles(1.0) == pytest.approx((0.5e-6,)) and filled(-5).longest == 0.0
    last = 1000 * (BINS - 1)
    assert filled(last - 1).percentiles(1.0) == pytest.approx((1e-6 * (BINS - 1.5),))
    for nanos in (last, last + 1000, 10**12):
        assert filled(0, nanos).percentiles(0.5, 1.0) == pytest.approx((0.5e-6, nanos * 1e-9)), nanos
    assert filled(LONGEST + 1).longest == pytest.approx(LONGEST * 1e-9)


def test_words_are_those_that_were_given_and_all_of_them_are_cleared() -> None:
    words = array("q", bytes(8 * (BINS + 2)))
    words[BINS + 1] = 7  # belongs to somebody else
    histogram = Histogram(words)
    for nanos in (0, 1500, 10**12):
        histogram.add(nanos)
    assert (words[0], words[1], words[BINS - 1], words[BINS]) == (1, 1, 1, 10**12)
    histogram.clear()
    assert set(words[: BINS + 1]) == {0} and words[BINS + 1] == 7
    assert len(list(Histogram()._words)) == BINS + 1
