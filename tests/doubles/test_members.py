"""Members that few public applications use, and the injection of the robot by its name."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.doubles.test_doubles import HERE, _compile, _run

pytestmark = pytest.mark.computing  # a compiler, and a program whose clock is the simulator's
SOURCE = HERE / "java" / "Members.java"


@pytest.mark.long  # test_surface.py has every member by name
def test_members_that_few_applications_use(tmp_path: Path) -> None:
    _compile(SOURCE, tmp_path)
    said = tmp_path / "said.txt"
    done = _run("sample.Members", tmp_path, f"sample.file={said}")
    wanted = re.findall(r'say\("([^"]+)"', SOURCE.read_text())
    assert len(wanted) > 15
    assert sorted(said.read_text().splitlines()) == sorted(f"{one} = true" for one in wanted), (
        done.stdout + done.stderr
    )
    assert done.returncode == 0, done.stdout + done.stderr
    done = _run("sample.Members", tmp_path, f"sample.file={said}", more=("--model", "med7"))
    assert done.returncode != 0 and "the virtual cabinet's robot is LBR_Med_7_R800_1" in done.stdout
    assert "choose another robot with --model" in done.stdout
