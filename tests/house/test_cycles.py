"""No module of heptarm imports one that imports it, wherever: there is no circle.

Imports inside functions and those for type checkers count: a circle of them is one to anybody who reads the modules. A
package's own `__init__` counts where somebody imports a name from it, not where a module in it is imported.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path

try:
    import tomllib
except ModuleNotFoundError:  # Python 3.10
    import tomli as tomllib  # type: ignore[no-redef]

SOURCES = Path(__file__).resolve().parents[2] / "src"
PACKAGE = "heptarm"


def _modules() -> dict[str, Path]:
    """Every module by its name."""
    found = {}
    for path in sorted((SOURCES / PACKAGE).rglob("*.py")):
        parts = path.relative_to(SOURCES).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _targets(node: ast.Import | ast.ImportFrom, package: str, known: dict[str, Path]) -> Iterator[str]:
    """The modules of heptarm that an import names."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in known)
        return
    base = node.module or ""
    if node.level:
        parents = package.split(".")
        base = ".".join([*parents[: len(parents) - node.level + 1], *([base] if base else [])])
    for alias in node.names:
        inner = f"{base}.{alias.name}"
        if inner in known:
            yield inner
        elif base in known:
            yield base


@functools.cache
def imports() -> dict[str, set[str]]:
    """For each module those that it imports anywhere in it."""
    known = _modules()
    graph = {}
    for name, path in known.items():
        package = name if path.name == "__init__.py" else name.rpartition(".")[0]
        tree = ast.parse(path.read_text(encoding="utf-8"))
        nodes = (node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom))
        found = (target for node in nodes for target in _targets(node, package, known))
        graph[name] = {target for target in found if target != name}
    return graph


def _circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """One circle for each group of modules that import each other, the shortest."""
    found: list[list[str]] = []
    seen: set[str] = set()
    for start in sorted(graph):
        before: dict[str, str] = {}
        front = [start]
        while front and start not in before:
            ahead = []
            for name in front:
                for target in sorted(graph[name]):
                    if target not in before:
                        before[target] = name
                        ahead.append(target)
            front = ahead
        if start not in before or start in seen:
            continue
        circle = [start]
        while (name := before[circle[-1]]) != start:
            circle.append(name)
        found.append([start, *reversed(circle[1:]), start])
        seen.update(circle)
    return found


def test_imports_form_no_circle() -> None:
    graph = imports()
    assert len(graph) > 50, "the walk has found the package"
    circles = "\n".join("  " + " -> ".join(circle) for circle in _circles(graph))
    assert not circles, (
        f"modules import each other:\n{circles}\n"
        "Move what both need into a module below them; an import inside a function only hides the circle."
    )


def test_a_circle_is_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a", "e"}, "e": {"d"}}
    assert _circles(graph) == [["b", "c", "b"], ["d", "e", "d"]]
    assert not _circles({"a": {"b", "c"}, "b": {"c"}, "c": set()})


def test_imports_inside_functions_and_for_type_checkers_count() -> None:
    """Foresight takes the planner in a function, teleoperation some types for the type checker only."""
    graph = imports()
    assert "heptarm.planning.lookahead" in graph["heptarm.arm.motion.foresight"]
    assert "heptarm.values.clearance" in graph["heptarm.skills.teleoperation"]


def test_no_contract_has_an_exception() -> None:
    contracts = tomllib.loads((SOURCES.parent / "pyproject.toml").read_text(encoding="utf-8"))
    rules = contracts["tool"]["importlinter"]["contracts"]
    assert len(rules) > 3 and not [rule["name"] for rule in rules if "ignore_imports" in rule]


def test_nobody_reaches_into_an_arm() -> None:
    """Scenarios, skills, tools and tests use what an arm offers, `arm.connection` where they need the messages."""
    root = SOURCES.parent
    inside = re.compile(r"\b(?!self\b|cls\b)\w+\._(connection|transport)\b")
    folders = (
        "src/heptarm/testing",
        "src/heptarm/skills",
        "src/heptarm/cli",
        "src/heptarm/ros",
        "tests",
        "bench",
    )
    found = [
        f"{path.relative_to(root)}:{number}: {line.strip()}"
        for folder in folders
        for path in sorted((root / folder).rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if inside.search(line)
    ]
    assert not found, "use arm.connection:\n" + "\n".join(found)
