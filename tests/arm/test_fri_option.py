"""A cabinet without the options for FRI and hand guiding refuses them with a text; everything else works."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import heptarm
from heptarm._resources import cabinet_sources

PROGRAM = """
import heptarm as ha
from heptarm.wire import messages as wire

with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
    assert "hold" in arm.capabilities and not [c for c in arm.capabilities if c.startswith("fri")]
    for ask in (
        lambda: arm.fri("position"),
        lambda: arm.connection.request(
            wire.FriOpen(host="127.0.0.1", period=0.01, command=wire.FriCommandMode.MONITOR)
        ),
    ):
        try:
            ask()
            raise SystemExit("accepted")
        except ha.CommandRejected as error:
            assert error.code == 40 and "Sunrise.FRI" in str(error), error
    assert "hand_guide" not in arm.capabilities
    try:
        arm.start(ha.hand_guide())
        raise SystemExit("accepted")
    except ha.CommandRejected as error:
        assert error.code == 40 and "hand guiding is not installed" in str(error), error
    arm.move(ha.hold(0.1))
print("done")
"""
OPTIONS = ("fastRobotInterface", "HandGuidingMotion")


@pytest.mark.slow
def test_a_cabinet_without_the_option_does_all_the_rest(tmp_path: Path) -> None:
    package = tmp_path / "heptarm"
    shutil.copytree(Path(heptarm.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(cabinet_sources() / "project", package / "_cabinet" / "project")  # as a wheel has them
    shutil.copytree(cabinet_sources() / "core" / "src", package / "_cabinet" / "core" / "src")
    (jar,) = package.glob("sim/jars/*doubles*.jar")
    with zipfile.ZipFile(jar) as old:
        kept = {
            name: old.read(name) for name in old.namelist() if not any(option in name for option in OPTIONS)
        }
        assert len(kept) < len(old.namelist())
    with zipfile.ZipFile(jar, "w") as new:
        for name, content in kept.items():
            new.writestr(name, content)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.stdout == "done\n", done.stderr
