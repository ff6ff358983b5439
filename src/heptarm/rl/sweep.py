"""Sweeps over settings: combinations of their values, and a recipe or a task that has them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from itertools import product
from typing import TYPE_CHECKING, TypeVar

from heptarm.errors import CommandRejected
from heptarm.rl.sim.randomisation import level

if TYPE_CHECKING:
    from heptarm.rl.train.recipe import Recipe

_Owner = TypeVar("_Owner")
#: Parts of a recipe that have settings: of the algorithm, and of the task.
_PARTS = ("settings", "task")


def sweep(texts: Sequence[str]) -> Iterator[dict[str, str]]:
    """All combinations of the values of some settings, each written as "NAME=VALUE,VALUE".

    Raises:
        CommandRejected: a text of another form, or a setting or a value of it twice.
    """
    given: dict[str, list[str]] = {}
    for text in texts:
        name, _, values = text.partition("=")
        listed = values.split(",")
        if not name or not all(listed) or len(set(listed)) < len(listed) or name in given:
            raise CommandRejected(
                f"sweep must be NAME=VALUE,VALUE with each name and each value once, got {text!r}",
                parameter="sweep",
                value=text,
                hint="for example --sweep learning_rate=3e-4,1e-3",
            )
        given[name] = listed
    for chosen in product(*given.values()):
        yield dict(zip(given, chosen, strict=True))


def with_setting(owner: _Owner, name: str, text: str) -> _Owner:
    """A frozen value with another number or word under a name.

    Raises:
        CommandRejected: it has no number or word of that name, or not such a one.
    """
    known = _settings(owner)
    if name not in known:
        raise _unknown(name, known)
    kind = type(known[name])
    try:
        return replace(owner, **{name: kind(text)})  # type: ignore[type-var]
    except CommandRejected:
        raise
    except ValueError:
        wanted = "an integer" if kind is int else "a number"
        raise CommandRejected(f"{name} must be {wanted}, got {text!r}", parameter=name, value=text) from None


def with_settings(recipe: Recipe, chosen: Mapping[str, str]) -> Recipe:
    """A recipe with other settings: its own, a level of `randomisation`, or those of algorithm or task.

    Raises:
        CommandRejected: there is no such setting; or algorithm and task have both one of that name.
    """
    for name, text in chosen.items():
        if name == "randomisation":
            recipe = replace(recipe, randomisation=level(text))
        elif name in _of_recipe(recipe):
            recipe = with_setting(recipe, name, text)
        else:
            part, plain = _place(recipe, name)
            recipe = replace(recipe, **{part: with_setting(getattr(recipe, part), plain, text)})
    return recipe


def _place(recipe: Recipe, name: str) -> tuple[str, str]:
    """Part of a recipe that has a setting, and the setting's name there."""
    part, dot, plain = name.partition(".")
    if dot and part in _PARTS:
        return part, plain
    known = {part: _settings(getattr(recipe, part)) for part in _PARTS}
    having = [part for part in _PARTS if name in known[part]]
    if not having:
        raise _unknown(name, {"randomisation", *_of_recipe(recipe)}.union(*known.values()))
    if len(having) > 1:
        raise CommandRejected(
            f"{name} is a setting of the algorithm and of the task",
            parameter="sweep",
            value=name,
            hint=" or ".join(f"{part}.{name}" for part in having),
        )
    return having[0], name


def _of_recipe(recipe: Recipe) -> set[str]:
    """Settings that a recipe has itself; a seed is none."""
    return set(_settings(recipe)) - {"seed"}


def _settings(owner: object) -> dict[str, float | str]:
    """Numbers and words of a frozen value."""
    found = {entry.name: getattr(owner, entry.name) for entry in fields(owner)}  # type: ignore[arg-type]
    return {name: value for name, value in found.items() if isinstance(value, (int, float, str))}


def _unknown(name: str, known: Iterable[str]) -> CommandRejected:
    return CommandRejected(
        f"sweep must name one of {', '.join(sorted(known))}, got {name!r}", parameter="sweep", value=name
    )
