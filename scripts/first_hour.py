"""Do what a newcomer does, in an empty home, and time each step: clone, `make demo`, README, tutorial, the wheel.

    python3 scripts/first_hour.py                    everything
    python3 scripts/first_hour.py --only clone,demo  some steps
    python3 scripts/first_hour.py --pythons 3.11     the wheel with these versions of Python only

`apt` on an empty Debian is not timed. It needs the network, and nothing but Python's standard library.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from scripts.newcomer import Newcomer, Step, take

VERSIONS = ("3.10", "3.11", "3.12", "3.13")
#: Where a version of Python may be, besides the PATH.
PLACES = ("~/.pyenv/versions/{}.*/bin/python", "~/.local/share/uv/python/cpython-{}*/bin/python")
TUTORIAL = "docs/tutorial/first-ten-minutes.md"


class FirstHour:
    """The first hour of a newcomer.

    Args:
        folder: an empty folder.
        pythons: versions of Python to try the wheel with.
    """

    def __init__(self, folder: Path, pythons: tuple[str, ...]) -> None:
        self._newcomer = Newcomer(folder)
        self._folder, self._pythons, self._wheels = folder, pythons, folder / "wheels"

    def steps(self) -> Iterator[Step]:
        """What the README and the tutorial say, in their order."""
        newcomer = self._newcomer
        yield Step("clone", "git clone", newcomer.get)
        yield Step("demo", "make demo", lambda: newcomer.last("make", "demo"))
        yield Step("readme", "README: ten lines", lambda: newcomer.type_in("README.md"))
        yield Step("tutorial", "tutorial: all snippets", lambda: newcomer.type_in(TUTORIAL))
        yield Step("wheel", "make wheel", self._wheel)
        for version in self._pythons:
            install = f"Python {version}: pip install heptarm[sim]"
            yield Step("install", install, partial(self._install, version))
            yield Step("install", f"Python {version}: heptarm demo", partial(self._demo, version))

    def _wheel(self) -> str:
        self._newcomer.run("make", "wheel")
        shutil.copytree(self._newcomer.clone / "dist", self._wheels)
        (wheel,) = self._wheels.glob("heptarm-*.whl")
        return f"{wheel.name}, {wheel.stat().st_size // 1024} KiB"

    def _venv(self, version: str) -> Path:
        return self._folder / f"python-{version}"

    def _install(self, version: str) -> str:
        python = python_of(version)
        if python is None:
            raise LookupError("not on this machine")
        (wheel,) = self._wheels.glob("heptarm-*.whl")
        newcomer, own = self._newcomer, self._venv(version) / "bin/python"
        newcomer.run(python, "-m", "venv", self._venv(version), cwd=newcomer.home)
        newcomer.run(own, "-m", "pip", "install", "-q", f"{wheel}[sim]", cwd=newcomer.home)
        return newcomer.last(own, "--version", cwd=newcomer.home)

    def _demo(self, version: str) -> str:
        command = self._venv(version) / "bin/heptarm"
        if not command.exists():
            raise LookupError("not installed")
        return self._newcomer.last(command, "demo", cwd=self._newcomer.home)


def python_of(version: str) -> str | None:
    """A working Python of a version; None: this machine has none."""
    found = [shutil.which(f"python{version}")]
    for place in PLACES:
        path = Path(place.format(version)).expanduser()
        found += [str(one) for one in sorted(Path(path.anchor).glob(str(path.relative_to(path.anchor))))]
    for candidate in filter(None, found):
        test = f"import sys; sys.exit(sys.version_info[:2] != {tuple(map(int, version.split('.')))})"
        if subprocess.run([candidate, "-c", test], capture_output=True, check=False).returncode == 0:
            return candidate
    return None


def main() -> int:
    """Take all steps and print a table; a failure ends them."""
    parser = argparse.ArgumentParser(description="Do and time what a newcomer does, in an empty home.")
    names = "clone, demo, readme, tutorial, wheel, install"
    parser.add_argument("--only", default="", help=f"steps, separated by commas, of {names}")
    parser.add_argument(
        "--pythons", nargs="*", default=list(VERSIONS), help="versions of Python for the wheel"
    )
    arguments = parser.parse_args()
    return take(lambda folder: FirstHour(folder, tuple(arguments.pythons)).steps(), arguments.only)


if __name__ == "__main__":
    sys.exit(main())
