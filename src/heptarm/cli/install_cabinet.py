"""`heptarm install-cabinet`: the sources and process data for a Sunrise project, and what to do with them."""

from __future__ import annotations

import shutil
from pathlib import Path

from heptarm import __version__, _resources
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.wire.messages import MAJOR, MINOR


def run(*, out: Path, as_json: bool) -> int:
    """Write the files; returns the exit code.

    Raises:
        CommandRejected: the folder is not empty.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise CommandRejected(
            f"{out} is not an empty folder", parameter="out", hint="name a new folder with --out"
        )
    sources = _resources.cabinet_sources()
    for part in ("core", "app"):
        shutil.copytree(sources / part / "src", out / "src", dirs_exist_ok=True)
    shutil.copytree(sources / "project", out, dirs_exist_ok=True)
    files = sorted(str(path.relative_to(out)) for path in out.rglob("*.java"))
    protocol = f"{MAJOR}.{MINOR}"
    if as_json:
        emit({"out": str(out), "files": len(files), "protocol": protocol, "version": __version__})
    else:
        print(f"{len(files)} Java sources and the project's data are in {out}.")
        print(f"They speak protocol {protocol} and pair with heptarm {__version__}.")
        print(f"Go on with the steps in {out / 'INSTALL.md'}.")
    return 0
