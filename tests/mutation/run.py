"""Tries mutants: which of them do the fast tests of their package notice?"""

from __future__ import annotations

import argparse
import compileall
import os
import queue
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.mutation.mutants import Mutant, drawn, mutants

ROOT = Path(__file__).resolve().parents[2]
#: Mutants of a run, and how many of a hundred the tests have to catch.
COUNT, LEAST = 100, 90
#: A mutant that takes so much longer than the tests without it hangs, and is caught.
HANGS, AND_MORE = 5.0, 30.0


@dataclass(frozen=True, slots=True)
class Package:
    """A part of the core, and the tests that have to notice when it is wrong.

    Attributes:
        name: of the part.
        folders: of its sources; generated files in them do not count.
        tests: files and folders; what is slow in them does not run.
    """

    name: str
    folders: tuple[str, ...]
    tests: tuple[str, ...]


_GENERATED = {"messages.py", "codes.py", "seam.py"}
PACKAGES = (
    Package(
        "wire",
        ("src/heptarm/wire",),
        ("tests/wire", "tests/schema/test_golden.py", "tests/transports/test_transports.py"),
    ),
    Package("values", ("src/heptarm/values",), ("tests/values", "tests/arm/test_program.py")),
    Package(
        "planning",
        ("src/heptarm/planning",),
        (
            *("tests/sim/test_table.py", "tests/sim/test_spline.py", "tests/sim/test_circ.py"),
            *("tests/sim/test_lookahead.py", "tests/sim/test_straight.py", "tests/sim/test_motions.py"),
            "tests/sim/test_geometry.py",
        ),
    ),
    Package(
        "guard",
        ("src/heptarm/fri/guard",),
        (
            *("tests/fri/test_guard.py", "tests/fri/test_pose_guard.py", "tests/fri/test_policy.py"),
            "tests/laws/test_torque_guard.py",
        ),
    ),
    Package(
        "session", ("src/heptarm/fri/session",), ("tests/fri/test_statistics.py", "tests/fri/test_session.py")
    ),
    Package("model", ("src/heptarm/model",), ("tests/model",)),
    Package(
        "motion",
        ("src/heptarm/arm/motion",),
        (
            *("tests/arm/test_program.py", "tests/arm/test_requests.py", "tests/arm/test_recovery.py"),
            *("tests/arm/test_time_limit.py", "tests/arm/test_states_of_motion.py", "tests/arm/test_plan.py"),
            *("tests/arm/test_callbacks.py", "tests/arm/test_moving.py", "tests/arm/test_servo.py"),
            *("tests/arm/test_jog.py", "tests/arm/test_keep_clear.py"),
        ),
    ),
)


def sources(root: Path, package: Package) -> list[Path]:
    """The files of a package that people have written."""
    every = (path for folder in package.folders for path in sorted((root / folder).rglob("*.py")))
    return [
        path
        for path in every
        if path.name not in _GENERATED and "\n# Generated" not in path.read_text("utf-8")
    ]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a mutant.

    Attributes:
        caught: whether a test failed.
        by: the test, or "time".
        seconds: how long it took [s].
    """

    caught: bool
    by: str
    seconds: float


class Copy:
    """A copy of the sources in which one file at a time is changed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        shutil.copytree(
            ROOT / "src",
            folder / "src",
            symlinks=True,
            ignore=lambda _, names: [name for name in names if name == "__pycache__"],
        )
        (folder / "cabinet").symlink_to(
            ROOT / "cabinet"
        )  # beside the sources, where the package looks for it
        compileall.compile_dir(folder / "src", quiet=2)

    def run(self, tests: tuple[str, ...], limit: float | None = None) -> Verdict:
        """Run tests until one fails."""
        command = [sys.executable, "-B", "-m", "pytest", "-x", "-q", "--no-header", "-p", "no:cacheprovider"]
        command += ["--hypothesis-profile=mutation", "-m", "not slow and not alone and not browser", *tests]
        environment = os.environ | {"PYTHONPATH": str(self._folder / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
        began = time.monotonic()
        with subprocess.Popen(
            command,
            cwd=ROOT,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as process:
            try:
                said, _ = process.communicate(timeout=limit)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, 9)
                return Verdict(True, "time", time.monotonic() - began)
        by = next((line for line in said.splitlines() if line.startswith(("FAILED ", "ERROR "))), "")
        if process.returncode not in (0, 1) and not by:  # it cannot even be imported
            by = said.strip().splitlines()[-1] if said.strip() else f"exit code {process.returncode}"
        return Verdict(process.returncode != 0, by.partition(" - ")[0], time.monotonic() - began)

    def attempt(self, mutant: Mutant, tests: tuple[str, ...], limit: float) -> Verdict:
        """Run tests with a change."""
        file = self._folder / mutant.file
        original = file.read_bytes()
        for compiled in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
            compiled.unlink()  # it would be taken if the time of the file is the same
        file.write_bytes(mutant.apply(original))
        try:
            return self.run(tests, limit)
        finally:
            file.write_bytes(original)


def chosen(package: Package, options: argparse.Namespace) -> list[Mutant]:
    """The mutants of a package that are tried."""
    files = sources(ROOT, package)
    if options.at:
        name, _, line = options.at.partition(":")
        files = [file for file in files if str(file.relative_to(ROOT)) == name]
        every = [one for file in files for one in mutants(file.read_bytes(), file=name, seed=options.seed)]
        return [one for one in every if not line or one.line == int(line)]
    return drawn(ROOT, files, count=-(-options.count // len(PACKAGES)), seed=options.seed)


def main() -> int:
    """Draw mutants, try them, name the survivors."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutation", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help="mutants of all packages together")
    parser.add_argument("--seed", type=int, default=1, help="of the draw")
    parser.add_argument("--package", choices=[one.name for one in PACKAGES], help="only of this package")
    parser.add_argument(
        "--at", default="", metavar="FILE[:LINE]", help="every mutant of a file or line instead"
    )
    parser.add_argument("--least", type=float, default=LEAST, help="caught of a hundred [%%]")
    parser.add_argument(
        "--jobs", type=int, default=max(1, (os.cpu_count() or 2) - 1), help="at the same time"
    )
    parser.add_argument("--list", action="store_true", help="only list them")
    options = parser.parse_args()
    packages = [one for one in PACKAGES if options.package in (None, one.name)]
    work = [(package, mutant) for package in packages for mutant in chosen(package, options)]
    if options.list or not work:
        print(*(mutant for _, mutant in work), sep="\n")
        return 0 if work else 2
    with tempfile.TemporaryDirectory(prefix="heptarm-mutants-") as folder:
        copies: queue.SimpleQueue[Copy] = queue.SimpleQueue()
        for number in range(min(options.jobs, len(work))):
            copies.put(Copy(Path(folder, str(number))))
        limits = {}
        for package in packages:
            copy = copies.get()
            plain = copy.run(package.tests)
            copies.put(copy)
            if plain.caught:
                print(f"the tests of {package.name} fail without any change: {plain.by}")
                return 2
            limits[package.name] = HANGS * plain.seconds + AND_MORE
            print(f"{package.name}: its tests take {plain.seconds:.0f} s", flush=True)

        def attempt(package: Package, mutant: Mutant) -> Verdict:
            copy = copies.get()
            try:
                verdict = copy.attempt(mutant, package.tests, limits[package.name])
            finally:
                copies.put(copy)
            print(f"{'caught  ' if verdict.caught else 'SURVIVED'} {mutant}  [{verdict.by}]", flush=True)
            return verdict

        with ThreadPoolExecutor(options.jobs) as pool:
            verdicts = list(pool.map(lambda one: attempt(*one), work))
        for package in packages:  # else nothing that was caught counts: something else has failed meanwhile
            copy = copies.get()
            plain = copy.run(package.tests)
            copies.put(copy)
            if plain.caught:
                print(f"the tests of {package.name} fail without any change, after the mutants: {plain.by}")
                return 2
    return report(packages, work, verdicts, options.least)


def report(
    packages: list[Package], work: list[tuple[Package, Mutant]], verdicts: list[Verdict], least: float
) -> int:
    """Print what survived, and the counts; 1 if too few were caught."""
    print()
    for (_, mutant), verdict in zip(work, verdicts, strict=True):
        if not verdict.caught:
            print(f"survived: {mutant}")
    for package in packages:
        own = [verdict.caught for (of, _), verdict in zip(work, verdicts, strict=True) if of is package]
        if own:
            print(f"{package.name:10} {sum(own):3} of {len(own):3}")
    caught = 100.0 * sum(one.caught for one in verdicts) / len(verdicts)
    print(f"caught {caught:.0f} % of {len(verdicts)}, at least {least:g} % are wanted")
    return 0 if caught >= least else 1
