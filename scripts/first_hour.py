"""Do what a newcomer does, in an empty home, and time each step: clone, `make demo`, README, tutorial, the wheel.

    python3 scripts/first_hour.py                    everything
    python3 scripts/first_hour.py --only clone,demo  some steps
    python3 scripts/first_hour.py --pythons 3.11     the wheel with these versions of Python only

Everything is in a temporary folder: a fresh clone of the last commit, a fresh HOME, no inherited PYTHONPATH or virtual
environment, no cache of pip. Compilers and other packages of the system are those of this machine; `apt` on an empty
Debian is not timed. It needs the network, and nothing but Python's standard library.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
VERSIONS = ("3.10", "3.11", "3.12", "3.13")
#: Where a version of Python may be, besides the PATH.
PLACES = ("~/.pyenv/versions/{}.*/bin/python", "~/.local/share/uv/python/cpython-{}*/bin/python")
#: The environment that a newcomer has as well: the network's, and where the system's programs are.
KEPT = ("PATH", "LANG", "TERM", "http_proxy", "https_proxy", "no_proxy", "PIP_INDEX_URL", "SSL_CERT_FILE")
#: Longest duration of a step [s].
PATIENCE = 900.0
TUTORIAL = "docs/tutorial/first-ten-minutes.md"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.S | re.M)


@dataclass(frozen=True)
class Step:
    """A step of a newcomer."""

    name: str
    title: str
    run: Callable[[], str]


@dataclass(frozen=True)
class Timed:
    """How a step ended."""

    title: str
    seconds: float
    outcome: str
    failed: bool = False


class Newcomer:
    """A person with an empty home.

    Args:
        folder: an empty folder.
        pythons: versions of Python to try the wheel with.
    """

    def __init__(self, folder: Path, pythons: tuple[str, ...]) -> None:
        self.home, self.clone = folder / "home", folder / "heptarm"
        self.wheels = folder / "wheels"
        self._folder, self._pythons = folder, pythons
        self.home.mkdir()

    def steps(self) -> Iterator[Step]:
        """What the README and the tutorial say, in their order."""
        yield Step("clone", "git clone", self._clone)
        yield Step("demo", "make demo", lambda: self._last("make", "demo"))
        yield Step("readme", "README: ten lines", lambda: self._page("README.md"))
        yield Step("tutorial", "tutorial: all snippets", lambda: self._page(TUTORIAL))
        yield Step("wheel", "make wheel", self._wheel)
        for version in self._pythons:
            install = f"Python {version}: pip install heptarm[sim]"
            yield Step("install", install, partial(self._install, version))
            yield Step("install", f"Python {version}: heptarm demo", partial(self._demo, version))

    def _run(self, *command: str | Path, cwd: Path | None = None) -> str:
        environment = {name: os.environ[name] for name in KEPT if name in os.environ}
        environment |= {"HOME": str(self.home), "PIP_NO_CACHE_DIR": "1"}
        done = subprocess.run(
            [str(one) for one in command],
            cwd=self.clone if cwd is None else cwd,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        if done.returncode:
            raise RuntimeError((done.stderr.strip() or done.stdout.strip())[-2000:])
        return done.stdout

    def _last(self, *command: str | Path, cwd: Path | None = None) -> str:
        lines = [line.strip() for line in self._run(*command, cwd=cwd).splitlines() if line.strip()]
        return lines[-1] if lines else ""

    def _clone(self) -> str:
        self._run("git", "clone", "-q", f"file://{ROOT}", self.clone, cwd=self._folder)
        return self._last("git", "log", "-1", "--format=%h %s")

    def _page(self, name: str) -> str:
        blocks = BLOCK.findall((self.clone / name).read_text(encoding="utf-8"))
        program = self._folder / "page.py"
        program.write_text("\n".join(blocks), encoding="utf-8")
        return (
            f"{len(blocks)} snippets; {self._last(self.clone / '.venv/bin/python', program, cwd=self.home)}"
        )

    def _wheel(self) -> str:
        self._run("make", "wheel")
        shutil.copytree(self.clone / "dist", self.wheels)
        (wheel,) = self.wheels.glob("heptarm-*.whl")
        return f"{wheel.name}, {wheel.stat().st_size // 1024} KiB"

    def _venv(self, version: str) -> Path:
        return self._folder / f"python-{version}"

    def _install(self, version: str) -> str:
        python = python_of(version)
        if python is None:
            raise LookupError("not on this machine")
        (wheel,) = self.wheels.glob("heptarm-*.whl")
        self._run(python, "-m", "venv", self._venv(version), cwd=self.home)
        self._run(
            self._venv(version) / "bin/python", "-m", "pip", "install", "-q", f"{wheel}[sim]", cwd=self.home
        )
        return self._last(self._venv(version) / "bin/python", "--version", cwd=self.home)

    def _demo(self, version: str) -> str:
        command = self._venv(version) / "bin/heptarm"
        if not command.exists():
            raise LookupError("not installed")
        return self._last(command, "demo", cwd=self.home)


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


def timed(step: Step) -> Timed:
    """Take a step."""
    began = time.monotonic()
    try:
        outcome, failed = step.run(), False
    except LookupError as error:
        outcome, failed = f"left out: {error.args[0]}", False
    except (RuntimeError, subprocess.TimeoutExpired, ValueError, OSError) as error:
        outcome, failed = str(error), True
    return Timed(step.title, time.monotonic() - began, outcome, failed)


def main() -> int:
    """Take all steps and print a table; a failure ends them."""
    parser = argparse.ArgumentParser(description="Do and time what a newcomer does, in an empty home.")
    names = "clone, demo, readme, tutorial, wheel, install"
    parser.add_argument("--only", default="", help=f"steps, separated by commas, of {names}")
    parser.add_argument(
        "--pythons", nargs="*", default=list(VERSIONS), help="versions of Python for the wheel"
    )
    arguments = parser.parse_args()
    chosen = {part for part in arguments.only.split(",") if part}
    results: list[Timed] = []
    with tempfile.TemporaryDirectory(prefix="heptarm-first-hour-") as folder:
        for step in Newcomer(Path(folder), tuple(arguments.pythons)).steps():
            if chosen and step.name not in chosen:
                continue
            results.append(timed(step))
            last = results[-1]
            print(f"{last.seconds:7.1f} s  {last.title:42}  {last.outcome.strip()[:110]}", flush=True)
            if last.failed:
                print(last.outcome, file=sys.stderr)
                return 1
    print(f"{sum(result.seconds for result in results):7.1f} s  in all")
    return 0


if __name__ == "__main__":
    sys.exit(main())
