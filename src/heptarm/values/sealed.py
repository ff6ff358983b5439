"""What may be set on an object: a mistyped name is an error, not a new attribute that nobody reads."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, ClassVar

from heptarm.errors import UnknownSetting


class Sealed:
    """Base of objects that programs hold: only what the class declares can be set.

    Declared are properties with a setter, slots, and annotated attributes; those annotated `Final` are set once. Names
    with a leading underscore belong to the class itself and are not checked, since hot loops assign them.
    """

    __slots__ = ()

    #: Public names that can be set, and whether only once.
    _declared: ClassVar[dict[str, bool]] = {}

    def __init_subclass__(cls, **options: Any) -> None:
        """Collect what the class declares."""
        super().__init_subclass__(**options)
        cls._declared = _declarations(cls)

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a declared attribute.

        Raises:
            UnknownSetting: the class declares no such attribute, or it cannot be set.
        """
        if name[:1] != "_":
            is_final = self._declared.get(name)
            if is_final is None or (is_final and name in vars(self)):
                raise _refusal(self, name)
        object.__setattr__(self, name, value)


def meant(name: str, known: Iterable[str]) -> str:
    """The question after a mistyped name: "did you mean 'speed'?"; "" if nothing is like it."""
    by_lower = {name.lower(): name for name in known}
    found = get_close_matches(name.lower(), by_lower, n=1)
    return f"did you mean {by_lower[found[0]]!r}?" if found else ""


def _declarations(kind: type) -> dict[str, bool]:
    found: dict[str, bool] = {}
    for base in reversed(kind.__mro__):
        for name, annotation in inspect.get_annotations(base).items():
            text = str(annotation).rpartition("typing.")[2]
            found[name] = text.startswith("Final")
            if text.startswith("ClassVar"):
                del found[name]
        for name, entry in vars(base).items():
            if hasattr(entry, "__set__") and getattr(entry, "fset", True) is not None:
                found[name] = False
            elif callable(entry) or isinstance(entry, property):
                found.pop(name, None)
    return {name: final for name, final in found.items() if name[:1] != "_"}


def _refusal(owner: Sealed, name: str) -> UnknownSetting:
    """The error of an attribute that cannot be set."""
    kind = type(owner)
    settings = sorted(key for key, is_final in kind._declared.items() if not is_final)
    listed = f"settings are {', '.join(settings)}" if settings else "it has no settings"
    if name in kind._declared or hasattr(kind, name):
        text, question = f"{name} of {kind.__name__} cannot be set", ""
    else:
        text = f"{kind.__name__} has no setting {name!r}"
        question = meant(name, settings) or meant(name, (key for key in dir(kind) if key[:1] != "_"))
    return UnknownSetting(
        text, parameter=name, allowed=", ".join(settings), hint=f"{question} {listed}" if question else listed
    )
