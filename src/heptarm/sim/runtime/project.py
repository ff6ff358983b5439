"""A Sunrise project's RoboticsAPI.data.xml: process data, tool templates, taught frames."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree

from heptarm.errors import CommandRejected
from heptarm.values.checks import shown
from heptarm.values.files import read_xml, unreadable

Value = str | int | float | bool

_WHAT, _HINT = "a project file", "give the file that Sunrise Workbench has written"
_TRUTH = {"true": True, "false": False}
#: Range of Java's Integer.
_INTEGERS = range(-(2**31), 2**31)


def _convert(kind: str, text: str) -> Value:
    """A value of process data.

    Raises:
        ValueError: the text is not a value of its type.
    """
    if kind == "java.lang.Integer":
        try:
            number = int(text)
        except ValueError:
            raise ValueError(f"an Integer must be a whole number, got {shown(text)}") from None
        if number not in _INTEGERS:
            raise ValueError(f"an Integer must be in [-2147483648, 2147483647], got {shown(text)}")
        return number
    if kind == "java.lang.Double":
        return _finite(text, "a Double")
    if kind == "java.lang.Boolean":  # Java ignores the case, and projects in the field have "False"
        if text.lower() not in _TRUTH:
            raise ValueError(f"a Boolean must be true or false, got {shown(text)}")
        return _TRUTH[text.lower()]
    if kind == "java.lang.String":
        return text
    raise ValueError(
        f"type of process data must be Integer, Double, Boolean or String of java.lang, got {shown(kind)}"
    )


def _finite(text: str, what: str) -> float:
    """A finite number.

    Raises:
        ValueError: it is none.
    """
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise ValueError(f"{what} must be a finite number, got {shown(text)}")
    return number


def _unreadable(file: Path, why: str) -> CommandRejected:
    return unreadable(file, why, what=_WHAT, name="project", hint=_HINT)


def like(old: Value | None, text: str) -> Value:
    """Convert text to the type of another value; without one it stays text.

    Raises:
        ValueError: the text is not a value of that type.
    """
    names = {bool: "java.lang.Boolean", int: "java.lang.Integer", float: "java.lang.Double"}
    return _convert(names.get(type(old), "java.lang.String"), text)


@dataclass(frozen=True, slots=True)
class StoredProcessData:
    """Process data of a project.

    Attributes:
        values: by their ids.
        unusable: by their ids why others have no value; an application that asks for one gets this as error.
    """

    values: dict[str, Value]
    unusable: dict[str, str]


def read_process_data(file: Path) -> StoredProcessData:
    """Read the process data of a project file; without a value the default counts.

    Raises:
        CommandRejected: the file cannot be read or is not XML.
    """
    root = read_xml(file, _WHAT, name="project", hint=_HINT)
    found: dict[str, Value] = {}
    unusable: dict[str, str] = {}
    for element in root.iter("processData"):
        name, kind = element.get("id"), element.get("dataType", "java.lang.String")
        text = element.get("value", element.get("defaultValue"))
        if name is None or text is None:
            continue
        try:
            found[name] = _convert(kind, text)
        except ValueError as error:
            unusable[name] = f"{file.name}: {error}"
    return StoredProcessData(found, unusable)


#: x y z [mm], a b c [rad], as in the file.
Six: TypeAlias = tuple[float, ...]

#: E1 [rad], status, turn.
Redundancy: TypeAlias = tuple[float, int, int]

_E1 = "E1Parameter"
_PARAMETERS = (_E1, "StatusParameter", "TurnParameter")
_KINDS = {"toolTemplate": True, "workpieceTemplate": False}


@dataclass(frozen=True, slots=True)
class Template:
    """A tool or a workpiece.

    Attributes:
        name: its name in applications.
        is_tool: otherwise a workpiece.
        mass: [kg].
        centre: of mass and its axes, x y z [mm], a b c [rad].
        inertia: about those axes, shape (3,) [kg m²].
        moved: path of the default motion frame; empty: the root.
        frames: path and transformation from the parent, x y z [mm], a b c [rad]; parents first.
        type: the project's own class; empty: the default.
    """

    name: str
    is_tool: bool
    mass: float
    centre: Six
    inertia: Six
    moved: str
    frames: tuple[tuple[str, Six], ...]
    type: str = ""


@dataclass(frozen=True, slots=True)
class Project:
    """Objects and frames of a project.

    Attributes:
        templates: tools and workpieces.
        frames: taught frames: path and transformation from the parent; parents first.
        redundancies: path and E1 [rad], status, turn of the frames taught with an arm.
        parameters: path, name and value of the frames' additional parameters.
    """

    templates: tuple[Template, ...] = ()
    frames: tuple[tuple[str, Six], ...] = ()
    redundancies: tuple[tuple[str, Redundancy], ...] = ()
    parameters: tuple[tuple[str, str, Value], ...] = ()


def read_project(file: Path) -> Project:
    """Read the templates and frames of a project file.

    Raises:
        CommandRejected: the file cannot be read or is not XML, or a number in it is illegal.
    """
    root = read_xml(file, _WHAT, name="project", hint=_HINT)
    try:
        return Project(
            tuple(_template(element) for kind in _KINDS for element in root.iter(kind)),
            tuple(frame for world in root.iter("world") for frame in _frames(world)),
            tuple(redundancy for world in root.iter("world") for redundancy in _redundancies(world)),
            tuple(parameter for world in root.iter("world") for parameter in _parameters(world)),
        )
    except ValueError as error:
        raise _unreadable(file, str(error)) from None
    except RecursionError:
        raise _unreadable(file, "its frames are nested too deeply") from None


def _template(element: ElementTree.Element) -> Template:
    found = element.find("loadData")
    load = ElementTree.Element("loadData") if found is None else found
    return Template(
        element.get("name", ""),
        _KINDS[element.tag],
        _number(load, "mass"),
        tuple(_number(load, f"cog{axis}", f"centerOfMass{axis}") for axis in "XYZABC"),
        tuple(_number(load, f"inertia{axis}") for axis in "XYZ"),
        element.get("defaultMotionFrameRef", "").strip("/"),
        tuple(_frames(element)),
        element.get("class", ""),
    )


def _elements(parent: ElementTree.Element, path: str = "") -> Iterator[tuple[str, ElementTree.Element]]:
    """Path and element of each frame; parents first."""
    for element in parent:
        if element.tag == "frames":
            yield from _elements(element, path)
        elif element.tag == "frame":
            name = f"{path}{element.get('name', '')}"
            yield name, element
            yield from _elements(element, f"{name}/")


def _frames(parent: ElementTree.Element) -> Iterator[tuple[str, Six]]:
    for name, element in _elements(parent):
        found = element.find("transformation")
        placed = ElementTree.Element("transformation") if found is None else found
        yield name, tuple(_number(placed, axis) for axis in "xyzabc")


def _redundancies(parent: ElementTree.Element) -> Iterator[tuple[str, Redundancy]]:
    for name, element in _elements(parent):
        for found in element.iterfind("redundancyData/redundancy"):
            infos = {info.get("type", "").rpartition("$")[2]: info for info in found.iterfind("info")}
            if _E1 in infos:
                values = [_number(infos[key], "value") if key in infos else -1.0 for key in _PARAMETERS]
                yield name, (values[0], int(values[1]), int(values[2]))


def _parameters(parent: ElementTree.Element) -> Iterator[tuple[str, str, Value]]:
    for name, element in _elements(parent):
        for info in element.iterfind("additionalInformation/info"):
            key, text = info.get("key"), info.get("value")
            if key is not None and text is not None:
                with suppress(
                    ValueError
                ):  # of a type that no application reads, as the time of its last change
                    yield name, key, _convert(info.get("type", "java.lang.String"), text)


def _number(element: ElementTree.Element, *names: str) -> float:
    text = next((element.get(name) for name in names if element.get(name) is not None), None)
    return _finite(text, f"{element.tag} {names[0]}") if text else 0.0
