"""Text from the network, made safe to print: what could control a terminal or forge a line of a log is removed."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

from heptarm.values.text import printable
from heptarm.wire.messages import Message, ProcessData

#: Fields that may have several lines.
_WITH_LINES = ("text",)


def printable_message(message: Message) -> Message:
    """Remove from all texts of a message what cannot be printed; values of process data stay as they are."""
    kind = type(message)
    if kind is ProcessData or not (_TEXTS[kind] if kind in _TEXTS else _has_text(kind)):
        return message
    cleaned: Message = _cleaned(message, lines=False)
    return cleaned


def _cleaned(value: Any, *, lines: bool) -> Any:
    if isinstance(value, str):
        return printable(value, lines=lines)
    if isinstance(value, tuple):
        new = tuple(_cleaned(element, lines=lines) for element in value)
        return value if all(a is b for a, b in zip(value, new)) else new
    if not is_dataclass(value) or isinstance(value, type) or not _has_text(type(value)):
        return value
    changed = {}
    for name in _TEXTS[type(value)]:
        old = getattr(value, name)
        new = _cleaned(old, lines=name in _WITH_LINES)
        if new is not old:
            changed[name] = new
    return replace(value, **changed) if changed else value


#: By class: its fields that are texts, or may contain some.
_TEXTS: dict[type, tuple[str, ...]] = {}


def _has_text(kind: Any) -> bool:
    if kind not in _TEXTS:
        numbers = ("int", "float", "bool", "bytes", "int | None", "float | None")
        _TEXTS[kind] = tuple(
            field.name
            for field in fields(kind)
            if str(field.type) not in numbers and not str(field.type).startswith(("tuple[float", "tuple[int"))
        )
    return bool(_TEXTS[kind])
