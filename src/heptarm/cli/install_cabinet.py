"""`heptarm install-cabinet`: the sources and process data for a Sunrise project, and the installation steps."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from heptarm import __version__, _resources
from heptarm.cli.options import (
    Json,
)
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected
from heptarm.wire.messages import MAJOR, MINOR


def install_cabinet(
    *,
    out: Annotated[Path, Parameter(help="Folder to write; must be new or empty.")],
    as_json: Json = False,
) -> int:
    """Write the cabinet application for a Sunrise project, with the steps."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise CommandRejected(
            f"--out must be a new or empty folder, got {out}",
            parameter="out",
            hint="name a new folder with --out",
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
        print(f"Continue with the steps in {out / 'INSTALL.md'}.")
    return 0
