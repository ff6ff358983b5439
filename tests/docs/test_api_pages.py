"""The pages of the API have every member of an arm, once, and name the guides that explain it."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

import heptarm as ha

PAGES = sorted((Path(__file__).resolve().parents[2] / "docs/reference/python").glob("*.md"))
_MEMBER = re.compile(r"^\.\. auto(?:method|property):: heptarm\.Arm\.(\w+)$", re.M)


def test_every_member_of_an_arm_is_on_one_page() -> None:
    found = Counter(name for page in PAGES for name in _MEMBER.findall(page.read_text(encoding="utf-8")))
    members = {name for name in dir(ha.Arm) if not name.startswith("_")}
    assert found == Counter(members)


@pytest.mark.parametrize("page", [page for page in PAGES if page.stem != "index"], ids=lambda page: page.stem)
def test_every_page_of_the_api_names_guides(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert re.search(r"See also|\]\(\.\./\.\./guide/", text)
