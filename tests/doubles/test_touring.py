"""Features that the other samples do not use: tasks, recordings, brake tests, geometry, a stop and its recovery."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import pytest

from heptarm.sim.runtime import project as templates
from tests.doubles.test_doubles import HERE, _command, _compile

SAID = (
    "a marked method was called",
    "one context, one robot",
    "the project's own class of tools",
    "a taught frame knows its arm",
    "nothing to recover from",
    "the cabinet runs applications",
    "a matrix turns",
    "a step in its own axes",
    "a step in the world's axes",
    "parts of a transformation",
    "near is a matter of degree",
    "one tree",
    "gripped where it is meant to be",
    "a frame is moved",
    "the robot of a context",
    "limits",
    "a closed safeguard",
    "mastered and referenced",
    "a measurement of torque referencing",
    "what there is not is refused",
    "inverse kinematics with redundancy",
    "out of reach",
    "home",
    "parameters can be printed",
    "there and back",
    "modes and servo motions",
    "hand guiding is no mode of a hold",
    "its older name",
    "an appended motion is awaited",
    "and was the last",
    "both can be printed",
    "cancelling takes the appended ones along",
    "a condition that holds already ends a motion",
    "blocked for a brake test",
    "the shoulder carries most",
    "a brake holds what the axis needs, but not anything",
    "a recording is there",
    "of every number",
    "from the trigger on",
    "every five milliseconds",
    "the lamp of the flange",
    "in a range",
    "a falling edge",
    "a background task counts beside us",
    "another is started and stopped",
    "its function goes with it",
    "and calls fail",
    "STOP ME",
    "the stop and its end were reported",
    "and the motion went on by itself",
    "PRESS ME",
    "the second half of a double key",
    "ASK ME",
    "a dialog",
    "disposed",
)

PROJECT = """<?xml version="1.0" encoding="UTF-8" standalone="no"?>
<RoboticsAPIData version="3">
  <world>
    <frame name="Table">
      <transformation a="0.0" b="0.0" c="0.0" x="500.0" y="0.0" z="100.0"/>
      <frame name="Corner">
        <transformation x="10.0" y="20.0"/>
        <redundancyData>
          <redundancy type="com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy">
            <info type="com.kuka.roboticsAPI.deviceModel.StatusTurnRedundancy$StatusParameter" value="2"/>
            <info type="com.kuka.roboticsAPI.deviceModel.StatusTurnRedundancy$TurnParameter" value="28"/>
            <info type="com.kuka.roboticsAPI.deviceModel.LBRE1Redundancy$E1Parameter" value="0.25"/>
          </redundancy>
        </redundancyData>
      </frame>
    </frame>
  </world>
  <objectTemplates>
    <toolTemplate class="sample.Pen" name="Gripper"><loadData mass="0.5"/></toolTemplate>
  </objectTemplates>
</RoboticsAPIData>
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    file = tmp_path / "RoboticsAPI.data.xml"
    file.write_text(PROJECT)
    return file


def _until(file: Path, line: str, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 100.0
    while line not in (file.read_text() if file.exists() else ""):
        assert process.poll() is None and time.monotonic() < deadline, f"{line!r} was not said"
        time.sleep(0.05)


def _do(words: str, process: subprocess.Popen[str]) -> str:
    assert process.stdin is not None and process.stdout is not None
    process.stdin.write(f"{words}\n")
    process.stdin.flush()
    return process.stdout.readline()


@pytest.mark.long  # test_surface.py has every member by name
def test_a_tour_through_sunrise(tmp_path: Path, project: Path) -> None:
    _compile(HERE / "java" / "Touring.java", tmp_path)
    said = tmp_path / "said.txt"
    command = _command("sample.Touring", tmp_path, f"sample.file={said}", f"recordings={tmp_path}", speed=1.0)
    command += ["--project", str(project), "--parent-pipe"]
    command += ["--background", "sample.Counting", "--background", "sample.Waiting"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and '"ready": true' in process.stdout.readline()
        _until(said, "STOP ME", process)
        assert '"error": ""' in _do("protective_stop", process)
        time.sleep(0.5)  # the arm stands for a while
        assert '"error": ""' in _do("clear", process)
        _until(said, "PRESS ME", process)
        assert '"error": ""' in _do("press 2 tour second", process)
        _until(said, "ASK ME", process)
        for _ in range(200):  # the dialog comes a moment later
            reply = _do("answer 1", process)
            if not reply or '"error": ""' in reply:  # none: the application ends with its last answer
                break
            time.sleep(0.05)
        assert process.wait(timeout=60) == 0
    assert said.read_text().splitlines() == [f"{one} = true" for one in SAID]
    assert (tmp_path / "touring.log").read_text().startswith("time jointPosition_A1 ")


def test_a_project_file_reports_classes_of_tools_and_arms_of_frames(project: Path) -> None:
    found = templates.read_project(project)
    assert [template.type for template in found.templates] == ["sample.Pen"]
    assert found.redundancies == (("Table/Corner", (0.25, 2, 28)),)
