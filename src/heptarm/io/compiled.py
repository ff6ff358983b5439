"""C code that is compiled at its first use and kept in the user's cache."""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from heptarm.errors import HeptarmError

#: Environment variable; any value switches all compiled parts off.
SWITCH = "HEPTARM_PURE_PYTHON"


class Unavailable(HeptarmError):
    """A compiled part is not available; the text gives the reason."""


def with_headers(source: Path, *headers: Path) -> bytes:
    """The text of a source with the text of own headers in place of the lines that include them."""
    text = source.read_text(encoding="utf-8")
    for header in headers:
        included = re.compile(rf'#include ["<](?:[^"<]*/)?{re.escape(header.name)}[">]')
        text = included.sub(lambda _, header=header: header.read_text(encoding="utf-8"), text)  # type: ignore[misc]
    return text.encode()


def compiled_file(name: str, source: bytes) -> Path:
    """The shared library of C code; compiled at its first use.

    Args:
        name: of its file in the cache, which is `~/.cache/heptarm`, or `$XDG_CACHE_HOME/heptarm`.
        source: complete: it includes headers of the system only.

    Raises:
        Unavailable: this system is not supported, or has no compiler.
    """
    if os.environ.get(SWITCH):
        raise Unavailable(f"switched off by {SWITCH}")
    if sys.platform != "linux" or sys.byteorder != "little":
        raise Unavailable("compiled parts need Linux on a little-endian machine")
    key = hashlib.sha256(source + os.uname().machine.encode()).hexdigest()[:16]
    root = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    target = Path(root) / "heptarm" / f"{name}-{key}.so"
    try:
        if not target.exists():
            _compile(source, target)
    except OSError as error:
        raise Unavailable(f"the compiled part {name} cannot be built: {error}") from error
    return target


def compiled_library(name: str, source: bytes, *, holds_gil: bool = False) -> ctypes.CDLL:
    """Load C code.

    Args:
        name: see `compiled_file`.
        source: likewise.
        holds_gil: for short functions: they run without releasing Python's lock.

    Raises:
        Unavailable: see `compiled_file`.
    """
    target = compiled_file(name, source)
    try:
        return (ctypes.PyDLL if holds_gil else ctypes.CDLL)(str(target))
    except OSError as error:
        raise Unavailable(f"the compiled part {name} cannot be loaded: {error}") from error


def _compile(source: bytes, target: Path) -> None:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise Unavailable("no C compiler found: install gcc for the fastest loop")
    target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    # on the same file system, so that the last step is atomic
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        made = Path(folder) / "made.so"
        # without contraction, so that all numbers equal Python's to the last bit
        flags = ("-O2", "-shared", "-fPIC", "-ffp-contract=off")
        run = subprocess.run(
            [compiler, *flags, "-x", "c", "-o", str(made), "-", "-lm", "-lrt"],
            input=source,
            check=False,
            capture_output=True,
        )
        if run.returncode:
            raise Unavailable(
                f"{compiler} fails: {run.stderr.decode(errors='replace').strip().splitlines()[0]}"
            )
        os.replace(made, target)
