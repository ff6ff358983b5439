"""Process data of a project file and of the command line; no JVM is needed."""

from __future__ import annotations

from pathlib import Path

import pytest

from heptarm import _resources
from heptarm.sim.runtime import cabinet, project

PROJECT = _resources.cabinet_sources() / "project" / "RoboticsAPI.data.xml"


def test_our_own_project_file_is_understood() -> None:
    data = project.read_process_data(PROJECT).values
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
    ("kind", "value", "expected_text"),
    [
        ("java.lang.Integer", "1.5", "an Integer must be a whole number, got '1.5'"),
        ("java.lang.Boolean", "yes", "a Boolean must be true or false, got 'yes'"),
        ("java.lang.Double", "1e999", "a Double must be a finite number, got '1e999'"),
        ("java.util.Date", "1", "got 'java.util.Date'"),
    ],
)
def test_a_value_that_cannot_be_read_harms_only_who_uses_it(
    tmp_path: Path, kind: str, value: str, expected_text: str
) -> None:
    file = tmp_path / "data.xml"
    good = "<processData id='y' dataType='java.lang.Integer' value='7'/>"
    file.write_text(f"<a><processData id='x' dataType='{kind}' value='{value}'/>{good}</a>")
    data = project.read_process_data(file)
    assert data.values == {"y": 7}
    assert expected_text in data.unusable["x"]
    assert "x" not in cabinet.process_data(cabinet.arguments(["--project", str(file)]))
    given = cabinet.process_data(cabinet.arguments(["--project", str(file), "--data", "x=3"]))
    assert given["x"] == "3" and given["y"] == 7


def test_a_file_that_is_no_project_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "data.xml"
    file.write_text("no xml")
    with pytest.raises(ValueError, match="not a project file"):
        project.read_process_data(file)


def test_additional_parameters_of_frames_are_read(tmp_path: Path) -> None:
    file = tmp_path / "data.xml"
    infos = (
        "<info key='PICK' type='java.lang.Integer' value='1'/>"
        "<info key='Comment' type='java.lang.String' value='left'/>"
        "<info key='LastModificationTime' type='java.lang.Long' value='1590078548421'/><info type='Teach'/>"
    )
    frame = f"<frame name='P1'><additionalInformation>{infos}</additionalInformation></frame>"
    file.write_text(f"<a><world><frame name='Table'><frames>{frame}</frames></frame></world></a>")
    assert project.read_project(file).parameters == (
        ("Table/P1", "PICK", 1),
        ("Table/P1", "Comment", "left"),
    )
