"""`heptarm install-cabinet`: the sources and process data for a Sunrise project, and the installation steps."""

from __future__ import annotations

import hashlib
import re
import shutil
import sys
import zipfile
from pathlib import Path
from typing import Annotated
from xml.sax.saxutils import escape

from cyclopts import Parameter

from heptarm import __version__, _resources
from heptarm.cli.key import locate
from heptarm.cli.options import COMMON, Json
from heptarm.cli.output import emit
from heptarm.errors import CommandRejected, HeptarmError
from heptarm.io.keys import new_key, read_key_file, write_key_file
from heptarm.wire.messages import MAJOR, MINOR

_PROJECT = "RoboticsAPI.data.xml"
#: Options of Sunrise that a Workbench may lack, and what is refused without them.
OPTIONS = {"servoing": "arm.servo", "fri": "arm.fri", "hand-guiding": "ha.hand_guide"}
#: The sources as one file for the import of Workbench, and the class that prints their check sum.
ARCHIVE = "heptarm-sources.zip"
_SETTINGS, _SUM = "heptarm/core/session/ServerSettings.java", 'SOURCES = ""'
_KEY = re.compile(r'(id="heptarm\.key" [^>]*? value=)""')


def install_cabinet(
    *,
    out: Annotated[Path, Parameter(help="Folder to write; must be new or empty.")],
    target: Annotated[
        str,
        Parameter(
            name="--target",
            group=COMMON,
            help="Address of the cabinet: the key stored for it is used, or a new one is stored.",
        ),
    ] = "",
    no_key: Annotated[
        bool,
        Parameter(
            name="--no-key",
            negative="",
            help="Make no key: any program that reaches the cabinet's port can move the robot.",
        ),
    ] = False,
    without: Annotated[
        str,
        Parameter(
            help="Options of Sunrise that your Workbench lacks: servoing, fri, hand-guiding, separated by commas. "
            "The sources compile without them, and what needs them is refused."
        ),
    ] = "",
    as_json: Json = False,
) -> int:
    """Write the cabinet application for a Sunrise project, with a key and the steps.

    For example:

        heptarm install-cabinet --out cabinet --target 172.31.1.147

        heptarm install-cabinet --out cabinet --without fri,hand-guiding
    """
    left_out = _options(without)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise CommandRejected(
            f"--out must be a new or empty folder, got {out}",
            parameter="out",
            hint="name a new folder with --out",
        )
    if target and no_key:
        raise CommandRejected(
            "--target and --no-key cannot be combined: the target is whose key is used", parameter="target"
        )
    stored = locate(target).file if target else None
    key = "" if no_key else new_key() if stored is None or not stored.exists() else read_key_file(stored)
    sources = _resources.cabinet_sources()
    for part in ("core", "app"):
        shutil.copytree(sources / part / "src", out / "src", dirs_exist_ok=True)
    for option in left_out:
        shutil.copytree(sources / "without" / option / "src", out / "src", dirs_exist_ok=True)
    shutil.copytree(sources / "project", out, dirs_exist_ok=True)
    file = out / "heptarm.key" if stored is None else stored
    if key:
        _set_key(out / _PROJECT, key)
        if not file.exists():
            write_key_file(file, key)
    files = sorted(path.relative_to(out / "src").as_posix() for path in out.rglob("*.java"))
    check_sum = _seal(out, files)
    protocol = f"{MAJOR}.{MINOR}"
    if as_json:
        data = {"out": str(out), "files": len(files), "protocol": protocol, "version": __version__}
        data |= {"archive": str(out / ARCHIVE), "sources": check_sum}
        data |= {"without": list(left_out)}
        emit(data | {"key_file": str(file) if key else ""})
        return 0
    print(f"{len(files)} Java sources and the project's data are in {out}.")
    print(f"{out / ARCHIVE} has all sources in one file; their check sum is {check_sum}.")
    print(f"They speak protocol {protocol} and pair with heptarm {__version__}.")
    if left_out:
        refused = " and ".join(f"{OPTIONS[option]} (option {option})" for option in left_out)
        print(f"They compile without the packages of these options, and refuse {refused}.")
    if not key:
        risk = "without a key, any program that reaches the cabinet's port can move the robot"
        print(
            f"heptarm: {risk}; set an allow-list, or keep the cabinet in a network of its own",
            file=sys.stderr,
        )
    else:
        print(f"A key is in {out / _PROJECT}; this machine's copy is {file}.")
        if stored is None:
            print(f"Store it for the cabinet: heptarm key set --target ADDRESS --key-file {file}")
    print(f"Continue with the steps in {out / 'INSTALL.md'}.")
    return 0


def _seal(out: Path, files: list[str]) -> str:
    """Write the check sum of the sources into them, and all of them into one file; returns the check sum."""
    digest = hashlib.sha256()
    for name in files:
        digest.update(f"{name}\n".encode() + (out / "src" / name).read_bytes())
    check_sum = digest.hexdigest()[:12]
    settings = out / "src" / _SETTINGS
    settings.write_text(
        settings.read_text(encoding="utf-8").replace(_SUM, f'SOURCES = "{check_sum}"'), encoding="utf-8"
    )
    with zipfile.ZipFile(out / ARCHIVE, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in files:
            archive.write(out / "src" / name, name)
    return check_sum


def _options(text: str) -> tuple[str, ...]:
    """Options that are left out, each once.

    Raises:
        CommandRejected: there is no such option.
    """
    names = [part.strip() for part in text.split(",") if part.strip()]
    for name in names:
        if name not in OPTIONS:
            allowed = ", ".join(OPTIONS)
            raise CommandRejected(
                f"--without must name options of {allowed}, got {name!r}",
                parameter="without",
                value=name,
                allowed=allowed,
                hint="for example --without fri,hand-guiding",
            )
    return tuple(option for option in OPTIONS if option in names)


def _set_key(project: Path, key: str) -> None:
    """Write the key into the process data, which only their owner can read from then on."""
    value = escape(key, {'"': "&quot;"})
    text, count = _KEY.subn(lambda found: f'{found[1]}"{value}"', project.read_text(encoding="utf-8"))
    if count != 1:
        raise HeptarmError(f"{project} has no empty process data heptarm.key", hint="reinstall heptarm")
    project.unlink()
    project.touch(mode=0o600)
    project.write_text(text, encoding="utf-8")
