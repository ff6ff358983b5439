"""What runs in a fork is a process of its own, as if it had been started by itself."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import pytest

from tests import reaper
from tests.forks import Forks, Popen

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="forks are for Linux")
PROGRAM = """
import json, os, sys, decimal
said = {"name": __name__, "arguments": sys.argv[1:], "folder": os.getcwd(), "imported": "fractions" in sys.modules}
said |= {"parent": os.getppid(), "session": os.getsid(0) == os.getpid(), "word": os.environ.get("WORD")}
print(json.dumps(said | {"read": sys.stdin.readline()}), flush=True)
print("an error", file=sys.stderr)
sys.stdin.readline()
sys.exit(7)
"""


class Program(Popen):
    forks: ClassVar[dict[str, Forks]] = {"program_of_a_fork": Forks(("fractions",))}


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    for forks in Program.forks.values():
        forks.close()


def started(folder: Path, **variables: str) -> Popen:
    (folder / "program_of_a_fork.py").write_text(PROGRAM)
    pipe = subprocess.PIPE
    command = [sys.executable, "-m", "program_of_a_fork", "--with", "words"]
    return Program(
        command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, cwd=folder, start_new_session=True,
        env={**os.environ, **variables},
    )  # fmt: skip


def test_a_fork_is_a_process_of_its_own(tmp_path: Path) -> None:
    with started(tmp_path, WORD="Überlänge") as process:
        assert process.stdin is not None and process.stdout is not None and process.stderr is not None
        process.stdin.write("a line\n")
        process.stdin.flush()
        said = json.loads(process.stdout.readline())
        mark = os.environ[reaper.MARK].encode()
        shown = Path(f"/proc/{process.pid}/environ").read_bytes().split(b"\0")
        assert reaper.MARK.encode() + b"=" + mark in shown  # its owner is found, if it should be left behind
        line = Path(f"/proc/{process.pid}/cmdline").read_bytes().rstrip(b"\0").split(b"\0")
        assert line[1:] == [b"-m", b"program_of_a_fork", b"--with", b"words"]
        said_then, wrong = process.communicate("another\n", timeout=60.0)
    assert said == {
        "name": "__main__",
        "arguments": ["--with", "words"],
        "folder": str(tmp_path),
        "imported": True,
        "parent": os.getpid(),
        "session": True,
        "word": "Überlänge",
        "read": "a line\n",
    }
    assert (process.returncode, said_then, wrong) == (7, "", "an error\n")


def test_a_killed_fork_ends_alone(tmp_path: Path) -> None:
    with started(tmp_path) as first, started(tmp_path) as second:
        first.kill()
        assert first.wait(timeout=60.0) == -signal.SIGKILL
        assert second.poll() is None
        second.communicate("\n\n", timeout=60.0)
    assert second.returncode == 7


def test_with_other_variables_of_the_interpreter_it_is_started_by_itself(tmp_path: Path) -> None:
    with started(tmp_path, PYTHONUTF8="1") as process:
        said, _ = process.communicate("\n\n", timeout=60.0)
    assert json.loads(said)["imported"] is False
