"""The examples and the guide's commands and snippets run unchanged, against a node and a virtual arm."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conformance.stage import ROOT
from tests.long import longer
from tests.retry import retry
from tests.ros2 import shell
from tests.ros2.peer import Client

#: Without those that need a scene: test_surface has the table, test_insert the peg and its hole.
SCRIPTS = sorted(
    path for path in (ROOT / "examples" / "ros2").glob("*.py") if path.name not in ("touch.py", "insert.py")
)
GUIDE = (ROOT / "docs" / "guide" / "ros2.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w+)[^\n]*\n(.*?)^```", re.S | re.M)
SNIPPETS = [body for kind, body in BLOCK.findall(GUIDE) if kind == "python"]


def run(command: list[str]) -> str:
    """What a program prints. On a busy machine targets or states may come so late that the arm stops."""

    def late(done: object) -> str:
        if "no target arrived" in str(done):
            return "servo targets came late"
        return "states came late" if "the newest state is" in str(done) else ""

    done = retry(
        lambda: subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, cwd=ROOT),
        late,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


#: MoveIt's interface, which test_moveit has, and a topic that test_node follows.
IN_LONG_RUN = ("moveit_client.py", "servo.py")


@pytest.mark.parametrize(
    "script",
    [pytest.param(one, marks=[pytest.mark.long] if one.name in IN_LONG_RUN else []) for one in SCRIPTS],
    ids=lambda path: path.name,
)
def test_script(client: Client, script: Path) -> None:
    said = run([sys.executable, str(script), *(["60"] if script.name == "moveit_client.py" else [])])
    assert said.strip()
    if script.name == "moveit_client.py":
        assert [line.split()[-1] for line in said.splitlines()] == ["SUCCEEDED", "PREEMPTED", "SUCCEEDED"]
    if script.name == "trajectory.py":
        assert "code 0" in said and "rejected" in said


@pytest.mark.parametrize("number", range(longer(1, len(SNIPPETS))))
def test_snippet_of_the_guide(client: Client, number: int) -> None:
    run([sys.executable, "-c", SNIPPETS[number]])


def test_the_command_line(client: Client) -> None:
    said = shell.run(client.ros, (ROOT / "examples" / "ros2" / "command_line.sh").read_text())
    assert len(said) == 6 and "error_code=0" in said[3]


@pytest.mark.long  # the same kinds as in the example's file
def test_the_commands_of_the_guide(client: Client) -> None:
    blocks = [body for kind, body in BLOCK.findall(GUIDE) if kind == "sh" and "ros2 launch" not in body]
    assert len(shell.run(client.ros, "".join(blocks))) == 28
