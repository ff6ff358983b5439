"""All scenarios that come with heptarm."""

from __future__ import annotations

import fnmatch
import importlib
from collections.abc import Sequence

from heptarm.errors import CommandRejected
from heptarm.testing.scenario import REGISTRY, Scenario

#: Modules of this package that define scenarios, in the order in which they run.
GROUPS = (
    "model",
    "state",
    "link",
    "motions",
    "paths",
    "programs",
    "modes",
    "patterns",
    "conditions",
    "servo",
    "tools",
    "signals",
    "contact",
    "guiding",
    "safety",
    "applications",
)


def scenarios() -> tuple[Scenario, ...]:
    """All of them, group by group."""
    for group in GROUPS:
        importlib.import_module(f"heptarm.testing.{group}")
    return tuple(sorted(REGISTRY.values(), key=lambda one: GROUPS.index(one.group)))


def find(patterns: Sequence[str] = ()) -> tuple[Scenario, ...]:
    """Scenarios by name, group, or pattern such as "motions.*"; without any: all.

    Raises:
        CommandRejected: a pattern that fits none.
    """
    every = scenarios()
    if not patterns:
        return every
    for pattern in patterns:
        if not any(_fits(one, pattern) for one in every):
            raise CommandRejected(
                f"no scenario {pattern!r}",
                parameter="only",
                value=pattern,
                allowed=", ".join(dict.fromkeys(one.group for one in every)),
                hint="name a group, a scenario, or a pattern such as motions.*",
            )
    return tuple(one for one in every if any(_fits(one, pattern) for pattern in patterns))


def _fits(one: Scenario, pattern: str) -> bool:
    return one.group == pattern or fnmatch.fnmatchcase(one.name, pattern)
