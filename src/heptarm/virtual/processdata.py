"""Process data of a Sunrise project: the typed settings of its RoboticsAPI.data.xml."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

Value = str | int | float | bool

_TRUTH = {"true": True, "false": False}


def _convert(kind: str, text: str) -> Value:
    if kind == "java.lang.Integer":
        return int(text)
    if kind == "java.lang.Double":
        return float(text)
    if kind == "java.lang.Boolean":
        if text not in _TRUTH:
            raise ValueError(f"{text!r} is neither true nor false")
        return _TRUTH[text]
    if kind == "java.lang.String":
        return text
    raise ValueError(f"{kind} is no type of process data")


def like(old: Value | None, text: str) -> Value:
    """Text as a value of the same type as another; text where there is no other.

    Raises:
        ValueError: the text is no value of that type.
    """
    names = {bool: "java.lang.Boolean", int: "java.lang.Integer", float: "java.lang.Double"}
    return _convert(names.get(type(old), "java.lang.String"), text)


def read(file: Path) -> dict[str, Value]:
    """Returns the process data of a project file by their ids; what has no value keeps its default.

    Raises:
        ValueError: the file is no XML, or a value does not fit its type.
        OSError: the file cannot be read.
    """
    try:
        root = ElementTree.fromstring(file.read_bytes())
    except ElementTree.ParseError as error:
        raise ValueError(f"{file} is no process data: {error}") from error
    found: dict[str, Value] = {}
    for one in root.iter("processData"):
        name, kind = one.get("id"), one.get("dataType", "java.lang.String")
        text = one.get("value", one.get("defaultValue"))
        if name is None or text is None:
            continue
        try:
            found[name] = _convert(kind, text)
        except ValueError as error:
            raise ValueError(f"{file}: process data {name}: {error}") from error
    return found
