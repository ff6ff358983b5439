"""Compiles the C and C++ programs of the benchmarks."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

#: The C++ client.
_CPP = Path(__file__).resolve().parents[2] / "cpp" / "include"


def compiled(source: Path, folder: Path) -> Path:
    """Compile one source, C or C++, to a program in a folder.

    Raises:
        RuntimeError: there is no compiler.
    """
    is_cpp = source.suffix == ".cpp"
    compiler = shutil.which("g++" if is_cpp else "gcc") or shutil.which("c++" if is_cpp else "cc")
    if compiler is None:
        raise RuntimeError(f"no compiler to compile {source.name} with; install {'g++' if is_cpp else 'gcc'}")
    more = ["-std=c++17", "-I", str(_CPP)] if is_cpp else []
    program = folder / source.stem
    subprocess.run([compiler, "-O2", *more, "-pthread", "-o", str(program), str(source), "-lm"], check=True)
    return program


def library(source: Path, folder: Path) -> ctypes.CDLL:
    """Compile one source in C to functions that this process calls.

    Raises:
        RuntimeError: there is no compiler.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise RuntimeError(f"no compiler to compile {source.name} with; install gcc")
    made = folder / f"{source.stem}.so"
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", "-o", str(made), str(source)], check=True)
    return ctypes.CDLL(str(made))
