"""Writes docs/reference/ros.md: the interface of both nodes, read from their sources, and its counterparts in Python.

    .venv/bin/python scripts/ros_table.py [--check]

It imports nothing of ROS: a declaration is a message type next to a name, in a call or in a table.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import sys
import types
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "src"), str(ROOT)]

import heptarm  # noqa: E402
from heptarm import modes, when  # noqa: E402
from heptarm.arm.arm import Arm  # noqa: E402
from heptarm.arm.devices.io import Io  # noqa: E402
from heptarm.arm.devices.operator import Operator  # noqa: E402
from heptarm.arm.devices.smartpad import Pad  # noqa: E402
from heptarm.arm.fri.session import Fri  # noqa: E402
from heptarm.arm.motion.handle import MotionHandle  # noqa: E402
from heptarm.arm.motion.servo import JointServo, PoseServo  # noqa: E402
from heptarm.ros.interface.actions import ACTIONS  # noqa: E402
from heptarm.ros.interface.names import PRESETS  # noqa: E402
from heptarm.ros.interface.planning import moveit  # noqa: E402
from heptarm.ros.interface.services import SERVICES  # noqa: E402
from heptarm.ros.interface.topics import TOPICS  # noqa: E402
from heptarm.ros.node.parameters import PARAMETERS, Parameter, joint_parameters  # noqa: E402
from scripts.ros_api import API, LIFE  # noqa: E402

PAGE = ROOT / "docs" / "reference" / "ros.md"
SOURCES = {
    "ROS 2": ROOT / "ros2" / "heptarm_ros2" / "heptarm_ros2",
    "ROS 1": ROOT / "ros1" / "heptarm_ros1" / "src" / "heptarm_ros1",
}
#: Modules of other nodes, and of other drivers' names, which have their own table.
OTHERS = ("reach.py", "presets.py")
KINDS = ("publishes", "subscribes", "service", "action")
#: The life cycle of ROS 2 is that of rclpy; in ROS 1 it consists of services.
STEPS = {
    "~configure": "change_state",
    "~activate": "change_state",
    "~deactivate": "change_state",
    "~cleanup": "change_state",
    "~reload": "set_parameters",
}
#: Classes and modules of each part of the API.
PARTS: dict[str, tuple[object, ...]] = {
    "arm": (Arm,),
    "arm.io": (Io,),
    "arm.pad": (Pad,),
    "arm.operator": (Operator,),
    "arm.fri(...)": (Fri,),
    "arm.servo(...)": (JointServo, PoseServo),
    "arm.start(...)": (MotionHandle,),
    "heptarm": (heptarm,),
    "heptarm.modes": (modes,),
    "heptarm.when": (when,),
}


@dataclass(frozen=True, slots=True)
class Declared:
    """A topic, a service or an action of a node.

    Attributes:
        name: as in ROS 2, "~/" for the node's own.
        kind: one of `KINDS`.
        type: "package/Type".
    """

    name: str
    kind: str
    type: str


def declared(folder: Path) -> dict[tuple[str, str], Declared]:
    """Collect everything that the sources in a folder declare, by kind and name."""
    found = {}
    for path in sorted(folder.glob("*.py")):
        if path.name not in OTHERS:
            for one in _of(ast.parse(path.read_text(encoding="utf-8"))):
                found[one.kind, one.name] = one
    return found


def _offered(functions: set[str]) -> Iterator[Declared]:
    """What a module offers by these functions of `heptarm.ros.interface.offered`."""
    if "offered" in functions:
        for row in SERVICES:
            yield Declared(row.name, "service", row.type)
        for topic in TOPICS:
            yield Declared(topic.name, "subscribes", topic.type)
    if "offered_actions" in functions:
        for action in ACTIONS:
            yield Declared(action.name, "action", action.type)


def _of(tree: ast.Module) -> Iterator[Declared]:
    types = {}  # of ROS: local name to kind and full name
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            if node.module == "heptarm.ros.interface.offered":
                yield from _offered({name.name for name in node.names})
            package, _, kind = node.module.partition(".")
            if kind in ("msg", "srv", "action"):
                for name in node.names:
                    types[name.asname or name.name] = (kind, f"{package}/{name.name}")
    for node in ast.walk(tree):
        if isinstance(node, ast.Tuple):
            entries, called = list(node.elts), ""
        elif isinstance(node, ast.Call):
            entries = list(node.args)
            called = ast.unparse(node.func).rpartition(".")[2]
        else:
            continue
        if called == "TrajectoryAction":
            entries = [
                one for entry in entries for one in (entry.elts if isinstance(entry, ast.Tuple) else [entry])
            ]
            for entry in entries:
                if isinstance(entry, ast.Constant) and str(entry.value).startswith("~"):
                    yield Declared(_name(str(entry.value)), "action", "control_msgs/FollowJointTrajectory")
            continue
        named = [entry.id for entry in entries if isinstance(entry, ast.Name) and entry.id in types]
        actions = [name for name in named if types[name][0] == "action" or name.endswith("Action")]
        named = actions if len(actions) == 1 else named  # beside its feedback and its result
        texts = [
            entry.value
            for entry in entries
            if isinstance(entry, ast.Constant) and isinstance(entry.value, str)
        ]
        if len(named) != 1 or len(texts) != 1:
            continue
        kind, kept = types[named[0]]
        if kind == "srv":
            yield Declared(_name(texts[0]), "service", kept)
        elif kind == "action" or kept.endswith("Action"):
            yield Declared(_name(texts[0]), "action", kept.removesuffix("Action"))
        elif "publisher" in called:
            yield Declared(_name(texts[0]), "publishes", kept)
        else:
            yield Declared(_name(texts[0]), "subscribes", kept)


def _name(text: str) -> str:
    return f"~/{text[1:].lstrip('/')}" if text.startswith("~") else text


def ros1(name: str) -> str:
    """Convert a name of ROS 2 to the notation of ROS 1."""
    return f"~{name[2:]}" if name.startswith("~/") else name


def members(part: str) -> list[str]:
    """List the public members of a part of the API; of a module its functions and values."""
    found: set[str] = set()
    for owner in PARTS[part]:
        if inspect.ismodule(owner):
            every = {name: getattr(owner, name) for name in owner.__all__}
            plain = part != "heptarm"  # its classes are values and errors
            found |= {name for name, one in every.items() if not name.startswith("_") and _counts(one, plain)}
        else:
            found |= {name for name, _ in inspect.getmembers(owner) if not name.startswith("_")}
    return sorted(found)


def _counts(one: object, plain: bool) -> bool:
    if plain:  # neither a union of types nor the base of conditions counts
        return not isinstance(one, types.UnionType) and one is not when.Condition
    return inspect.isfunction(one)


def in_ros(entry: tuple[str, ...], ros: str) -> str:
    """Describe the counterpart of a member in one ROS."""
    return ", ".join(_words(one, ros) for one in entry)


def _words(one: str, ros: str) -> str:
    if one == LIFE:
        return "`~/change_state`" if ros == "ROS 2" else "`~configure` to `~cleanup`"
    if " " in one:
        return one
    return f"`{one if ros == 'ROS 2' else ros1(one)}`"


def names_of(entry: tuple[str, ...]) -> list[str]:
    """List the names of the interface in an entry."""
    return [one for one in entry if " " not in one]


def _range(one: Parameter) -> str:
    if one.choices:
        return ", ".join(f"`{choice}`" for choice in one.choices)
    return f"{one.low:g} to {one.high:g}" if isinstance(one.default, float) else ""


def _default(one: Parameter) -> str:
    if isinstance(one.default, list):
        return f"`{one.default[0]}` to `{one.default[-1]}`"
    return f"`{one.default!r}`" if isinstance(one.default, str) else f"`{str(one.default).lower()}`"


def page() -> str:
    """Make the text of the page."""
    tables = {ros: declared(folder) for ros, folder in SOURCES.items()}
    lines = [
        "# ROS: topics, services, actions, parameters",
        "",
        "`scripts/ros_table.py` generates this page from the sources of both nodes. `~/` stands for the node's name,",
        "by default `/heptarm`; ROS 1 writes `~pose` for `~/pose`, and slashes instead of dots in names of parameters.",
        "",
        "## Topics, services and actions",
        "",
        "| name | what | type | ROS 2 | ROS 1 |",
        "|---|---|---|---|---|",
    ]
    keys = sorted({*tables["ROS 2"], *tables["ROS 1"]}, key=lambda key: (KINDS.index(key[0]), key[1]))
    for key in keys:
        two, one = (tables[ros].get(key) for ros in ("ROS 2", "ROS 1"))
        any_one = two or one
        assert any_one is not None
        life = STEPS.get(ros1(key[1])) if two is None else None
        there = "yes" if two else f"`~/{life}`" if life else "no"
        lines.append(f"| `{key[1]}` | {key[0]} | `{any_one.type}` | {there} | {'yes' if one else 'no'} |")
    lines += [
        "",
        "## From Python to ROS",
        "",
        "ROS counterparts of the public members of the Python API. Where there is none, the table gives the reason.",
        "",
        "| Python | ROS 2 | ROS 1 |",
        "|---|---|---|",
        *(
            f"| `{part}.{name}` | {in_ros(API[part][name], 'ROS 2')} | {in_ros(API[part][name], 'ROS 1')} |"
            for part in PARTS
            for name in members(part)
        ),
        "",
        "## Parameters",
        "",
        "The same in both. Changes of those marked *live* apply immediately, others with the next configuration.",
        "",
        "| name | default | allowed | meaning |",
        "|---|---|---|---|",
    ]
    of_a_joint = tuple(joint_parameters(["<joint>", *"234567"]))[:2]
    for one_parameter in (*PARAMETERS, *of_a_joint):
        live = "" if one_parameter.fixed else " *Live.*"
        text = one_parameter.text[0].upper() + one_parameter.text[1:]
        lines.append(
            f"| `{one_parameter.name}` | {_default(one_parameter)} | {_range(one_parameter)} | {text}.{live} |"
        )
    lines += [
        "",
        "## MoveIt's move_group",
        "",
        "With the parameter `moveit`, where `moveit_msgs` is installed, the node also offers these names, relative to",
        "its namespace; see [Paths around bodies](../guide/ros2.md#paths-around-bodies).",
        "",
        "| name | what | type |",
        "|---|---|---|",
        *(
            f"| `{row.name}` | {what} | `{row.type}` |"
            for what, rows in (
                ("subscribes", moveit.TOPICS),
                ("service", moveit.SERVICES),
                ("action", moveit.ACTIONS),
            )
            for row in rows
        ),
        "",
        "## Names of other drivers",
        "",
        "With the parameter `names`, the node also offers these names, relative to its namespace; see",
        "[Coming from other drivers](../guide/migration.md). Only ROS 1 has what needs `iiwa_msgs`: all of",
        "`iiwa_stack` but for its first three rows.",
        "",
        "| `names` | name | type | heptarm's own |",
        "|---|---|---|---|",
        *(
            f"| `{preset}` | `{entry.name}` | `{entry.type}` | `{entry.native}` |"
            for preset, names in PRESETS.items()
            for entry in names.entries
        ),
        "",
    ]
    return "\n".join(lines)


def main() -> int:
    """Write the page, or check that it is up to date."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--check", action="store_true", help="write nothing; fail if the page is not up to date"
    )
    text = page()
    if parser.parse_args().check:
        if not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
            print(f"{PAGE.relative_to(ROOT)} is not up to date: run scripts/ros_table.py", file=sys.stderr)
            return 1
        return 0
    PAGE.write_text(text, encoding="utf-8")
    print(PAGE.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
