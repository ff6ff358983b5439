"""On a dark page figures with a white ground are turned dark, and pictures of the arm are left as they are."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

Image = pytest.importorskip("PIL.Image")
STATIC = Path(__file__).resolve().parents[2] / "docs/_static"


def is_white(picture: Path) -> bool:
    with Image.open(picture) as image:
        pixels, (width, height) = image.convert("RGB"), image.size
    corners = ((0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1))
    return all(min(pixels.getpixel(corner)) > 240 for corner in corners)


def test_the_dark_figures_are_those_with_a_white_ground() -> None:
    # Sphinx copies the figures of all folders into one
    begins = set(re.findall(r'src\*="_images/([^"]+)"', (STATIC / "site.css").read_text(encoding="utf-8")))
    figures = {path.name: is_white(path) for path in STATIC.rglob("*.png") if path.name != "social.png"}
    assert begins and len(figures) > 30
    assert {name: name.startswith(tuple(begins)) for name in figures} == figures
