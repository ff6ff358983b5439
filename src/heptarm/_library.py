"""The compiled part of heptarm, `heptarm._native`: its functions in C by their names."""

from __future__ import annotations

import ctypes
import functools

from heptarm.errors import HeptarmError


class Unavailable(HeptarmError):
    """The compiled part is not available; the text gives the reason."""


def extension_file() -> str:
    """Path of the extension.

    Raises:
        Unavailable: it was not built.
    """
    try:
        from heptarm import _native
    except ImportError as error:
        raise Unavailable(
            f"the compiled part of heptarm is missing: {error}",
            hint="install a wheel of heptarm, or run `make native` in its repository, which needs a C compiler",
        ) from None
    assert _native.__file__ is not None
    return _native.__file__


def library(*, holds_gil: bool = False) -> ctypes.CDLL:
    """The functions of the extension.

    Args:
        holds_gil: for short functions: they run without releasing Python's lock.

    Raises:
        Unavailable: see `extension_file`.
    """
    return _load(extension_file(), holds_gil)


@functools.cache
def _load(path: str, holds_gil: bool) -> ctypes.CDLL:
    return (ctypes.PyDLL if holds_gil else ctypes.CDLL)(path)
