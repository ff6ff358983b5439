"""The page about sessions shows the table of the code."""

from __future__ import annotations

from pathlib import Path

from heptarm.wire.states import markdown

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "session.md"


def test_the_page_holds_the_table() -> None:
    assert markdown() in PAGE.read_text(encoding="utf-8")
