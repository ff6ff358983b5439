"""Values as text for people: aligned lines with units, degrees and millimetres beside SI; `repr` stays exact."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from heptarm.values.notebook import Cells, Listing

#: Units of fields whose name has them at its end, and factors for other fields by name.
_SUFFIXES = {
    "_mps": "m/s",
    "_mps2": "m/s²",
    "_mps3": "m/s³",
    "_radps": "rad/s",
    "_radps2": "rad/s²",
    "_radps3": "rad/s³",
}
_UNITS = {
    "duration": "s",
    "distance": "m",
    "mass": "kg",
    "com": "m",
    "residual": "rad",
    "relative": "of the path",
    "joint_speed": "of the maximum",
    "joint_acceleration": "of the maximum",
    "joint_jerk": "of the maximum",
}
_ANGLES = ("q", "near", "e1")
#: Fields of base classes, which are shown behind a class's own.
_LAST = ("triggers", "dynamics", "blending")
#: Entries of a list that are shown.
_SHOWN = 6
#: Control characters, invisible format characters such as those that reverse the direction of writing, halves of
#: surrogate pairs, separators of lines and paragraphs.
_REMOVED = ("Cc", "Cf", "Cs", "Zl", "Zp")


def fixed(value: float, digits: int) -> str:
    """Fixed-point text without a negative zero; "-" for NaN."""
    return "-" if math.isnan(value) else f"{round(float(value), digits) + 0.0:.{digits}f}"


def aligned(cells: Iterable[str], width: int = 8) -> Cells:
    """Texts in columns of the same width."""
    parts = tuple(cells)
    return _cells("".join(f"{part:>{width}}" for part in parts), parts)


def columns(values: Iterable[float], digits: int, width: int = 8) -> Cells:
    """Numbers in columns of the same width."""
    return aligned((fixed(value, digits) for value in values), width)


def degrees(values: npt.ArrayLike, digits: int = 2) -> Cells:
    """Angles in degrees and in radians: "20.00 35.00 deg (0.3491 0.6109 rad)"."""
    given = np.atleast_1d(np.asarray(values, dtype=np.float64))
    turned = [fixed(value, digits) for value in np.degrees(given)]
    same = [fixed(value, digits + 2) for value in given]
    both = tuple(f"{angle} deg\n{other} rad" for angle, other in zip(turned, same, strict=True))
    return _cells(f"{' '.join(turned)} deg ({' '.join(same)} rad)", both)


def _cells(text: str, cells: tuple[str, ...]) -> Cells:
    found = Cells(text)
    found.cells = cells
    return found


def listing(values: Iterable[float], unit: str = "") -> str:
    """Numbers with their unit; one number if all are the same, "-" for NaN."""
    texts = ["-" if math.isnan(value) else f"{float(value):g}" for value in values]
    return f"{texts[0] if len(set(texts)) == 1 else ' '.join(texts)} {unit}".rstrip()


def counted(count: int, noun: str) -> str:
    """A number of things whose plural ends with s: "1 episode", "2 episodes"."""
    return f"{count} {noun}{'' if count == 1 else 's'}"


def lines(title: str, rows: Mapping[str, str]) -> Listing:
    """A title and aligned rows below it; empty ones are left out."""
    shown = {name: text for name, text in rows.items() if text}
    width = max((len(name) for name in shown), default=0)
    indent = " " * (width + 4)
    below = (f"  {name:{width}}  " + text.replace("\n", f"\n{indent}") for name, text in shown.items())
    found = Listing("\n".join([title, *below]))
    found.heading, found.rows = title, shown
    return found


def described(value: Any, title: str) -> Listing:
    """The fields of a value that do not have their defaults, a line each."""
    return lines(title, dict(_rows(value)))


def _rows(value: Any) -> Iterable[tuple[str, str]]:
    for field in sorted(fields(value), key=lambda field: field.name in _LAST):
        entry = getattr(value, field.name)
        default = field.default if field.default is not MISSING else None
        if entry is default or (default is not None and _same(entry, default)):
            continue
        if field.name in ("dynamics", "blending"):
            yield from ((name, text) for name, text in _rows(entry) if text != "-")
        else:
            yield field.name, _text(field.name, entry)


def _same(entry: Any, default: Any) -> bool:
    try:
        return bool(entry == default)
    except ValueError:  # arrays
        return False


def _text(name: str, value: Any) -> str:
    """A field's content in a line or a few."""
    if isinstance(value, np.ndarray):
        if np.isnan(value).all():
            return "-"
        if name in _ANGLES:
            return degrees(value)
        numbers = np.unique(value) if value.ndim == 1 else value
        text = " ".join(f"{number:g}" for number in (numbers if len(numbers) == 1 else value.reshape(-1)))
        return f"{text} {_unit(name)}".rstrip()
    if isinstance(value, float):
        if name in _ANGLES:
            return degrees(value)
        return "-" if math.isnan(value) else f"{value:g} {_unit(name)}".rstrip()
    if isinstance(value, tuple) and len(value) > 0:
        shown = [" ".join(str(entry).split()) for entry in value[:_SHOWN]]
        more = [f"... {len(value) - _SHOWN} more"] if len(value) > _SHOWN else []
        return "\n".join(shown + more)
    return str(value)


def _unit(name: str) -> str:
    for suffix in sorted(_SUFFIXES, key=len, reverse=True):
        if name.endswith(suffix):
            return _SUFFIXES[suffix]
    return _UNITS.get(name, "")


def printable(text: str, *, lines: bool = False) -> str:
    """Remove what cannot be printed.

    Args:
        text: from another client, a cabinet or the environment.
        lines: keep line breaks; otherwise they become blanks.
    """
    if text.isprintable():
        return text
    if lines:
        return "\n".join(printable(line) for line in text.split("\n"))
    one_line = " ".join(text.splitlines()).replace("\t", " ")
    return "".join(c for c in one_line if unicodedata.category(c) not in _REMOVED)
