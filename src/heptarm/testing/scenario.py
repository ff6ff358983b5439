"""What a scenario is: a function that shows something of a robot, and what it takes to see it."""

from __future__ import annotations

import fnmatch
import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

from heptarm.arm.arm import Arm
from heptarm.errors import CommandRejected
from heptarm.values.checks import instance

#: Lines of what heptarm is built for, by number: a scenario shows one of them.
LINES = {
    1: "Motions",
    2: "Programs",
    3: "Control modes",
    4: "Conditions",
    5: "Servo",
    6: "Tools and loads",
    7: "IO and smartPAD",
    8: "Contact and guidance",
    9: "State",
    10: "Safety and recovery",
    11: "Model functions",
    12: "The Java API in the cabinet",
    13: "Other people's applications",
}


class Risk(Enum):
    """What happens while a scenario runs."""

    STILL = "still"  # nothing moves
    FREE = "free"  # the arm moves in the air
    CONTACT = "contact"  # the arm touches something, or is moved by a force
    FAULT = "fault"  # something goes wrong on purpose


@dataclass(frozen=True, slots=True)
class Scenario:
    """Something that a robot shows.

    Attributes:
        name: group and name, as in "motions.lin".
        title: one sentence.
        show: shows it with an arm that rests at its home; raises NotShown where a measurement shows otherwise, and
            Unfit where there is nothing to show it with.
        rows: of the feature table.
        line: of `LINES`.
        risk: what happens meanwhile.
        space: how far from its place at home the flange goes [m].
        virtual: only a simulator may do it.
        operator: the program plays the person beside a simulator that it has started.
        needs: what the cabinet has to be capable of, by the names of `Arm.capabilities`.
        signals: what signals it has to have.
    """

    name: str
    title: str
    show: Callable[[Arm], None]
    rows: tuple[str, ...]
    line: int
    risk: Risk
    space: float
    virtual: bool
    operator: bool
    needs: tuple[str, ...]
    signals: tuple[str, ...]

    @property
    def group(self) -> str:
        """What is before the point of its name."""
        return self.name.partition(".")[0]

    @property
    def moves(self) -> bool:
        """Whether the arm moves."""
        return self.risk is not Risk.STILL


class _Member(Protocol):
    """A scenario, or a step of the commissioning run."""

    @property
    def name(self) -> str: ...
    @property
    def group(self) -> str: ...


M = TypeVar("M", bound=_Member)


def defined(registry: Mapping[str, M], package: str, groups: Sequence[str]) -> tuple[M, ...]:
    """What the modules of a package have defined, group by group.

    Args:
        registry: where they put it.
        package: whose modules are the groups.
        groups: in their order.
    """
    for group in groups:
        importlib.import_module(f"{package}.{group}")
    return tuple(sorted(registry.values(), key=lambda member: groups.index(member.group)))


def selected(every: Sequence[M], patterns: Sequence[str], *, what: str) -> tuple[M, ...]:
    """Those whose name or group is named, or that fit a pattern such as "motions.*"; without patterns: all.

    Raises:
        ShapeError: the patterns are no texts.
        CommandRejected: a pattern that fits none.
    """
    instance(patterns, (list, tuple), "patterns")
    fitting = {}
    for pattern in patterns:
        instance(pattern, str, "patterns")
        fitting[pattern] = {
            member.name
            for member in every
            if member.group == pattern or fnmatch.fnmatchcase(member.name, pattern)
        }
        if not fitting[pattern]:
            raise CommandRejected(
                f"no {what} {pattern!r}",
                parameter="only",
                value=pattern,
                allowed=", ".join(dict.fromkeys(member.group for member in every)),
                hint=f"name a group, a {what}, or a pattern such as {every[0].group}.*",
            )
    names = set().union(*fitting.values())
    return tuple(member for member in every if not patterns or member.name in names)


#: All scenarios by name, in the order in which their modules define them.
REGISTRY: dict[str, Scenario] = {}


def scenario(
    *,
    line: int,
    rows: str = "",
    risk: Risk = Risk.FREE,
    space: float = 0.25,
    virtual: bool = False,
    operator: bool = False,
    needs: tuple[str, ...] = (),
    signals: tuple[str, ...] = (),
) -> Callable[[Callable[[Arm], None]], Callable[[Arm], None]]:
    """Make a scenario of a function: its module and name are the scenario's, its docstring's first line the title.

    Args:
        line: of `LINES`.
        rows: of the feature table, with blanks between them.
        risk: what happens meanwhile.
        space: how far the flange goes [m].
        virtual: only a simulator may do it.
        operator: the program plays the person beside a simulator that it has started.
        needs: capabilities of the cabinet.
        signals: that the cabinet has.
    """

    def made(show: Callable[[Arm], None]) -> Callable[[Arm], None]:
        name = f"{show.__module__.rpartition('.')[2]}.{show.__name__}"
        title = (show.__doc__ or "").strip().partition("\n")[0].rstrip(".")
        REGISTRY[name] = Scenario(
            name,
            title,
            show,
            tuple(rows.split()),
            line,
            risk,
            0.0 if risk is Risk.STILL else space,
            virtual or operator,
            operator,
            needs,
            signals,
        )
        return show

    return made
