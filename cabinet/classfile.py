"""Reads the constant pool of class files and refuses what a cabinet's JRE 6 does not have."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

JAVA_6 = 50
"""The class version of Java 6."""

# Size in bytes of a constant after its tag; Utf8 (1) is read by hand.
_SIZES = dict.fromkeys((7, 8, 16, 19, 20), 2) | {15: 3} | dict.fromkeys((3, 4, 9, 10, 11, 12, 17, 18), 4)
_SIZES |= {5: 8, 6: 8}
_CLASS_IN_DESCRIPTOR = re.compile(r"L([^;<]+)[;<]")


@dataclass(frozen=True)
class ClassFile:
    """What one class file refers to."""

    name: str
    version: int
    classes: frozenset[str]
    members: frozenset[tuple[str, str, str]]


def read(data: bytes) -> ClassFile:
    """Reads a class file.

    Args:
        data: the bytes of the file.

    Returns:
        Name, version, every class it names (also in descriptors), every member (class, name, descriptor).

    Raises:
        ValueError: it is no class file.
    """
    magic, _minor, version, count = struct.unpack_from(">IHHH", data)
    if magic != 0xCAFEBABE:
        raise ValueError("not a class file")
    pool: dict[int, tuple[int, bytes]] = {}
    at, index = 10, 1
    while index < count:
        tag = data[at]
        size = _SIZES[tag] if tag != 1 else struct.unpack_from(">H", data, at + 1)[0]
        start = at + 1 if tag != 1 else at + 3
        pool[index] = (tag, data[start : start + size])
        at = start + size
        index += 2 if tag in (5, 6) else 1

    def text(number: int) -> str:
        return pool[number][1].decode("utf-8", "replace")

    def named(number: int) -> str:
        return text(struct.unpack(">H", pool[number][1])[0])

    classes: set[str] = set()
    members: set[tuple[str, str, str]] = set()
    for number, (tag, body) in pool.items():
        if tag == 7:
            name = named(number)
            classes.update(_CLASS_IN_DESCRIPTOR.findall(name) if name.startswith("[") else [name])
        elif tag == 12:
            classes.update(_CLASS_IN_DESCRIPTOR.findall(text(struct.unpack(">HH", body)[1])))
        elif tag in (9, 10, 11):
            owner, signature = struct.unpack(">HH", body)
            name_at, descriptor_at = struct.unpack(">HH", pool[signature][1])
            members.add((named(owner), text(name_at), text(descriptor_at)))
        elif tag == 1 and body.startswith((b"L", b"(", b"[")) and b";" in body:
            classes.update(_CLASS_IN_DESCRIPTOR.findall(text(number)))
    this_class = struct.unpack_from(">H", data, at + 2)[0]
    return ClassFile(named(this_class), version, frozenset(classes), frozenset(members))


@dataclass(frozen=True)
class Refusals:
    """Packages, classes and members that a class must not refer to."""

    packages: tuple[str, ...]
    classes: frozenset[str]
    members: frozenset[tuple[str, str]]

    @classmethod
    def load(cls, path: Path, packages: Iterable[str] = ()) -> Refusals:
        """Reads a list such as ``java7.txt`` and adds more refused packages."""
        lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
        rows = [row for row in lines if row and row[0] != "#"]
        single = [row[0] for row in rows if len(row) == 1]
        return cls(
            packages=(*(name for name in single if name.endswith("/")), *packages),
            classes=frozenset(name for name in single if not name.endswith("/")),
            members=frozenset((row[0], row[1]) for row in rows if len(row) == 2),
        )

    def of(self, file: ClassFile) -> Iterator[str]:
        """One line for each violation in a class."""
        if file.version != JAVA_6:
            yield f"{file.name}: class version {file.version}, not {JAVA_6} (Java 6)"
        for name in sorted(file.classes):
            if name in self.classes or name.startswith(self.packages):
                yield f"{file.name}: refers to {name.replace('/', '.')}"
        for owner, name, descriptor in sorted(file.members):
            arguments = descriptor[: descriptor.find(")") + 1]
            names = {(at, what) for at in (owner, "*") for what in (name, name + arguments)}
            if names & self.members:
                yield f"{file.name}: uses {owner.replace('/', '.')}.{name}{descriptor}, which Java 6 lacks"
