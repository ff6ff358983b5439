"""The schema's scripts, importable; and the Java codec as a function."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "schema"))

Bodies = Sequence[tuple[int, bytes]]


@pytest.fixture(scope="session")
def recode(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Bodies], list[str]]:
    """Result of the Java codec for bodies: each encoded again and validated, or "undecodable", or "unknown"."""
    from heptarm import _resources

    if shutil.which("javac") is None:
        pytest.skip("no javac here")
    classes = tmp_path_factory.mktemp("recode")
    classpath = os.pathsep.join([str(_resources.jars()[0]), str(classes)])
    source = Path(__file__).parent / "java" / "Recode.java"
    javac = ["javac", "-J-XX:TieredStopAtLevel=1", "-J-XX:+UseSerialGC", "-proc:none"]
    subprocess.run([*javac, "-cp", classpath, "-d", str(classes), str(source)], check=True)

    def run(bodies: Bodies) -> list[str]:
        lines = "".join(f"{number} {body.hex()}\n" for number, body in bodies)
        command = ["java", "-XX:TieredStopAtLevel=1", "-cp", classpath, "Recode"]
        done = subprocess.run(command, input=lines, capture_output=True, text=True, timeout=120, check=True)
        return done.stdout.splitlines()

    return run
