"""Tools, workpieces and templates of a Sunrise application, and of a project's file."""

from __future__ import annotations

from pathlib import Path

import pytest

from heptarm.sim.runtime import project as templates
from tests.doubles.test_doubles import HERE, _compile, _run

SAID = (
    "an injected tool has the template's load",
    "and its frames",
    "and its default motion frame",
    "each call makes another one",
    "an unknown template throws",
    "a tool that is nowhere cannot move",
    "what is not declared pulls",
    "and impedance control may not begin",
    "a tool takes its part",
    "with the workpiece nothing is felt",
    "and impedance control may begin",
    "the torque depends on where it is measured",
    "the tip is where it is",
    "a tool moves its default motion frame",
    "a frame moves itself",
    "the robot moves its flange",
    "the commanded pose knows the tool",
    "children are what is attached",
    "and can be detached one by one",
    "tools are changed",
    "a tool does not hold itself",
    "detachAll leaves nothing",
    "taught frames",
    "an unknown frame throws",
)

PROJECT = """<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<RoboticsAPIData version="3">
  <world>
    <frames>
      <frame name="Table">
        <transformation a="0.0" b="0.0" c="0.0" x="500.0" y="0.0" z="100.0"/>
        <frames><frame name="Corner"><transformation x="10.0" y="20.0"/></frame></frames>
      </frame>
    </frames>
  </world>
  <objectTemplates>
    <toolTemplate class="" defaultMotionFrameRef="/Tip" name="Gripper">
      <frames>
        <frame name="Tip">
          <transformation a="0.0" b="0.0" c="0.0" x="0.0" y="0.0" z="120.0"/>
          <frames><frame name="Point"><transformation x="5.0"/></frame></frames>
        </frame>
      </frames>
      <loadData cogA="0.0" cogB="0.0" cogC="0.0" cogX="0.0" cogY="0.0" cogZ="100.0"
                inertiaX="0.0" inertiaY="0.0" inertiaZ="0.0" mass="3.0"/>
    </toolTemplate>
    <workpieceTemplate class="" name="Cube"><loadData mass="0.2"/></workpieceTemplate>
  </objectTemplates>
  <processData dataType="java.lang.String" id="heptarm.tools" value="Gripper"/>
</RoboticsAPIData>
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    file = tmp_path / "RoboticsAPI.data.xml"
    file.write_text(PROJECT)
    return file


def test_tools_as_a_sunrise_application_uses_them(tmp_path: Path, project: Path) -> None:
    _compile(HERE / "java" / "Gripping.java", tmp_path)
    said = tmp_path / "said.txt"
    done = _run(
        "sample.Gripping", tmp_path, f"sample.file={said}", project=project, more=("--payload", "4,0,0,0.1")
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert said.read_text().splitlines() == [f"{one} = true" for one in SAID]


LIFTED = (
    "a safety workpiece is lifted",
    "what is too heavy is refused",
    "and the one before is still counted",
    "the stop comes with the motion",
    "the arm is stopped",
)


def test_an_application_that_forgets_the_safety_workpiece_is_stopped(tmp_path: Path) -> None:
    """It sets none while it holds one, or puts it down and leaves it set."""
    _compile(HERE / "java" / "Lifting.java", tmp_path)
    said = tmp_path / "said.txt"
    for forgotten in ("to count", "to reset"):
        data = (f"sample.file={said}", f"sample.forgotten={forgotten}")
        done = _run("sample.Lifting", tmp_path, *data, more=("--safety", "12,5"))
        assert done.returncode == 0, done.stdout + done.stderr
        assert said.read_text().splitlines() == [f"{one} = true" for one in LIFTED], forgotten
        assert "external torque of A" in done.stderr


def test_a_project_file_reports_its_tools_and_places(project: Path) -> None:
    found = templates.read_project(project)
    gripper, cube = found.templates
    assert (gripper.name, gripper.is_tool, gripper.mass, gripper.moved) == ("Gripper", True, 3.0, "Tip")
    assert gripper.centre == (0.0, 0.0, 100.0, 0.0, 0.0, 0.0)
    assert [path for path, _ in gripper.frames] == ["Tip", "Tip/Point"]
    assert (cube.is_tool, cube.mass, cube.frames) == (False, 0.2, ())
    assert [path for path, _ in found.frames] == ["Table", "Table/Corner"]


@pytest.mark.parametrize(
    ("text", "expected_text"),
    [
        ("no xml", "not a project file"),
        (PROJECT.replace("120.0", "high"), "transformation z must be a finite number, got 'high'"),
    ],
)
def test_a_broken_project_is_refused(tmp_path: Path, text: str, expected_text: str) -> None:
    file = tmp_path / "data.xml"
    file.write_text(text)
    with pytest.raises(ValueError, match=expected_text):
        templates.read_project(file)
