"""`heptarm live`: to a file beside a running cabinet, and what cannot be shown."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli.running import objects, run
from tests.conftest import RunningCabinet

SPEED = 1.0  # a recording of so many seconds

pytestmark = pytest.mark.slow


def test_to_a_file_for_some_seconds(cabinet: RunningCabinet, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    file = tmp_path / "run.rrd"
    (done,) = objects("live", "--save", str(file), "--for", "3", "--target", cabinet.target)
    assert done["states"] > 10 and done["bytes"] == file.stat().st_size > 100_000
    refused = run("live", "--rerun", "--target", cabinet.target, DISPLAY="", WAYLAND_DISPLAY="")
    assert refused.returncode == 1 and refused.stderr.count("\n") == 1 and "--save FILE.rrd" in refused.stderr


def test_without_the_package_the_command_that_installs_it(tmp_path: Path) -> None:
    (tmp_path / "rerun.py").write_text(
        "raise ModuleNotFoundError(\"No module named 'rerun'\", name='rerun')\n"
    )
    paths = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = run("live", "--save", "x.rrd", "--target", "sim://127.0.0.1:1", PYTHONPATH=paths)
    assert done.returncode == 1 and done.stderr.strip().endswith("(pip install 'heptarm[rerun]')")
