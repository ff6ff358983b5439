"""Programs in processes of their own, to be interrupted, frozen and killed."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path
from typing import IO

from tests.interrupts import ctrl_c_interrupts

PROGRAM = """
    import sys, heptarm as ha
    from heptarm import deg, ptp
    arm = ha.connect(sys.argv[1], name="script", on_disconnect=sys.argv[2], watchdog=float(sys.argv[3]))
    arm.move(ptp(deg(0, 30, 0, -90, 0, 60, 0)))
    handle = arm.start(ptp(deg(60, 30, 0, -90, 0, 60, 0), speed=0.2))
    arm.wait_until(lambda s: abs(s.dq).max() > 0.1)
    try:
        print(arm.connection.cabinet.pid if arm.connection.cabinet else "moving", flush=True)
        handle.wait()
        print("arrived", flush=True)
    except KeyboardInterrupt:
        print("interrupted at", arm.wait_for_rest().q[0], flush=True)
        raise
"""


def script(
    tmp_path: Path, target: str, on_disconnect: str = "stop", *, watchdog: float = 10.0
) -> tuple[subprocess.Popen[str], str]:
    """A separate program in the middle of a motion, and its output."""
    file = tmp_path / "program.py"
    file.write_text(textwrap.dedent(PROGRAM))
    command = [sys.executable, str(file), target, on_disconnect, str(watchdog)]
    with ctrl_c_interrupts():
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return process, line(process.stdout)


def line(stream: IO[str] | None) -> str:
    assert stream is not None
    return stream.readline().strip()


def end(process: subprocess.Popen[str]) -> tuple[str, str]:
    out, errors = process.communicate(timeout=60.0)
    return out, errors
