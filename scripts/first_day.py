"""Do what a lab does on its first day, from the documentation alone, and time it: eight programs and four commands.

    python3 scripts/first_day.py                          everything
    python3 scripts/first_day.py --only clone,demo,pick   some steps
    python3 scripts/first_day.py --patience 3600          on a machine that is busy with other things

Each program is the section of a page as it is printed, typed into one file and run in an empty home. It needs the
network, and nothing but Python's standard library.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from scripts.newcomer import PATIENCE, Newcomer, Step, take

COOKBOOK = "docs/guide/cookbook.md"
#: Short names of the programs, the pages and sections in which they are.
PROGRAMS = {
    "tutorial": ("docs/tutorial/first-ten-minutes.md", ""),
    "pick": (COOKBOOK, "Pick and place"),
    "polish": (COOKBOOK, "Polish a surface"),
    "teach": (COOKBOOK, "Teach by pushing"),
    "camera": (COOKBOOK, "Follow what a camera sees"),
    "log": (COOKBOOK, "Log an experiment"),
    "twin": (COOKBOOK, "Ask what if"),
    "upright": (COOKBOOK, "Keep a glass upright"),
}
#: What a first day needs beside the demo's packages: recordings and plots.
EXTRAS = "record"
#: Commands of the shell: short names and arguments.
COMMANDS = {
    "doctor": ("doctor",),
    "plot": ("plot", "experiment.mcap", "-o", "experiment.html"),
    "cabinet": ("install-cabinet", "--out", "my-cabinet"),
    "commands": ("--help",),
}
_RUN = re.compile(r"^RUN ((?:.*\\\n)*.*)$", re.M)


def in_a_container(newcomer: Newcomer, image: Path) -> str:
    """What the Dockerfile does, in an empty folder instead of an image: its files, its commands, its entry point.

    Packages of the system are those of this machine.
    """
    image.mkdir()
    newcomer.run("git", "archive", "-o", f"{image}.tar", "HEAD")
    newcomer.run("tar", "-xf", f"{image}.tar", "-C", image)
    text = (image / "Dockerfile").read_text(encoding="utf-8").partition(" AS dev")[0]
    for command in _RUN.findall(text):
        if "apt-get" not in command:
            newcomer.run("sh", "-c", command, cwd=image)
    (entry,), words = (
        json.loads(text.split(f"\n{name} ")[1].splitlines()[0]) for name in ("ENTRYPOINT", "CMD")
    )
    return newcomer.last(image / ".venv/bin" / entry, *words, cwd=newcomer.home)


def steps(folder: Path, *, patience: float) -> Iterator[Step]:
    """The day, in its order; no step may last longer than `patience` [s]."""
    newcomer = Newcomer(folder, patience=patience)
    yield Step("clone", "git clone", newcomer.get)
    yield Step("demo", "make demo", lambda: newcomer.last("make", "demo"))
    yield Step(
        "extras",
        f"pip install '.[{EXTRAS}]'",
        lambda: newcomer.last(newcomer.python, "-m", "pip", "install", "-q", "-e", f".[{EXTRAS}]"),
    )
    for name, (page, section) in PROGRAMS.items():
        title = section or Path(page).stem.replace("-", " ")
        yield Step(name, f"program: {title}", partial(newcomer.type_in, page, section))
    command = newcomer.python.parent / "heptarm"
    for name, words in COMMANDS.items():
        yield Step(
            name, f"heptarm {' '.join(words)}", partial(newcomer.last, command, *words, cwd=newcomer.home)
        )
    image = folder / "image"
    yield Step("container", "Dockerfile: commands, entry point", lambda: in_a_container(newcomer, image))


def main() -> int:
    """Take all steps and print a table; a failure ends them."""
    parser = argparse.ArgumentParser(description="Do and time a lab's first day, from the documentation.")
    names = ", ".join(("clone", "demo", "extras", *PROGRAMS, *COMMANDS, "container"))
    parser.add_argument("--only", default="", help=f"steps, separated by commas, of {names}")
    parser.add_argument("--patience", type=float, default=PATIENCE, help="longest duration of a step [s]")
    given = parser.parse_args()
    return take(partial(steps, patience=given.patience), given.only)


if __name__ == "__main__":
    sys.exit(main())
