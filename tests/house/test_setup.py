"""The set-up without the tools that compile the cabinet."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "cabinet"), str(ROOT / "scripts")]

import toolchain  # noqa: E402
from scripts import setup_jdk  # noqa: E402


@pytest.fixture
def no_jdk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(toolchain, "_homes", list)


@pytest.mark.usefixtures("no_jdk")
def test_without_root_it_stops_with_the_command_to_type(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert setup_jdk.main() == 1
    said = capsys.readouterr().err
    assert "apt-get install -y --no-install-recommends openjdk-17-jdk-headless ecj" in said


@pytest.mark.usefixtures("no_jdk")
def test_as_root_on_debian_it_installs_once(monkeypatch: pytest.MonkeyPatch) -> None:
    installed: list[bool] = []
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(shutil, "which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(setup_jdk, "_install", lambda: installed.append(True))
    assert setup_jdk.main() == 1
    assert installed == [True]


def test_missing_eclipse_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(toolchain, "_ECJ_JARS", ())
    monkeypatch.delenv("ECJ_JAR", raising=False)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(toolchain.ToolMissing, match="ecj"):
        toolchain.find_ecj(toolchain.Jdk(ROOT))
