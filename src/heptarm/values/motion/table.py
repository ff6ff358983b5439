"""Joint positions in a table of another program: a CSV file with seven columns of angles, with or without times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite
from pathlib import Path

import numpy as np

from heptarm.values.checks import Array, shown
from heptarm.values.files import read_text, unreadable

_WHAT = "a table of joint positions"
_HINT = "it needs seven columns of joint positions [rad], named q.A1 to q.A7 or alone, perhaps after one of times [s]"
_NO_SECONDS = "name it t and give seconds, or give rate, the rows per second: the column is left out then"
#: Rows per second of a table without times [Hz].
_RATE = 100.0
#: Names of a column of times [s], of one that has times of another unit or of an unknown one, and of those of the
#: joints; all without blanks and in lower case.
_SECONDS = re.compile(
    r"(?:t|times?|timestamps?|stamps?|elapsed)(?:_|\[|\()(?:s|secs?|seconds?)[\])]?|t|times?|timestamps?|secs?|seconds?"
)
_OTHER_TIMES = re.compile(
    r".*(?:time|stamp|elapsed).*|(?:milli|micro|nano|[mun])?sec(?:s|onds?)?(?:[^a-z0-9_].*)?|t(?:s|[\[(].*)|(?:t_)?[mun]s"
)
_JOINT = re.compile(r"(?:q[._]?a?|a|j|axis_?|joint_?|joint_?a|position_?)([1-7])(?:\[rad\])?")
#: Larger angles are degrees [rad].
_LARGEST = 2.0 * np.pi


def read_table(path: Path, *, rate: float | None = None) -> tuple[Array, Array]:
    """Times [s], shape (n,), and joint positions [rad], shape (n, 7), of a CSV file.

    Args:
        path: the file; its columns are separated by commas, semicolons, tabs or blanks, its first line may have names.
        rate: rows per second where the table has no times in seconds [Hz]; None: 100, if it has no times at all.

    Raises:
        CommandRejected: it cannot be read or is no such table, or its times may not be in seconds and there is no
            rate; the text has line and column.
    """
    lines = [
        (number, line)
        for number, line in enumerate(read_text(path).splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise unreadable(path, "it is empty", what=_WHAT, hint=_HINT)
    separator = next((mark for mark in (";", "\t", ",") if mark in lines[0][1]), None)
    cells = [(number, [cell.strip().strip('"') for cell in line.split(separator)]) for number, line in lines]
    names = [] if _is_number(cells[0][1][-1]) else cells[0][1]
    rows = cells[1:] if names else cells
    listed = names or [f"column {i}" for i in range(1, len(cells[0][1]) + 1)]
    time, joints = _columns(path, listed, is_named=bool(names), has_rate=rate is not None)
    found = np.array([_numbers(path, number, row, names, (*time, *joints)) for number, row in rows])
    if len(found) < 2:
        raise unreadable(path, f"it has {len(found)} rows, at least 2 are needed", what=_WHAT, hint=_HINT)
    q = found[:, len(time) :]
    if np.abs(q).max() > _LARGEST:
        row, column = np.unravel_index(int(np.abs(q).argmax()), q.shape)
        raise unreadable(
            path,
            f"line {rows[int(row)][0]}, A{int(column) + 1}: {q[row, column]:g} rad is more than a turn",
            what=_WHAT,
            hint="angles are in radians; convert the table if they are degrees",
        )
    return found[:, 0] if time else np.arange(len(found)) / (_RATE if rate is None else rate), q


def _columns(
    path: Path, names: Sequence[str], *, is_named: bool, has_rate: bool
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Indices of the columns of time, of which there may be none, and of the joints.

    Raises:
        CommandRejected: the joints are not among the columns, or the times may not be in seconds and there is no rate;
            the text names the columns.
    """
    plain = [name.lower().replace(" ", "") if is_named else "" for name in names]
    time = tuple(index for index, name in enumerate(plain) if _SECONDS.fullmatch(name))[:1]
    others = [index for index, name in enumerate(plain) if index not in time and _OTHER_TIMES.fullmatch(name)]
    if others and not time and not has_rate:
        raise unreadable(
            path,
            f"its column {shown(names[others[0]])} seems to have times that may not be in seconds",
            what=_WHAT,
            hint=_NO_SECONDS,
        )
    by_name = {match[1]: index for index, name in enumerate(plain) if (match := _JOINT.fullmatch(name))}
    if len(by_name) == 7:
        return time, tuple(by_name[f"{axis}"] for axis in range(1, 8))
    rest = [index for index in range(len(names)) if index not in (*time, *others)]
    if len(rest) == 8 and not time and not others:
        time, rest = (rest[0],), rest[1:]
    if len(rest) == 7:
        return time, tuple(rest)
    listed = shown(", ".join(names)) if is_named else f"{len(names)}"
    raise unreadable(path, f"its columns are {listed}", what=_WHAT, hint=_HINT)


def _numbers(
    path: Path, number: int, row: list[str], names: Sequence[str], columns: Sequence[int]
) -> list[float]:
    """The numbers of some columns of a row.

    Raises:
        CommandRejected: one is missing or is no finite number.
    """
    found = []
    for index in columns:
        text = row[index] if index < len(row) else ""
        if not _is_number(text) or not isfinite(float(text)):
            column = names[index] if index < len(names) else f"column {index + 1}"
            raise unreadable(
                path, f"line {number}, {column}: {shown(text)} is no finite number", what=_WHAT, hint=_HINT
            )
        found.append(float(text))
    return found


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
