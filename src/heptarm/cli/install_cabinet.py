"""`heptarm install-cabinet`: the sources and process data for a Sunrise project, and the installation steps."""

from __future__ import annotations

import hashlib
import json
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
#: The same for Sunrise 2.x, where settings are constants, and the releases of FRI whose names are known there.
_PROJECT_2, _KEY_2 = "src/heptarm/app2/Settings.java", re.compile(r'({"heptarm\.key", )""')
FRI_2 = ("2.5", "3.0")


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
    sunrise: Annotated[
        int,
        Parameter(
            help="Generation of Sunrise.OS: 1, or 2 for a preview that was never run on such a cabinet: see "
            "the guide, 'Sunrise 2.x and LBR Med'."
        ),
    ] = 1,
    fri: Annotated[
        str,
        Parameter(
            help="With --sunrise 2: release of FRI on the cabinet, 2.5 or 3.0 (FRI Med 3.0); empty: without FRI."
        ),
    ] = "",
    as_json: Json = False,
) -> int:
    """Write the cabinet application for a Sunrise project, with a key and the steps.

    For example:

        heptarm install-cabinet --out cabinet --target 172.31.1.147

        heptarm install-cabinet --out cabinet --without fri,hand-guiding

        heptarm install-cabinet --out cabinet --sunrise 2 --fri 2.5
    """
    left_out = _options(without)
    _check_generation(sunrise, fri, without)
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
    if sunrise == 2:
        folders: tuple[str, ...] = ("core/src", "app2/src", f"app2/fri/{fri or 'none'}")
        project, settings, pattern, quoted = "project2", out / _PROJECT_2, _KEY_2, json.dumps(key)
    else:
        folders = ("core/src", "app/src", *(f"without/{option}/src" for option in left_out))
        project, settings, pattern = "project", out / _PROJECT, _KEY
        quoted = '"' + escape(key, {'"': "&quot;"}) + '"'
    for folder in folders:
        shutil.copytree(sources / folder, out / "src", dirs_exist_ok=True)
    shutil.copytree(sources / project, out, dirs_exist_ok=True)
    file = out / "heptarm.key" if stored is None else stored
    if key:
        _set_key(settings, pattern, quoted)
        if not file.exists():
            write_key_file(file, key)
    files = sorted(path.relative_to(out / "src").as_posix() for path in out.rglob("*.java"))
    check_sum = _seal(out, files)
    protocol = f"{MAJOR}.{MINOR}"
    if as_json:
        data = {"out": str(out), "files": len(files), "protocol": protocol, "version": __version__}
        data |= {"archive": str(out / ARCHIVE), "sources": check_sum}
        data |= {"without": list(left_out), "sunrise": sunrise}
        emit(data | {"key_file": str(file) if key else ""})
        return 0
    print(f"{len(files)} Java sources and the project's data are in {out}.")
    print(f"{out / ARCHIVE} has all sources in one file; their check sum is {check_sum}.")
    if sunrise == 2:
        print("They are a preview for Sunrise 2.x: written from facts, never run on such a cabinet.")
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
        print(f"A key is in {settings}; this machine's copy is {file}.")
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


def _check_generation(sunrise: int, fri: str, without: str) -> None:
    """Refuse a generation of Sunrise that is not known, and options of the other one.

    Raises:
        CommandRejected: the combination cannot be written.
    """
    if sunrise not in (1, 2):
        raise CommandRejected(f"--sunrise must be 1 or 2, got {sunrise}", parameter="sunrise", allowed="1, 2")
    if sunrise == 2 and without:
        raise CommandRejected(
            "--without is for --sunrise 1: the sources for 2.x need only FRI chosen, with --fri",
            parameter="without",
        )
    if fri and sunrise == 1:
        raise CommandRejected(
            "--fri is for --sunrise 2: on 1.x the sources fit each release; leave FRI out with --without fri",
            parameter="fri",
        )
    if fri and fri not in FRI_2:
        allowed = ", ".join(FRI_2)
        raise CommandRejected(
            f"--fri must be one of {allowed}, got {fri!r}", parameter="fri", value=fri, allowed=allowed
        )


def _set_key(settings: Path, pattern: re.Pattern[str], quoted: str) -> None:
    """Write the key into the settings, which only their owner can read from then on."""
    text, count = pattern.subn(lambda found: f"{found[1]}{quoted}", settings.read_text(encoding="utf-8"))
    if count != 1:
        raise HeptarmError(f"{settings} has no empty setting heptarm.key", hint="reinstall heptarm")
    settings.unlink()
    settings.touch(mode=0o600)
    settings.write_text(text, encoding="utf-8")
