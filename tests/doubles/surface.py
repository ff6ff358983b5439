"""The list of Sunrise's classes that applications use, read from surface.toml."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[no-redef]

FILE = Path(__file__).with_name("surface.toml")


@dataclass(frozen=True, slots=True)
class Class:
    """A class, an interface or an enumeration.

    Attributes:
        name: full, with $ before what is nested.
        does: what it does in the virtual cabinet.
        extends: simple names of its super types.
        members: what is called of it.
        known: how its members are known: "overrides" where applications implement or extend it, so that the
            signatures are complete; "calls" where they only call it; "names" where they only import it; "guess".
    """

    name: str
    does: str
    extends: tuple[str, ...] = ()
    members: tuple[str, ...] = ()
    known: str = ""

    @property
    def simple(self) -> str:
        """Its simple name."""
        return self.name.replace("$", ".").rpartition(".")[2]


@dataclass(frozen=True, slots=True)
class Part:
    """Classes that belong together.

    Attributes:
        title: what they are for.
        classes: in the order of the list.
    """

    title: str
    classes: tuple[Class, ...]


def read() -> tuple[tuple[Part, ...], tuple[tuple[str, str], ...]]:
    """The parts of the list, and what is missing and why."""
    content = tomllib.loads(FILE.read_text(encoding="utf-8"))
    parts = tuple(
        Part(
            part["title"],
            tuple(
                Class(
                    f"{part['package']}.{name}",
                    one["does"],
                    tuple(one.get("extends", ())),
                    tuple(one.get("members", ())),
                    one.get("known", "calls" if "members" in one else "names"),
                )
                for name, one in part["class"].items()
            ),
        )
        for part in content["part"]
    )
    return parts, tuple((one["what"], one["why"]) for one in content["without"])
