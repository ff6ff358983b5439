"""Writes docs/reference/features.md from docs/features.toml and the scenarios of heptarm.testing."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib  # type: ignore[no-redef]

from heptarm.testing import Scenario
from heptarm.testing.runner import scenarios
from heptarm.testing.scenario import LINES

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "docs" / "features.toml"
PAGE = ROOT / "docs" / "reference" / "features.md"

HEAD = """# Features

The features of the open frameworks for this arm (libiiwa, iiwa_stack, KUKA-IIWA-API, KST, iiwaPy3, iiwapy), with
their names in Python and the scenarios that show them. [Scenarios](../guide/scenarios.md) run on the virtual cabinet
and, with care, on a robot.

The column *known from* lists the systems in which the feature works completely; it is empty where none does.
*Partly*: a part of it is missing, and the text states which. `scripts/features.py` writes this page from
`docs/features.toml`.
"""


@dataclass(frozen=True)
class Row:
    """A row of the table; see docs/features.toml."""

    id: str
    title: str
    peers: tuple[str, ...] = ()
    api: tuple[str, ...] = ()
    how: str = ""
    elsewhere: str = ""
    partly: str = ""
    left_out: str = ""

    @classmethod
    def of(cls, entry: dict[str, Any]) -> Row:
        """A row of the file's."""
        values: Any = {
            name: tuple(value) if isinstance(value, list) else value for name, value in entry.items()
        }
        return cls(**values)


def load() -> tuple[dict[str, str], list[Row]]:
    """Titles of the groups by their letter, and all rows."""
    data = tomllib.loads(DATA.read_text(encoding="utf-8"))
    groups = {letter: group["title"] for letter, group in data["group"].items()}
    return groups, [Row.of(entry) for entry in data["row"]]


def shown_by(row: str, every: tuple[Scenario, ...]) -> list[Scenario]:
    """The scenarios that show a row."""
    return [one for one in every if row in one.rows]


def resolve(name: str) -> object:
    """What a dotted name means.

    Raises:
        AttributeError: there is no such thing.
    """
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            found = getattr(found, part)
        return found
    raise AttributeError(f"there is no {name}")


def _short(name: str) -> str:
    """A name as a program writes it."""
    for long, short in (
        ("heptarm.Arm.", "arm."),
        ("heptarm.values.", ""),
        ("heptarm.arm.", ""),
        ("heptarm.", ""),
    ):
        if name.startswith(long):
            return short + name[len(long) :]
    return name


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _here(row: Row) -> str:
    names = ", ".join(f"`{_short(name)}`" for name in row.api)
    text = ": ".join(part for part in (names, row.how) if part)
    return _cell(f"{text}. *Partly*: {row.partly}" if row.partly else text)


def _shown(row: Row, every: tuple[Scenario, ...]) -> str:
    names = [f"`{one.name}`" for one in shown_by(row.id, every)]
    if row.elsewhere:
        names.append(f"`{row.elsewhere}`")
    return ", ".join(names)


def page() -> str:
    """The whole page."""
    groups, rows = load()
    every = scenarios()
    partly, left_out = sum(bool(row.partly) for row in rows), sum(bool(row.left_out) for row in rows)
    complete = len(rows) - partly - left_out
    lines = [
        HEAD,
        f"Of {len(rows)} features {complete} are complete, {partly} partly here, {left_out} missing.",
        "",
    ]
    for letter, title in groups.items():
        lines += [
            f"## {title}",
            "",
            "| | feature | known from | heptarm | shown by |",
            "|---|---|---|---|---|",
        ]
        for row in rows:
            if row.id[0] == letter and not row.left_out:
                peers = ", ".join(row.peers)
                lines.append(
                    f"| {row.id} | {_cell(row.title)} | {peers} | {_here(row)} | {_shown(row, every)} |"
                )
        lines.append("")
    lines += ["## Missing features", "", "| | feature | known from | reason |", "|---|---|---|---|"]
    for row in rows:
        if row.left_out:
            lines.append(
                f"| {row.id} | {_cell(row.title)} | {', '.join(row.peers)} | {_cell(row.left_out)} |"
            )
    lines += ["", "## All scenarios", "", "| scenario | shows | part | risk |", "|---|---|---|---|"]
    for one in every:
        where = ", simulator only" if one.virtual else ""
        lines.append(f"| `{one.name}` | {_cell(one.title)} | {LINES[one.line]} | {one.risk.value}{where} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if "--check" in sys.argv[1:]:
        sys.exit(
            0
            if PAGE.read_text(encoding="utf-8") == page()
            else f"{PAGE} is out of date: run scripts/features.py"
        )
    PAGE.write_text(page(), encoding="utf-8")
