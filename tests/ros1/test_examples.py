"""Every example and every snippet of the guide runs unchanged, against the node and a virtual cabinet."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conformance.case import rests
from tests.conformance.stage import ROOT
from tests.retry import retry
from tests.ros1.peer import Client

#: Without those that need a scene: test_surface has the table, test_insert the peg and its hole.
EXAMPLES = sorted(
    path
    for path in (ROOT / "examples" / "ros1").iterdir()
    if path.suffix in (".py", ".sh") and path.name not in ("touch.py", "insert.py")
)
GUIDE = ROOT / "docs" / "guide" / "ros1.md"
BLOCK = re.compile(r"^```(python no-run|sh)\n(.*?)^```", re.S | re.M)


def run(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip() and "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


def run_python(script: Path, *arguments: str) -> str:
    """What a script prints. A busy node may send targets too late for the cabinet, which then stops the arm."""

    def late(said: object) -> str:
        return "servo targets came late" if "no target arrived" in str(said) else ""

    return retry(lambda: run([sys.executable, str(script), *arguments]), late)


def run_shell(script: Path) -> str:
    subprocess.run(["sh", "-n", str(script)], check=True)
    return run([sys.executable, "-m", "tests.ros1.shell", str(script)])


#: The command line of ROS, MoveIt's interface, which the surface has, and a topic that test_node follows.
IN_LONG_RUN = ("command_line.sh", "moveit_client.py", "servo.py")


@pytest.mark.parametrize(
    "example",
    [pytest.param(one, marks=[pytest.mark.long] if one.name in IN_LONG_RUN else []) for one in EXAMPLES],
    ids=lambda path: path.name,
)
def test_example(client: Client, example: Path) -> None:
    patience = ["60"] if example.name == "moveit_client.py" else []
    said = run_python(example, *patience) if example.suffix == ".py" else run_shell(example)
    rests(client)
    expected = {
        "command_line.sh": "ready",
        "move.py": "flange at",
        "trajectory.py": "code -2: unknown joint 'elbow'",
        "servo.py": "A5 was at",
        "moveit_client.py": "plan and execute: SUCCEEDED\nstop in mid-air:  PREEMPTED\nand home again:   SUCCEEDED",
    }
    assert expected[example.name] in said, said


@pytest.mark.long  # the same calls as in the examples
def test_the_guides_snippets(client: Client, tmp_path: Path) -> None:
    blocks = [match.groups() for match in BLOCK.finditer(GUIDE.read_text(encoding="utf-8"))]
    assert len(blocks) >= 4
    for kind, source in blocks:
        if kind == "sh" and not source.startswith(("rostopic", "rosservice", "rosparam")):
            continue  # set-up and launch: they have tests of their own
        script = tmp_path / ("snippet.sh" if kind == "sh" else "snippet.py")
        script.write_text(source, encoding="utf-8")
        if kind == "sh":
            run_shell(script)
        else:
            run([sys.executable, str(script)])
        rests(client)
