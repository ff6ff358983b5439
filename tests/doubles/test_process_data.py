"""Process data of a project file and of the command line; no JVM is needed."""

from __future__ import annotations

from pathlib import Path

import pytest

from heptarm import _resources
from heptarm.sim.runtime import cabinet, project

PROJECT = _resources.cabinet_sources() / "project" / "RoboticsAPI.data.xml"


def test_our_own_project_file_is_understood() -> None:
    data = project.read_process_data(PROJECT)
    assert data["heptarm.port"] == 30001
    assert data["heptarm.max_rate"] == 500.0
    assert data["heptarm.key"] == ""
    assert isinstance(data["heptarm.verbosity"], int)


def test_the_command_line_overrides_and_keeps_the_types() -> None:
    options = cabinet.arguments(
        ["--project", str(PROJECT), "--port", "0", "--data", "heptarm.max_rate=50", "--data", "mine=a=b"]
    )
    data = cabinet.process_data(options)
    assert data["heptarm.port"] == 0
    assert data["heptarm.bind"] == "127.0.0.1"
    assert data["heptarm.max_rate"] == 50.0
    assert data["mine"] == "a=b"


@pytest.mark.parametrize("text", ["heptarm.port=abc", "heptarm.max_rate=fast", "nothing"])
def test_what_does_not_fit_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r".+"):
        cabinet.process_data(cabinet.arguments(["--data", text]))


@pytest.mark.parametrize(
    ("text", "expected_text"),
    [
        ("<a><processData id='x' dataType='java.lang.Integer' value='1.5'/></a>", "process data 'x'"),
        ("<a><processData id='x' dataType='java.lang.Boolean' value='yes'/></a>", "must be true or false"),
        ("<a><processData id='x' dataType='java.util.Date' value='1'/></a>", "java.util.Date"),
        ("no xml", "not a project file"),
    ],
)
def test_a_broken_project_file_is_refused(tmp_path: Path, text: str, expected_text: str) -> None:
    file = tmp_path / "data.xml"
    file.write_text(text)
    with pytest.raises(ValueError, match=expected_text):
        project.read_process_data(file)
