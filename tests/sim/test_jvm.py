"""Which Java the virtual cabinet takes from the PATH."""

from __future__ import annotations

from pathlib import Path

import pytest

from heptarm.sim.runtime import jvm


@pytest.mark.parametrize(
    ("release", "output", "is_taken"),
    [
        ('IMPLEMENTOR="Debian"\nJAVA_VERSION="17.0.21"\n', "", True),
        ('JAVA_VERSION="25.0.2"\n', "", True),
        ('JAVA_VERSION="11.0.2"\n', "", False),
        ('JAVA_VERSION="1.8.0_402"\n', "", False),
        (None, 'openjdk version "21.0.1"', True),
        (None, 'java version "1.8.0_402"', False),
        (None, "no Java at all", False),
    ],
    ids=["17", "25", "11", "8", "21 without a release file", "8 without a release file", "something else"],
)
def test_a_java_that_is_new_enough_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, release: str | None, output: str, is_taken: bool
) -> None:
    """Its own file states its version; where there is none, Java is asked."""
    java = tmp_path / "bin" / "java"
    java.parent.mkdir()
    java.write_text(f"#!/bin/sh\ncat >&2 <<END\n{output}\nEND\n" if output else "#!/bin/sh\nexit 1\n")
    java.chmod(0o755)
    if release is not None:
        (tmp_path / "release").write_text(release)
    monkeypatch.setenv("PATH", f"{java.parent}:/usr/bin:/bin")
    assert jvm._home_on_path() == (str(tmp_path.resolve()) if is_taken else None)
