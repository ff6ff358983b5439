"""The classes of libiiwa and iiwaPy3, unchanged, drive heptarm's cabinet by the programs of examples/bridges.

Neither is on PyPI, and nothing of them is in this repository: LIBIIWA and IIWAPY3 name the folders of clones.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from heptarm import Arm
from heptarm.bridge.kst import serve_kst
from heptarm.bridge.libiiwa import serve_libiiwa

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "bridges"
PATIENCE = 240.0
#: libiiwa's module uses a name that NumPy 2 has dropped.
RUNNER = """
import runpy, sys
import numpy
numpy.NaN = numpy.nan
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
"""

pytestmark = pytest.mark.long


def clone(variable: str, below: str) -> str:
    folder = os.environ.get(variable)
    if not folder:
        pytest.skip(f"{variable} names no clone: its classes are not tested")
    return str(Path(folder) / below)


@contextmanager
def serving(serve: Callable[..., None], arm: Arm, **where: object) -> Iterator[None]:
    ended = threading.Event()
    thread = threading.Thread(target=serve, args=(arm,), kwargs={"ended": ended, **where})
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(PATIENCE)


def drive(example: str, path: str, *arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", RUNNER, str(EXAMPLES / example), *arguments],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    off = {what: float(value) for what, value in re.findall(r"(joints|line|stream): (\S+) m", done.stdout)}
    assert set(off) == {"joints", "line", "stream"}, done.stdout
    assert max(off.values()) < 1.0, off  # mrad, mm


def test_libiiwa(arm: Arm) -> None:
    path = clone("LIBIIWA", "libiiwa")
    with serving(serve_libiiwa, arm):
        drive("libiiwa_moves.py", path)


def test_iiwapy3(arm: Arm) -> None:
    path = clone("IIWAPY3", "")
    with serving(serve_kst, arm, host="127.0.0.9"):  # its port is fixed
        drive("iiwapy3_moves.py", path, "127.0.0.9")
