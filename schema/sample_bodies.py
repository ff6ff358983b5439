"""Deterministic example bodies of every message, encoded here by a second, independent walk over the schema.

The generated Python codec and the Java codec are both checked against these bytes, so a mistake would have to be made three
times to go unseen.
"""

from __future__ import annotations

import random
import struct
from typing import Any

from spec import PRIMITIVES, Field, Spec, Type


class Maker:
    def __init__(self, spec: Spec, seed: str, size: int) -> None:
        self.spec = spec
        self.random = random.Random(seed)
        self.size = size

    def number(self, one: Field) -> float:
        if one.nan and self.random.random() < 0.3:
            return float("nan")
        low = one.low if one.low > -1e300 else -100.0
        high = one.high if one.high < 1e300 else max(low, 100.0)
        value = self.random.uniform(low, high)
        return value if not one.low_open else max(value, low + (high - low) * 1e-3)

    def integer(self, name: str, one: Field) -> int:
        bits = {"u8": 8, "u16": 16, "u32": 32, "u64": 63, "i32": 31, "i64": 63}[name]
        low = int(one.low) if one.low > -1e300 else 0
        high = int(one.high) if one.high < 1e300 else 2**bits - 1
        return self.random.randint(low, high)

    def value(self, t: Type, one: Field) -> bytes:
        if t.kind == "prim":
            return self._prim(t.name, one)
        if t.kind == "array":
            if one.norm is not None:
                raw = [self.random.gauss(0, 1) for _ in range(t.size)]
                norm = sum(v * v for v in raw) ** 0.5
                return b"".join(struct.pack(">d", v / norm) for v in raw)
            return b"".join(self._prim(t.name, one) for _ in range(t.size))
        if t.kind in ("str", "bytes"):
            size = max(one.min_len, min(one.max_len, self.random.randint(0, 12)))
            if t.kind == "bytes":
                return struct.pack(">I", size) + self.random.randbytes(size)
            text = "".join(self.random.choice("abcXYZ09_.µé") for _ in range(size)).encode()[: one.max_len]
            text = text.decode(errors="ignore").encode()
            return struct.pack(">H", len(text)) + text
        if t.kind in ("enum", "flags"):
            enum = self.spec.enums[t.name]
            if enum.flags:
                number = sum(1 << v["bit"] for v in enum.values if self.random.random() < 0.5)
            else:
                number = self.random.choice(enum.values)["value"]
            return struct.pack(">" + PRIMITIVES[enum.base], number)
        if t.kind == "struct":
            return self.fields(self.spec.structs[t.name].fields)
        if t.kind == "union":
            tag, member = self.random.choice(self.spec.unions[t.name].members)
            return bytes([tag]) + self.fields(self.spec.structs[member].fields)
        assert t.of is not None
        if t.kind == "opt":
            return b"\x01" + self.value(t.of, one) if self.random.random() < 0.5 else b"\x00"
        size = max(one.min_len, self.random.randint(0, self.size))
        return struct.pack(">H", size) + b"".join(self.value(t.of, Field("", t.of)) for _ in range(size))

    def _prim(self, name: str, one: Field) -> bytes:
        value: Any
        if name == "f64":
            value = self.number(one)
        elif name == "bool":
            value = self.random.random() < 0.5
        else:
            value = self.integer(name, one)
        return struct.pack(">" + PRIMITIVES[name], value)

    def fields(self, fields: list[Field]) -> bytes:
        return b"".join(self.value(field.type, field) for field in fields)


def body(spec: Spec, name: str, seed: str, size: int = 3) -> bytes:
    """A legal body of a message."""
    maker = Maker(spec, seed, size)
    message = spec.messages[name]
    if not message.groups:
        return maker.fields(message.fields)
    chosen = [group for group in message.groups if maker.random.random() < 0.7]
    mask = sum(1 << number for _, number, _ in chosen)
    parts = [maker.fields(spec.structs[kind].fields) for _, _, kind in chosen]
    return struct.pack(">H", mask) + b"".join(parts)


def golden(spec: Spec) -> list[dict[str, Any]]:
    """Four bodies of every message."""
    return [
        {"message": name, "type": message.id, "body": body(spec, name, f"{name}-{index}").hex()}
        for name, message in spec.messages.items()
        for index in range(4)
    ]
