"""What the set-up fetches is checked: locked versions with SHA-256, a wrong file ends it, a missing one is said."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
LOCK = ROOT / "scripts/lock"
PYTHON = """#!/bin/sh
echo "$*" >>calls
case $* in
*torch.txt*) {torch} ;;
*dev.txt*) {locked} ;;
esac
"""
MISSING = "echo 'ERROR: No matching distribution found for x==1'; exit 1"
WRONG = "echo 'ERROR: THESE PACKAGES DO NOT MATCH THE HASHES FROM THE REQUIREMENTS FILE.'; exit 1"


def locked(name: str) -> dict[str, list[Requirement]]:
    """Packages of a lock file; each must have a version and a checksum."""
    found: dict[str, list[Requirement]] = {}
    text = re.sub(r"^\s*#.*\n", "", (LOCK / f"{name}.txt").read_text(encoding="utf-8"), flags=re.M)
    for entry in text.replace("\\\n", " ").splitlines():
        plain, _, hashes = entry.partition(" --hash=")
        assert re.fullmatch(r"(sha256:[0-9a-f]{64}( +--hash=)?)+", hashes.strip()), f"{name}.txt: {plain}"
        one = Requirement(plain)
        assert len(one.specifier) == 1 and str(one.specifier).startswith("=="), plain
        found.setdefault(canonicalize_name(one.name), []).append(one)
    return found


def project(extra: str) -> list[Requirement]:
    """Requirements of heptarm with an extra."""
    data = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = [Requirement(one) for one in data["dependencies"]]
    for text in data["optional-dependencies"][extra]:
        one = Requirement(text)
        found += [part for name in one.extras for part in project(name)] if one.name == "heptarm" else [one]
    return found


@pytest.mark.parametrize("name", sorted(file.stem for file in LOCK.glob("*.txt")))
def test_every_locked_package_has_a_version_and_checksums(name: str) -> None:
    assert locked(name)


def test_the_lock_file_agrees_with_the_project() -> None:
    versions = locked("dev")
    for one in project("dev"):
        if one.name == "torch" or (one.marker and not one.marker.evaluate({"sys_platform": "linux"})):
            continue
        pinned = [
            pin
            for pin in versions.get(canonicalize_name(one.name), [])
            if not pin.marker or pin.marker.evaluate()
        ]
        assert pinned, f"{one} is not in scripts/lock/dev.txt: make lock"
        (version,) = {str(pin.specifier).removeprefix("==") for pin in pinned}
        assert one.specifier.contains(version, prereleases=True), f"{one}, locked is {version}: make lock"


def test_the_extra_for_users_has_no_tools_of_developers() -> None:
    users, developers = ({one.name for one in project(extra)} for extra in ("all", "dev"))
    assert users < developers
    assert not users & {
        "pytest",
        "mypy",
        "ruff",
        "import-linter",
        "selenium",
        "build",
        "sphinx",
        "hypothesis",
    }


def test_scripts_fetch_nothing_but_packages() -> None:
    files = [
        ROOT / "Makefile",
        ROOT / ".ci/run",
        *(ROOT / "scripts").glob("*.*"),
        *(ROOT / "cabinet").glob("*.py"),
    ]
    for file in files:
        found = re.search(
            r"\b(curl|wget|urlopen|urlretrieve|requests\.get)\b", file.read_text(encoding="utf-8")
        )
        assert found is None, (
            f"{file.name} fetches by {found[0] if found else ''}: check a SHA-256, and list it here"
        )


# ------------------------------------------------------------------------------------ scripts/setup.sh


def set_up(
    folder: Path, *, torch: str = "", locked: str = "", extras: str = "dev"
) -> tuple[int, str, list[str]]:
    """Exit code, what is said, and the calls of pip, of a set-up in which pip is made up."""
    (folder / "scripts").mkdir()
    shutil.copy(ROOT / "scripts/setup.sh", folder / "scripts")
    python = folder / ".venv/bin/python"
    python.parent.mkdir(parents=True)
    python.write_text(PYTHON.format(torch=torch or ":", locked=locked or ":"))
    python.chmod(0o755)
    done = subprocess.run(
        ["sh", "scripts/setup.sh", extras],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=os.environ | {"PYTHON": sys.executable},
    )
    return done.returncode, done.stdout + done.stderr, (folder / "calls").read_text().splitlines()


posix = pytest.mark.skipif(sys.platform == "win32", reason="a shell script")


@posix
def test_locked_files_are_installed_with_their_checksums(tmp_path: Path) -> None:
    code, _, calls = set_up(tmp_path)
    assert code == 0
    assert all("--require-hashes --no-deps" in call for call in calls if ".txt" in call)
    assert any("dev.txt" in call for call in calls)
    assert "-m pip install -q --no-deps --no-build-isolation -e ." in calls
    assert "-m pip install -q -e .[dev]" not in calls


@posix
@pytest.mark.parametrize("which", ["torch", "locked"])
def test_a_file_with_another_content_ends_the_set_up(tmp_path: Path, which: str) -> None:
    code, said, calls = set_up(tmp_path, **{which: WRONG})
    assert code != 0 and "not the one that scripts/lock" in said
    assert not any(" -e " in call for call in calls), "it goes on without checksums"


@posix
def test_where_locked_files_are_not_to_be_had_it_reports_it_and_takes_others(tmp_path: Path) -> None:
    code, said, calls = set_up(tmp_path, locked=MISSING)
    assert code == 0 and "the newest are installed, without checksums" in said
    assert calls[-1] == "-m pip install -q -e .[dev]"


@posix
def test_another_build_of_torch_is_taken_and_all_the_rest_is_checked(tmp_path: Path) -> None:
    code, said, calls = set_up(tmp_path, torch=MISSING)
    assert code == 0 and "another build is installed, without a checksum" in said
    assert "-m pip install -q torch==2.13.0" in calls
    assert any("--require-hashes" in call and "dev.txt" in call for call in calls)
    assert "-m pip install -q -e .[dev]" not in calls


@posix
def test_a_smaller_set_up_is_not_locked(tmp_path: Path) -> None:
    code, said, calls = set_up(tmp_path, extras="sim,viz")
    assert code == 0 and not said and not any("lock" in call for call in calls)
