"""The compiled part of heptarm, `heptarm._native`: its functions in C by their names."""

from __future__ import annotations

import ctypes
import functools
import os

from heptarm.errors import HeptarmError

#: Environment variable; any value switches the compiled part off.
SWITCH = "HEPTARM_PURE_PYTHON"


class Unavailable(HeptarmError):
    """The compiled part is not available; the text gives the reason."""


def extension_file(*, has_twin: bool = True) -> str:
    """Path of the extension.

    Args:
        has_twin: see `library`.

    Raises:
        Unavailable: it was not built, or is switched off.
    """
    if has_twin and os.environ.get(SWITCH):
        raise Unavailable(f"switched off by {SWITCH}")
    try:
        from heptarm import _native
    except ImportError as error:
        raise Unavailable(
            f"the compiled part of heptarm is missing: {error}",
            hint="install a wheel of heptarm, or run `make native` in its repository, which needs a C compiler",
        ) from None
    assert _native.__file__ is not None
    return _native.__file__


def library(*, holds_gil: bool = False, has_twin: bool = True) -> ctypes.CDLL:
    """The functions of the extension.

    Args:
        holds_gil: for short functions: they run without releasing Python's lock.
        has_twin: another implementation in Python takes over where the extension is switched off.

    Raises:
        Unavailable: see `extension_file`.
    """
    return _load(extension_file(has_twin=has_twin), holds_gil)


@functools.cache
def _load(path: str, holds_gil: bool) -> ctypes.CDLL:
    return (ctypes.PyDLL if holds_gil else ctypes.CDLL)(path)
