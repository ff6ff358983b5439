"""No module of the nodes imports another one in a circle; imports for type checkers count."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NODES = {
    "heptarm_ros2": ROOT / "ros2" / "heptarm_ros2",
    "heptarm_ros1": ROOT / "ros1" / "heptarm_ros1" / "src",
    "heptarm.ros": ROOT / "src",
}


def imports(package: str, source: Path) -> dict[str, set[str]]:
    """The modules of a package by name, with those that each of them imports."""
    folder = source.joinpath(*package.split("."))
    paths = {".".join(path.relative_to(source).with_suffix("").parts): path for path in folder.rglob("*.py")}
    graph: dict[str, set[str]] = {}
    for name, path in paths.items():
        found: set[str] = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                found |= {node.module, *(f"{node.module}.{one.name}" for one in node.names)}
            elif isinstance(node, ast.Import):
                found |= {one.name for one in node.names}
        graph[name] = found & set(paths) - {name}
    return graph


@pytest.mark.parametrize("package", NODES)
def test_imports_form_no_circle(package: str) -> None:
    graph = imports(package, NODES[package])
    assert len(graph) > 5 and any(graph.values())
    TopologicalSorter(graph).prepare()  # raises CycleError, which names the circle
