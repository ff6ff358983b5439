"""Field-by-field translation: what values and messages call alike is copied by name and converted by type.

A new field that a value and its message call alike needs no edit here. The modules beside this one add what differs.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from inspect import signature
from operator import attrgetter
from typing import Any, NoReturn, TypeVar

from heptarm.values.frames import TOOL
from heptarm.wire import messages as wire

_Message = TypeVar("_Message")
_Value = TypeVar("_Value")

#: The messages by their names; a value and its message have the same class name.
NAMES: dict[str, Any] = vars(wire)


def message_of(kind: type[_Message], value: object, **given: object) -> _Message:
    """A message whose fields are the attributes of a value under the same names.

    Args:
        kind: class of the message.
        value: where the fields come from.
        **given: fields that come from elsewhere, unconverted.
    """
    return kind(
        **{
            name: given[name] if name in given else convert(getattr(value, name))
            for name, convert in _converters(kind).items()  # type: ignore[arg-type]
            if name in given or hasattr(value, name)
        }
    )


def value_of(kind: type[_Value], message: Any, **given: object) -> _Value:
    """A value whose fields are those of a message under the same names, besides the `given` ones."""
    getter = None if given else _getter(kind)  # type: ignore[arg-type]
    if getter is not None:
        return kind(*getter(message))
    return kind(**{name: getattr(message, name) for name in _names(kind) if name not in given}, **given)  # type: ignore[arg-type]


def frame_message(name: str) -> str:
    """Name of a frame on the wire, where the tool frame has none."""
    return "" if name == TOOL else name


@cache
def _names(kind: type) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


@cache
def _getter(kind: type) -> Callable[[Any], tuple[Any, ...]] | None:
    """All fields of a value at once, in order; None: not all of them may be given in order."""
    names = _names(kind)
    in_order = tuple(
        parameter.name
        for parameter in signature(kind).parameters.values()
        if parameter.kind is parameter.POSITIONAL_OR_KEYWORD
    )
    is_in_order = in_order == names and len(names) > 1
    return attrgetter(*names) if is_in_order else None  # one of a single name returns no tuple


@cache
def hints(kind: type) -> dict[str, str]:
    """The fields of a message and their types, as text."""
    return {field.name: str(field.type) for field in fields(kind)}


@cache
def _converters(kind: type) -> dict[str, Callable[[Any], Any]]:
    return {name: _converter(name, hint) for name, hint in hints(kind).items()}


def _converter(name: str, hint: str) -> Callable[[Any], Any]:
    if name == "frame":
        return frame_message
    if hint in ("float", "int", "bool", "str"):
        return {"float": float, "int": int, "bool": bool, "str": str}[hint]
    if hint.startswith("tuple[float"):
        return lambda value: tuple(value.tolist())
    kind = NAMES.get(hint)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return lambda value: kind[value.upper()]
    if is_dataclass(kind):
        return lambda value: message_of(kind, value)  # type: ignore[arg-type]
    return lambda value: _refuse(name, hint)


def _refuse(name: str, hint: str) -> NoReturn:
    raise TypeError(f"the field {name} needs a conversion to {hint}; give it to message_of")
