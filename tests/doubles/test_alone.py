"""Programs on heptarm's core without a network, from motions to tools and signals."""

from __future__ import annotations

import re
from pathlib import Path

from tests.doubles.test_doubles import HERE, _compile, _run

SOURCE = HERE / "java" / "Alone.java"


def test_an_application_on_the_core_has_what_clients_have(tmp_path: Path) -> None:
    _compile(SOURCE, tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Alone", tmp_path, f"sample.file={said}")
    wanted = re.findall(r'say\("([^"]+)"', SOURCE.read_text())
    assert len(wanted) > 30
    assert said.read_text().splitlines() == [f"{one} = true" for one in wanted], done.stdout + done.stderr
    assert done.returncode == 0, done.stdout + done.stderr
