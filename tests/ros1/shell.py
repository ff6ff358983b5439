"""Runs the `rostopic`, `rosservice` and `rosparam` commands of a script with ROS' own code, in order.

    python -m tests.ros1.shell SCRIPT

Every command is a process of its own, but forked from one that has imported what they are made of: that takes most of a
command's time, and a busy machine's patience. Lines of other commands are left out.
"""

from __future__ import annotations

import os
import shlex
import sys
import traceback
from collections.abc import Iterator
from pathlib import Path

import rosparam
import rosservice
import rostopic

TOOLS = {
    "rostopic": rostopic.rostopicmain,
    "rosservice": rosservice.rosservicemain,
    "rosparam": rosparam.yamlmain,
}


def commands(script: str) -> Iterator[list[str]]:
    """The commands of the tools; inside quotes they may span lines."""
    command = ""
    for line in script.splitlines():
        if command or line.split(" ")[0] in TOOLS:
            command += line + "\n"
            if command.count('"') % 2 == 0:
                yield shlex.split(command)
                command = ""


def run(words: list[str]) -> int:
    """Run a command; returns its exit code."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code: object = 1
        try:
            TOOLS[words[0]](words)
            code = 0
        except SystemExit as end:
            code = end.code
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            os._exit(0 if code is None else code if isinstance(code, int) else 1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


if __name__ == "__main__":
    for one in commands(Path(sys.argv[1]).read_text(encoding="utf-8")):
        print("$", *one, flush=True)
        if run(one):
            sys.exit(f"{one} failed")
