"""A substitute for `ros2 launch`, which is in no wheel: builds the description of an XML launch file.

It knows the part of upstream's language that the files of this repository use: arg, let, include, group,
push_ros_namespace, node, param, remap, `if` and `unless`, and the substitutions var, find-pkg-share, eval and command.
What it does not know is an error. Commands are really run.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

ROS2 = Path(__file__).parents[2] / "ros2"
_INNER = re.compile(r"\$\((var|find-pkg-share) ([^()$]*)\)")
_QUOTED = re.compile(r"\$\((eval|command) '((?:\\.|[^'\\])*)'\)")
_KNOWN = {"arg", "let", "include", "group", "push_ros_namespace", "node"}


@dataclass
class LaunchedNode:
    """A node of a description.

    Attributes:
        package: of its executable.
        executable: its name.
        name: of the node; empty: the executable's own.
        namespace: absolute.
        parameters: by name with dots.
        remaps: of names.
        arguments: of the executable.
    """

    package: str
    executable: str
    name: str
    namespace: str
    parameters: dict[str, Any] = field(default_factory=dict)
    remaps: dict[str, str] = field(default_factory=dict)
    arguments: list[str] = field(default_factory=list)

    def command(self) -> list[str]:
        """Arguments of a process for it, behind the executable."""
        words = [*self.arguments, "--ros-args", "-r", f"__ns:={self.namespace}"]
        if self.name:
            words += ["-r", f"__node:={self.name}"]
        for old, new in self.remaps.items():
            words += ["-r", f"{old}:={new}"]
        for name, value in self.parameters.items():
            words += ["-p", f"{name}:={yaml.safe_dump(value, default_flow_style=True).splitlines()[0]}"]
        return words


def describe(package: str, name: str, **arguments: str) -> list[LaunchedNode]:
    """The nodes that a launch file of a package starts."""
    return _Scope(dict(arguments), "/").file(ROS2 / package / "launch" / name)


class _Scope:
    """Values of arguments, and the namespace, of a file or a group."""

    def __init__(self, values: dict[str, str], namespace: str) -> None:
        self._values, self._namespace = values, namespace

    def file(self, path: Path) -> list[LaunchedNode]:
        return self._entities(ET.parse(path).getroot())

    def _entities(self, parent: ET.Element) -> list[LaunchedNode]:
        found: list[LaunchedNode] = []
        for one in parent:
            assert one.tag in _KNOWN, f"unknown element {one.tag}"
            if not self._applies(one):
                continue
            if one.tag == "arg":
                name, default = one.get("name", ""), one.get("default")
                assert name in self._values or default is not None, f"{name} is required"
                self._values.setdefault(name, self.text(default or ""))
            elif one.tag == "let":
                self._values[one.get("name", "")] = self.text(one.get("value", ""))
            elif one.tag == "push_ros_namespace":
                self._namespace = _below(self._namespace, self.text(one.get("namespace", "")))
            elif one.tag == "group":
                found += _Scope(self._values, self._namespace)._entities(one)
            elif one.tag == "include":
                given = {arg.get("name", ""): self.text(arg.get("value", "")) for arg in one}
                path = Path(self.text(one.get("file", "")))
                declared = {arg.get("name") for arg in ET.parse(path).getroot().findall("arg")}
                assert given.keys() <= declared, given.keys() - declared
                found += _Scope(given, self._namespace).file(path)
            else:
                found.append(self._node(one))
        return found

    def _applies(self, one: ET.Element) -> bool:
        def is_true(text: str) -> bool:
            value = self.text(text).strip().lower()
            assert value in ("true", "false", "1", "0"), f"{text} is no condition: {value}"
            return value in ("true", "1")

        condition, against = one.get("if"), one.get("unless")
        return (condition is None or is_true(condition)) and (against is None or not is_true(against))

    def _node(self, one: ET.Element) -> LaunchedNode:
        node = LaunchedNode(
            one.get("pkg", ""), one.get("exec", ""), self.text(one.get("name", "")), self._namespace
        )
        node.arguments = shlex.split(self.text(one.get("args", "")))
        for inner in one:
            if inner.tag == "remap":
                node.remaps[self.text(inner.get("from", ""))] = self.text(inner.get("to", ""))
            elif inner.get("from") is not None:
                text = Path(self.text(inner.get("from", ""))).read_text(encoding="utf-8")
                if inner.get("allow_substs") == "true":
                    text = self.text(text)
                node.parameters |= parameters_of(yaml.safe_load(text), node)
            else:
                value = self.text(inner.get("value", ""))
                node.parameters[inner.get("name", "")] = (
                    value if inner.get("type") == "str" else yaml.safe_load(value or "''")
                )
        return node

    def text(self, text: str) -> str:
        """A text with its substitutions, the innermost first."""
        while True:
            replaced = _INNER.sub(self._simple, text)
            if replaced == text:
                replaced = _QUOTED.sub(self._quoted, text)
            if replaced == text:
                assert "$(" not in text, f"unknown substitution in {text}"
                return text
            text = replaced

    def _simple(self, match: re.Match[str]) -> str:
        verb, name = match.groups()
        if verb == "var":
            assert name in self._values, f"{name} is no argument"
            return self._values[name]
        assert (ROS2 / name / "package.xml").is_file(), f"no package {name}"
        return str(ROS2 / name)

    @staticmethod
    def _quoted(match: re.Match[str]) -> str:
        verb, text = match.group(1), re.sub(r"\\(.)", r"\1", match.group(2))
        if verb == "eval":
            return str(eval(text, {"__builtins__": {}}))
        path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        done = subprocess.run(
            shlex.split(text),
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PATH": path},
        )
        return done.stdout


def parameters_of(tree: Mapping[str, Any], node: LaunchedNode) -> dict[str, Any]:
    """Parameters of a file that are a node's, by name with dots; `**` stands for any namespace."""
    found: dict[str, Any] = {}
    full = _below(node.namespace, node.name or node.executable)
    for name, values in tree.items():
        pattern = re.escape(name if name.startswith("/") else f"/{name}").replace(r"/\*\*", r"(/\w+)*")
        if re.fullmatch(pattern, full):
            found |= flat(values["ros__parameters"])
    return found


def flat(values: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Parameters by name with dots."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        found |= flat(value, f"{before}{name}.") if isinstance(value, dict) else {f"{before}{name}": value}
    return found


def _below(namespace: str, name: str) -> str:
    if name.startswith("/"):
        return name
    return f"{namespace.rstrip('/')}/{name}".rstrip("/") or "/"
