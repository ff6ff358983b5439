"""The doubles offer the classes of Sunrise that applications of other people use; samples use each of them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from heptarm import _resources
from tests.doubles import surface
from tests.doubles.test_doubles import HERE, _compile

pytestmark = pytest.mark.computing
ROOT = Path(__file__).parents[2]
PARTS, _ = surface.read()
CLASSES = tuple(one for part in PARTS for one in part.classes)
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)


@pytest.fixture(scope="module")
def checker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("surface")
    _compile(HERE / "java" / "Surface.java", folder)
    return folder


def missing(lines: list[str], checker: Path) -> list[str]:
    """Members that the doubles do not offer."""
    path = ":".join(str(one) for one in (*_resources.jars(), checker))
    done = subprocess.run(
        ["java", "-cp", path, "sample.Surface"],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    return done.stdout.splitlines()


def test_every_class_and_member_of_the_list_is_there(checker: Path) -> None:
    lines = []
    for one in CLASSES:
        lines += [f"class {one.name}", *(f"extends {name}" for name in one.extends), *one.members]
    assert missing(lines, checker) == []


def test_what_is_not_there_is_noticed(checker: Path) -> None:
    lines = [
        "class com.kuka.roboticsAPI.Nothing",
        "class com.kuka.common.ThreadUtil",
        "static void milliSleep(String)",
        "void milliSleep(long)",
        "static double milliSleep(long)",
        "static void milliSleep(long)",
        "class com.kuka.roboticsAPI.deviceModel.JointEnum",
        "J1",
        "J13",
        "extends JointEnum",
        "extends String",
    ]
    assert missing(lines, checker) == [
        "com.kuka.roboticsAPI.Nothing",
        "com.kuka.common.ThreadUtil: static void milliSleep(String)",
        "com.kuka.common.ThreadUtil: void milliSleep(long)",
        "com.kuka.common.ThreadUtil: static double milliSleep(long)",
        "com.kuka.roboticsAPI.deviceModel.JointEnum: J13",
        "com.kuka.roboticsAPI.deviceModel.JointEnum: extends String",
    ]


def test_a_sample_that_a_test_runs_uses_each_class() -> None:
    samples = [
        *(file for file in (HERE / "java").glob("*.java") if file.name != "Surface.java"),
        *(ROOT / "examples" / "sunrise").rglob("*.java"),
        *(ROOT / "tests" / "strangers" / "labs" / "src").rglob("*.java"),
    ]
    used = set(re.findall(r"\w+", " ".join(COMMENT.sub("", file.read_text("utf-8")) for file in samples)))
    assert [one.name for one in CLASSES if one.simple not in used] == []


def test_the_page_is_the_lists() -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "sunrise_page.py"), "--check"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
