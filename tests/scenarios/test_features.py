"""The table of features: up to date, complete, and true as far as names go."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from heptarm import testing

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def features() -> ModuleType:
    spec = importlib.util.spec_from_file_location("features", ROOT / "scripts" / "features.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["features"] = module
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(features: ModuleType) -> None:
    assert features.PAGE.read_text(encoding="utf-8") == features.page(), (
        "run .venv/bin/python scripts/features.py"
    )


def test_each_row_is_shown_or_left_out_with_a_reason(features: ModuleType) -> None:
    _, rows = features.load()
    every = testing.scenarios()
    assert len(rows) == len({row.id for row in rows}) == 282
    for row in rows:
        shown = features.shown_by(row.id, every)
        assert shown or row.elsewhere or row.left_out, f"{row.id} {row.title}: known from {row.peers}"
        assert not (shown and row.left_out), f"{row.id} is left out, and shown by {shown}"
        assert row.left_out or row.api or row.how, f"{row.id} has no name"
        assert not (row.partly and row.left_out), f"{row.id} is both partly here and missing"
        assert not row.elsewhere or (ROOT / row.elsewhere).exists(), row.elsewhere


def test_each_name_means_something(features: ModuleType) -> None:
    _, rows = features.load()
    for row in rows:
        for name in row.api:
            features.resolve(name)
    with pytest.raises(AttributeError):
        features.resolve("heptarm.no_such_thing")


def test_each_scenario_shows_rows_that_there_are(features: ModuleType) -> None:
    _, rows = features.load()
    known = {row.id for row in rows}
    for scenario in testing.scenarios():
        assert set(scenario.rows) <= known, scenario.name
