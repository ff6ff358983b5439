"""Reads protocol.toml into a small model: types, fields, enumerations, structs, unions, messages; and checks it."""

from __future__ import annotations

import math
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).resolve().parent
PRIMITIVES = {"bool": "B", "u8": "B", "u16": "H", "u32": "I", "u64": "Q", "i32": "i", "i64": "q", "f64": "d"}
SIZES = {"bool": 1, "u8": 1, "u16": 2, "u32": 4, "u64": 8, "i32": 4, "i64": 8, "f64": 8}


def read_toml(file: Path) -> dict[str, Any]:
    """What a file of the schema describes."""
    return tomllib.loads(file.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Type:
    """kind: prim, array, str, bytes, list, opt, enum, flags, struct, union."""

    kind: str
    name: str = ""
    size: int = 0
    of: Type | None = None

    @property
    def text(self) -> str:
        if self.kind == "array":
            return f"{self.name}[{self.size}]"
        if self.kind in ("list", "opt"):
            assert self.of is not None
            return f"{self.kind}<{self.of.text}>"
        return self.name or self.kind


@dataclass(frozen=True)
class Field:
    name: str
    type: Type
    doc: str = ""
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    nan: bool = False
    norm: float | None = None
    min_len: int = 0
    max_len: int = 65535
    default: Any = None
    has_default: bool = False

    @property
    def ranged(self) -> bool:
        return math.isfinite(self.low) or math.isfinite(self.high)

    @property
    def range_text(self) -> str:
        if self.type.kind in ("str", "list", "bytes"):
            return (
                f"{self.min_len} to {self.max_len} long" if (self.min_len, self.max_len) != (0, 65535) else ""
            )
        if self.norm is not None:
            return "unit norm"
        if not self.ranged:
            return ""
        return f"{'(' if self.low_open else '['}{self.low:g}, {self.high:g}]"


@dataclass(frozen=True)
class Enum:
    name: str
    base: str
    doc: str
    values: list[dict[str, Any]]
    flags: bool = False


@dataclass(frozen=True)
class Struct:
    name: str
    doc: str
    fields: list[Field]


@dataclass(frozen=True)
class Union:
    name: str
    doc: str
    members: list[tuple[int, str]]
    #: Fields that some members have; in Java the union has a method for each, which returns "", NaN or null for the others.
    common: tuple[str, ...] = ()


@dataclass(frozen=True)
class Message:
    name: str
    id: int
    source: str
    kind: str
    role: str
    doc: str
    fields: list[Field]
    groups: list[tuple[str, int, str]] = field(default_factory=list)
    datagram: bool = False


@dataclass(frozen=True)
class State:
    """A state of a session; `next` maps a message or a kind of message to the new state."""

    name: str
    doc: str
    next: dict[str, str]


@dataclass(frozen=True)
class Spec:
    protocol: dict[str, Any]
    header: list[dict[str, Any]]
    enums: dict[str, Enum]
    structs: dict[str, Struct]
    unions: dict[str, Union]
    messages: dict[str, Message]
    errors: list[dict[str, Any]]
    session: dict[str, State] = field(default_factory=dict)

    def defaulted(self, name: str) -> bool:
        """Whether every field of a struct has a default."""
        return all(self.has_default(one) for one in self.structs[name].fields)

    def has_default(self, one: Field) -> bool:
        kind = one.type.kind
        if one.has_default or kind == "opt":
            return True
        if kind in ("str", "list", "bytes"):
            return one.min_len == 0
        return kind == "struct" and self.defaulted(one.type.name)


_ATTRIBUTES = {
    "name",
    "type",
    "doc",
    "unit",
    "min",
    "max",
    "min_open",
    "nan",
    "norm",
    "min_len",
    "max_len",
    "default",
}


def kinds_of(raw: dict[str, Any]) -> dict[str, str]:
    """Kind of each named type: enum, flags, struct or union."""
    return {name: kind for kind in ("enum", "flags", "struct", "union") for name in raw[kind]}


def parse_type(text: str, kinds: dict[str, str]) -> Type:
    """Read a type such as `f64[7]` or `list<Item>`.

    Raises:
        ValueError: there is no such type.
    """
    if text in PRIMITIVES:
        return Type("prim", text)
    if text in ("str", "bytes"):
        return Type(text)
    if match := re.fullmatch(r"(list|opt)<(.+)>", text):
        return Type(match[1], of=parse_type(match[2], kinds))
    if match := re.fullmatch(r"(\w+)\[(\d+)\]", text):
        return Type("array", match[1], int(match[2]))
    if text in kinds:
        return Type(kinds[text], text)
    raise ValueError(f"unknown type {text!r}")


def parse_field(entry: dict[str, Any], kinds: dict[str, str]) -> Field:
    """Read a field.

    Raises:
        ValueError: an unknown type or attribute.
    """
    if extra := set(entry) - _ATTRIBUTES:
        raise ValueError(f"field {entry['name']}: unknown attributes {extra}")
    return Field(
        entry["name"],
        parse_type(entry["type"], kinds),
        entry.get("doc", ""),
        entry.get("unit", ""),
        float(entry.get("min", -math.inf)),
        float(entry.get("max", math.inf)),
        entry.get("min_open", False),
        entry.get("nan") == "keeps",
        entry.get("norm"),
        entry.get("min_len", 0),
        entry.get("max_len", 65535),
        entry.get("default"),
        "default" in entry,
    )


def load(folder: Path = HERE) -> Spec:
    raw = read_toml(folder / "protocol.toml")
    errors = read_toml(folder / "errors.toml")["error"]
    kinds = kinds_of(raw)
    enums = {n: Enum(n, e.get("base", "u8"), e["doc"], e["values"]) for n, e in raw["enum"].items()}
    enums |= {n: Enum(n, e["base"], e["doc"], e["values"], flags=True) for n, e in raw["flags"].items()}
    structs = {
        n: Struct(n, s["doc"], [parse_field(f, kinds) for f in s["fields"]]) for n, s in raw["struct"].items()
    }
    unions = {
        n: Union(n, u["doc"], [(m["tag"], m["type"]) for m in u["members"]], tuple(u.get("common", ())))
        for n, u in raw["union"].items()
    }
    messages = {}
    for name, entry in raw["message"].items():
        groups = []
        if "groups" in entry:
            bits = {value["name"]: value["bit"] for value in raw["flags"][entry["groups"]["flags"]]["values"]}
            groups = [(m["bit"], bits[m["bit"]], m["type"]) for m in entry["groups"]["members"]]
        messages[name] = Message(
            name,
            entry["id"],
            entry["from"],
            entry["kind"],
            entry.get("role", "any"),
            entry["doc"],
            [parse_field(f, kinds) for f in entry.get("fields", [])],
            groups,
            entry.get("datagram", False),
        )
    session = {n: State(n, e["doc"], e["next"]) for n, e in raw.get("session", {}).items()}
    spec = Spec(raw["protocol"], raw["header"]["fields"], enums, structs, unions, messages, errors, session)
    _refuse_recursion(spec)
    _refuse_unknown_symbols(spec)
    ids = [message.id for message in messages.values()]
    if len(set(ids)) != len(ids):
        raise ValueError("two messages share an id")
    return spec


def symbol(message: Message) -> str:
    """The name of a message in the session's table: its own for the handshake and Goodbye, its kind for all others."""
    return message.name if message.kind == "handshake" or message.name == "Goodbye" else message.kind


def _refuse_unknown_symbols(spec: Spec) -> None:
    known = {symbol(message) for message in spec.messages.values()}
    for state in spec.session.values():
        for name, target in state.next.items():
            if name not in known or target not in spec.session:
                raise ValueError(
                    f"session state {state.name}: {name} -> {target} names no message or no state"
                )


def _refuse_recursion(spec: Spec) -> None:
    def visit(name: str, above: tuple[str, ...]) -> None:
        if name in above:
            raise ValueError(f"recursive type: {' -> '.join([*above, name])}")
        if name in spec.unions:
            children = [member for _, member in spec.unions[name].members]
        else:
            children = []
            for one in spec.structs[name].fields:
                inner: Type | None = one.type
                while inner is not None and inner.kind in ("list", "opt"):
                    inner = inner.of
                if inner is not None and inner.kind in ("struct", "union"):
                    children.append(inner.name)
        for child in children:
            visit(child, (*above, name))

    for name in [*spec.structs, *spec.unions]:
        visit(name, ())


def ordered_structs(spec: Spec) -> list[str]:
    """Structs and unions with everything that they use before them."""
    done: list[str] = []

    def visit(name: str) -> None:
        if name in done or name in spec.enums:
            return
        if name in spec.unions:
            for _, member in spec.unions[name].members:
                visit(member)
        else:
            for one in spec.structs[name].fields:
                inner: Type | None = one.type
                while inner is not None and inner.kind in ("list", "opt"):
                    inner = inner.of
                if inner is not None and inner.kind in ("struct", "union"):
                    visit(inner.name)
        done.append(name)

    for name in [*spec.structs, *spec.unions]:
        visit(name)
    return done
