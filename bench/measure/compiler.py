"""Compiles the C programs that measure floors."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path


def compiled(source: Path, folder: Path) -> Path:
    """Compile one source to a program in a folder.

    Raises:
        RuntimeError: there is no C compiler.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise RuntimeError(f"no C compiler to compile {source.name} with; install gcc")
    program = folder / source.stem
    subprocess.run([compiler, "-O2", "-pthread", "-o", str(program), str(source), "-lm"], check=True)
    return program
