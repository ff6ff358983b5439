"""Programs in C++, alone or with the native parts, which are compiled as cpp/CMakeLists.txt does."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INCLUDES = [f"-I{ROOT / one}" for one in ("cpp/include", "native", "src/heptarm/fri/loop/include")]
FLAGS = ("-std=c++17", "-O0", "-Wall", "-Wextra", "-Wshadow", "-Werror", "-pthread")
PATIENCE = 240.0
#: All of them, as the file of CMake lists them.
PARTS = (
    re.findall(r"foreach\(part (.*)\)", (ROOT / "cpp/CMakeLists.txt").read_text(encoding="utf-8"))[0]
).split()


def objects(folder: Path, parts: Iterable[str] = PARTS) -> list[str]:
    """Compile these parts into a folder."""
    compiler = shutil.which("gcc")
    if compiler is None or shutil.which("g++") is None:
        pytest.skip("no gcc and g++ here: native parts of C++ clients are not tested")
    sources = [str(ROOT / "native" / f"{part}.c") for part in parts]
    command = [compiler, "-std=c11", "-O1", "-D_GNU_SOURCE", *INCLUDES, "-c", *sources]
    subprocess.run(command, cwd=folder, check=True, timeout=PATIENCE)
    return [str(one) for one in folder.glob("*.o")]


def compiled(source: Path, folder: Path, *flags: str, parts: Sequence[str] = ()) -> Path:
    """Compile a program, and link it with what `objects` made; a client without native parts needs one folder."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler here: the C++ client is not tested")
    program = folder / source.stem
    includes = INCLUDES if parts else INCLUDES[:1]
    command = [compiler, *FLAGS, *flags, *includes, "-o", str(program), str(source), *parts, "-lm"]
    subprocess.run(command, check=True, timeout=800)
    return program
