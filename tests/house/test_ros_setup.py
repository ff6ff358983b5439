"""Setting up a ROS environment: missing wheels are reported, errors fail, and neither counts as done."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from scripts.ros1_interfaces import fallback

ROOT = Path(__file__).parents[2]
PIP = "#!/bin/sh\ncase $* in *pip*) echo '{said}'; exit {code} ;; *) exit 0 ;; esac\n"

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="there is no make")


def script(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The rule and the script of ROS 2, with everything else of the machine faked."""
    for name in ("Makefile", "scripts/setup_ros2.sh"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for name in ("scripts/ros2_interfaces.py", "scripts/ros2_requirements.txt", "build/stamps/demo"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    for name in ("ros1/interfaces", "ros2/interfaces", "ros2/heptarm_msgs"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("gcc", "g++"):
        script(tmp_path / "bin" / name, "#!/bin/sh\n")
    script(tmp_path / ".venv/bin/python", "#!/bin/sh\necho /bin/false\n")
    platform(tmp_path, "Linux", "x86_64")
    return tmp_path


def platform(folder: Path, system: str, machine: str) -> None:
    script(folder / "bin/uname", f"#!/bin/sh\n[ $1 = -s ] && echo {system} || echo {machine}\n")


def make(folder: Path) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        ["make", "-o", "build/stamps/demo", "build/stamps/ros2"],
        check=False,
        cwd=folder,
        env=os.environ | {"PATH": f"{folder / 'bin'}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert not (folder / "build/stamps/ros2").exists(), "it counts as done"
    return done


def test_another_platform_is_said_and_skipped(copy: Path) -> None:
    platform(copy, "Darwin", "arm64")
    done = make(copy)
    assert done.returncode == 0, done.stderr
    assert "no ROS 2 here: there are wheels for Linux on x86_64 only" in done.stdout
    assert not (copy / "build/ros2").exists()


def test_a_python_without_wheels_is_said_and_skipped(copy: Path) -> None:
    said = "ERROR: No matching distribution found for ros-kilted-rclpy"
    script(copy / "build/ros2/bin/python", PIP.format(said=said, code=1))
    done = make(copy)
    assert done.returncode == 0, done.stderr
    assert "no ROS 2 here: there are no wheels" in done.stdout
    assert not (copy / "build/ros2").exists()


@pytest.mark.parametrize(
    "said",
    [
        "WARNING: Retrying after connection broken by NewConnectionError; No matching distribution found for numpy",
        "ERROR: No space left on device",
    ],
)
def test_a_set_up_that_fails_fails(copy: Path, said: str) -> None:
    script(copy / "build/ros2/bin/python", PIP.format(said=said, code=1))
    done = make(copy)
    assert done.returncode != 0
    assert "setting up ROS 2 failed" in done.stderr and said in done.stderr


def test_interfaces_of_ours_never_hide_those_of_the_distribution(tmp_path: Path) -> None:
    """Debian's tf needs more of tf2_msgs than heptarm's part of it."""
    for folder, packages in (("ours", ("tf2_msgs", "control_msgs")), ("debian", ("tf2_msgs",))):
        for package in packages:
            (tmp_path / folder / package).mkdir(parents=True)
            (tmp_path / folder / package / "__init__.py").touch()
            (tmp_path / folder / package / "msg.py").write_text(f"whose = {folder!r}")
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "heptarm_interfaces.pth").write_text(fallback(tmp_path / "ours"))
    program = f"import site; site.addsitedir({str(tmp_path / 'site')!r})\n"
    program += "import control_msgs.msg, tf2_msgs.msg; print(control_msgs.msg.whose, tf2_msgs.msg.whose)"
    done = subprocess.run(
        [sys.executable, "-S", "-c", program],
        check=True,
        env={"PYTHONPATH": str(tmp_path / "debian")},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout == "ours debian\n"
