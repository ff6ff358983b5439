"""Arcs, splines and batches of a Sunrise application on the doubles."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.doubles.test_doubles import _compile, _run

HERE = Path(__file__).parent

SAID = (
    "a circ arrives",
    "a lin turns",
    "a constant orientation stays",
    "relative to the path it turns along",
    "led by the joints it arrives as well",
    "one container for the batch",
    "its motions are reported in order",
    "blending cuts the corner",
    "cancelling ends all of it",
    "a spline arrives",
    "with lines and arcs",
    "a joint spline arrives",
    "two points make no circle",
    "a batch names the motion that cannot be planned",
    "a spline has segments",
    "and nothing has moved",
)


@pytest.mark.long  # the same doubles as in tests/arm/test_paths.py
def test_paths_of_a_sunrise_application(tmp_path: Path) -> None:
    _compile(HERE / "java" / "Curving.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Curving", tmp_path, f"sample.file={said}")
    assert done.returncode == 0, done.stdout + done.stderr
    assert said.read_text().splitlines() == [f"{one} = true" for one in SAID]
