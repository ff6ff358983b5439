"""Every Python snippet of the documentation runs, page by page, against one virtual cabinet.

The blocks of a page run in order in one process, as a reader would type them. A block whose fence is
``python no-run`` is only compiled, and so is a ``python needs-drawing`` where nothing can be drawn; pages without a
block that runs are skipped.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.drawing import cannot_draw
from tests.lending import Lender
from tests.retry import busy, retry
from tests.simulators import FASTER, PATIENT, PATIENT_AND_FASTER

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^( *)```(?:python|\{code-block\} python)([^\n]*)\n(.*?)^\1```", re.S | re.M)
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
#: Simulators of these pages run in real time: their programs look at the clock of this machine, or answer FRI.
REAL_TIME = (
    *(
        "fri.md",
        "data-flow-fri.md",
        "data-flow-servo.md",
        "guidance.md",
        "io.md",
        "jogging.md",
        "laws.md",
        "servo.md",
        "state.md",
    ),
    "stopping.md",
)
#: What every run has, a page of each kind: first steps, motions, streams, FRI, states, records. The others run before a
#: release; what they call, tests named after it show in every run, and that they compile is shown in every run, too.
IN_EVERY_RUN = (
    *("README.md", "index.md", "first-ten-minutes.md", "motions.md", "conditions.md", "servo.md", "io.md"),
    *("recovery.md", "data-flow-fri.md", "kinematics.md"),
)
RUNNER = """
import os, sys
os.environ.setdefault("MPLBACKEND", "Agg")
page = {"__name__": "__main__"}
for name in sys.argv[1:]:
    source = open(name, encoding="utf-8").read()
    exec(compile(source, os.path.basename(name), "exec"), page)
"""


@pytest.fixture(scope="module")
def lender(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lender]:
    """The virtual cabinet of all pages of a speed."""
    with Lender(tmp_path_factory.mktemp("lender") / "socket", request.param) as lender:
        yield lender


def _blocks(page: Path) -> list[tuple[int, str, bool]]:
    """Line, source and whether to run it, of every Python block of a page."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in BLOCK.finditer(text):
        indent, info, body = match.groups()
        source = "\n".join(line.removeprefix(indent) for line in body.splitlines()) + "\n"
        run = "no-run" not in info and not ("needs-drawing" in info and cannot_draw())
        found.append((text[: match.start()].count("\n") + 1, source, run))
    return found


def _id(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", [page for page in PAGES if _blocks(page)], ids=_id)
def test_snippets_compile(page: Path) -> None:
    for line, source, _ in _blocks(page):
        compile(source, f"{_id(page)}:{line}", "exec")


#: Pages with a block that runs.
RUNNING = [page for page in PAGES if any(run for *_, run in _blocks(page))]


def _params(pages: list[Path]) -> list[object]:
    return [
        pytest.param(page, id=_id(page), marks=[] if page.name in IN_EVERY_RUN else [pytest.mark.long])
        for page in pages
    ]


@pytest.mark.slow
@pytest.mark.parametrize("page", _params([page for page in RUNNING if page.name in REAL_TIME]))
@pytest.mark.parametrize("lender", [1.0], indirect=True)
def test_snippets_run_in_real_time(page: Path, tmp_path: Path, lender: Lender) -> None:
    _run(page, tmp_path, lender)


@pytest.mark.slow
@pytest.mark.parametrize("page", _params([page for page in RUNNING if page.name not in REAL_TIME]))
@pytest.mark.parametrize("lender", [FASTER], indirect=True)
def test_snippets_run(page: Path, tmp_path: Path, lender: Lender) -> None:
    _run(page, tmp_path, lender)


def _run(page: Path, tmp_path: Path, lender: Lender) -> None:
    files = []
    for line, source, run in _blocks(page):
        if run:
            # Named after its line in the page, so that a traceback refers to it.
            files.append(tmp_path / f"{page.stem}-line-{line}.py")
            files[-1].write_text(source, encoding="utf-8")

    program = lender.prelude + (PATIENT if page.name in REAL_TIME else PATIENT_AND_FASTER) + RUNNER

    def run_page() -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-W", "error::SyntaxWarning", "-c", program, *map(str, files)],
            cwd=tmp_path,
            env=os.environ | {"HEPTARM_TARGET": "sim://iiwa14"},
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        )

    done = retry(run_page, busy)
    assert done.returncode == 0, f"{_id(page)}:\n{done.stdout}\n{done.stderr}"
