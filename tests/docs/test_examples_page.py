"""The page of the examples: up to date, and their numbers stand for one each."""

from __future__ import annotations

import importlib.util
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def pictures() -> ModuleType:
    pytest.importorskip("matplotlib")
    spec = importlib.util.spec_from_file_location(
        "example_pictures", ROOT / "scripts" / "example_pictures.py"
    )
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["example_pictures"] = module
    spec.loader.exec_module(module)
    return module


def test_the_page_is_up_to_date(pictures: ModuleType) -> None:
    assert pictures.PAGE.read_text(encoding="utf-8") == pictures.page(), (
        "run .venv/bin/python scripts/example_pictures.py --page"
    )


def test_each_number_is_that_of_one_example(pictures: ModuleType) -> None:
    numbers = Counter(example.number for example in pictures.examples())
    assert len(numbers) > 15 and max(numbers.values()) == 1, numbers
    assert not set(pictures.PLOTS) - set(numbers), "plots of examples that there are not"
