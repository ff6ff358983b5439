"""The virtual cabinet keeps its size, whatever it is asked to do."""

from __future__ import annotations

import os

import pytest

import heptarm as ha
from bench.measure.cabinet import Cabinet
from bench.trust.soak import soak

LONG = bool(os.environ.get("LONG"))
pytestmark = pytest.mark.alone


def test_calls_from_java_to_python_leave_nothing_behind() -> None:
    """JPype 1.7 made a type of 1.6 kB for the Java objects of each such call, which nothing could free."""
    weight = ha.Tool("weight", mass=1.0, com=(0.0, 0.0, 0.05))
    with Cabinet() as cabinet, ha.connect(cabinet.target, watchdog=10.0, timeout=60.0) as arm:

        def call() -> None:
            """Sixty calls and more: loads, motions, and their ends."""
            for _ in range(20):
                with arm.tool(weight):
                    arm.move(ha.hold(0.002))

        for _ in range(2):  # classes are loaded
            cabinet.stats()
            call()
        before = cabinet.stats()["memory"]
        call()
        after = cabinet.stats()["memory"]
    assert after["types"] == before["types"]
    assert after["objects"] - before["objects"] < 50
    assert after["java_threads"] <= before["java_threads"]


def test_a_soak_leaves_nothing_behind_and_loses_nothing() -> None:
    """A minute of everything at once, three with LONG=1. `make soak MINUTES=60` reports the growth exactly."""
    verdict = soak(180.0 if LONG else 60.0)
    assert verdict.lost == []
    assert verdict.grown == {}
    assert {"observer", "fri", "fault", "servo", "motions"} <= set(verdict.done)
    # classes are still loaded and heaps still fill in the first minutes; a leak of each call showed 3 MB/min and more
    assert max(verdict.slopes.values()) < (2.0 if LONG else 20.0)
