"""Readings belong together: each group of a pushed state is what the plant recorded at the group's stamp."""

from __future__ import annotations

import os

from bench.trust.readings import compare

LONG = bool(os.environ.get("LONG"))


def test_states_of_an_overloaded_cabinet_agree_with_the_record_of_the_plant() -> None:
    found = compare(100_000 if LONG else 10_000, busy=2, seconds=400.0 if LONG else 40.0)
    assert found.contradictions == {}
    assert found.states > 500 and found.steps > 100  # a machine that is busier than that shows nothing
