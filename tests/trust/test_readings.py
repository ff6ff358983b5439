"""Readings belong together: each group of a pushed state is what the plant recorded at the group's stamp."""

from __future__ import annotations

import os

import pytest

from bench.trust.readings import compare
from tests.long import few

LONG = bool(os.environ.get("LONG"))
pytestmark = pytest.mark.alone


@pytest.mark.parametrize(
    ("states", "seconds", "hampered"),
    few([(1_000, 6.0, True), (10_000, 12.0, False)]),
    ids=few(["late", "busy"]),
)
def test_states_of_an_overloaded_cabinet_agree_with_the_record_of_the_plant(
    states: int, seconds: float, hampered: bool
) -> None:
    """As many states as this machine manages; a million of them are a figure of `make bench GROUP=trust`."""
    if LONG:
        states, seconds = 10 * states, 30 * seconds
    found = compare(states, busy=2, seconds=seconds, hampered=hampered)
    assert found.contradictions == {}
    assert found.states > 20
