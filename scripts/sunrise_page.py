"""Writes docs/reference/sunrise.md: what of Sunrise's classes the virtual cabinet offers.

python scripts/sunrise_page.py           write
python scripts/sunrise_page.py --check   fail if the page differs from tests/doubles/surface.toml
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from tests.doubles import surface  # noqa: E402

PAGE = ROOT / "docs" / "reference" / "sunrise.md"
HEAD = """# Sunrise in the virtual cabinet

<!-- made by scripts/sunrise_page.py from tests/doubles/surface.toml; change that list -->

`heptarm sim app` offers these classes of Sunrise.OS 1.11 to 1.17: {classes} classes with {members} members. They
are doubles, written for the simulation after the calls in public applications; they contain no code of KUKA's. Names
and signatures are those that applications use. The doubles act on the virtual arm, in simulated time. What is not
simulated throws an exception that begins with `heptarm: not modelled`.

*Known by* states how sure the members are: *overrides* where applications implement or extend a class, so that its
signatures are whole; *calls* where they only call it, so that a type may be narrower than Sunrise's; *names* where they
only name it; *guess*.

A test compiles and runs sample applications that use each of these classes, and compares every member of the list
with the doubles.
"""


def page() -> str:
    """The page."""
    parts, without = surface.read()
    classes = [one for part in parts for one in part.classes]
    lines = [HEAD.format(classes=len(classes), members=sum(len(one.members) for one in classes))]
    for part in parts:
        lines += [
            f"## {part.title}\n",
            "| class | members | known by | in the virtual cabinet |",
            "|---|---|---|---|",
        ]
        for one in part.classes:
            lines.append(
                f"| `{one.name.replace('$', '.')}` | {len(one.members) or ''} | {one.known} | {one.does} |"
            )
        lines.append("")
    lines += ["## What is missing\n", "| missing | reason |", "|---|---|"]
    lines += [f"| {what} | {why} |" for what, why in without]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write or check the page."""
    text = page()
    if "--check" in sys.argv:
        if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
            print(f"{PAGE.relative_to(ROOT)} differs from the list; run python scripts/sunrise_page.py")
            return 1
        return 0
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
