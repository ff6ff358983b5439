"""Somebody else's Sunrise application: its sources compiled against the doubles, its process data found."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path

from heptarm import _resources
from heptarm.errors import CommandRejected, MissingExtra

#: What Workbench names a project's process data, frames and tools.
PROJECT = "RoboticsAPI.data.xml"

_CLASS = re.compile(r"\bclass\s+(\w+)(?:<[^{]*?>)?\s+extends\s+(?:\w+\.)*(\w+)")
_ROOTS = ("RoboticsAPIApplication",)
_BACKGROUND = ("RoboticsAPIBackgroundTask", "RoboticsAPICyclicBackgroundTask")
#: Folders that Workbench fills with copies and with KUKA's own jars.
_LEFT_OUT = ("bin", "KUKAJavaLib")
_PACKAGE = re.compile(r"^\s*package\s+([\w.]+)\s*;", re.MULTILINE)
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Application:
    """A compiled application.

    Attributes:
        main: its class.
        classes: folder with all classes.
        project: the project's `RoboticsAPI.data.xml`; None: there is none.
        background: classes of its background tasks.
        jars: libraries that it brings along.
    """

    main: str
    classes: Path
    project: Path | None
    background: tuple[str, ...] = ()
    jars: tuple[Path, ...] = ()


def find(folder: Path) -> list[str]:
    """The applications in a folder of Java sources, by their full names."""
    return _descendants(_sources(folder, "java"), _ROOTS)


def background(folder: Path) -> list[str]:
    """The background tasks in a folder of Java sources, by their full names."""
    return _descendants(_sources(folder, "java"), _BACKGROUND)


def _sources(folder: Path, suffix: str) -> list[Path]:
    """Files of a project, but for the copies and libraries that Workbench puts there."""
    return [
        file
        for file in sorted(folder.rglob(f"*.{suffix}"))
        if not set(_LEFT_OUT) & set(file.relative_to(folder).parts[:-1])
    ]


def _descendants(sources: list[Path], roots: tuple[str, ...]) -> list[str]:
    """Classes that extend one of some, directly or by way of others of the project; abstract ones do not count."""
    found: dict[str, tuple[str, str, bool]] = {}
    for source in sources:
        text = _COMMENT.sub("", source.read_text(encoding="utf-8", errors="replace"))
        package = _PACKAGE.search(text)
        for match in _CLASS.finditer(text):
            full = f"{package[1]}.{match[1]}" if package else match[1]
            abstract = re.search(r"\babstract\s+(?:\w+\s+)*$", text[: match.start()]) is not None
            found[full] = (match[1], match[2], abstract)
    known, before = set(roots), -1
    while len(known) != before:
        before = len(known)
        known |= {simple for simple, parent, _ in found.values() if parent in known}
    return [full for full, (simple, _, abstract) in found.items() if simple in known and not abstract]


def _libraries(folder: Path) -> tuple[Path, ...]:
    """The project's jars; those with KUKA's classes stay out, for the doubles take their place."""
    found = []
    for jar in _sources(folder, "jar"):
        try:
            with zipfile.ZipFile(jar) as file:
                if not any(name.startswith("com/kuka/") for name in file.namelist()):
                    found.append(jar)
        except zipfile.BadZipFile:
            continue  # no jar, whatever its name
    return tuple(found)


def compile_application(folder: Path, out: Path, *, main: str = "") -> Application:
    """Compile a folder of Java sources against the doubles.

    Args:
        folder: of the project, or of its sources.
        out: an empty folder for the classes.
        main: the application's class, with or without its package; "": the only one there is.

    Raises:
        CommandRejected: no sources, no such application, several of them, or errors of the compiler.
        MissingExtra: there is no Java compiler.
    """
    sources = _sources(folder, "java")
    if not sources:
        raise CommandRejected(
            f"{folder} holds no Java sources", parameter="app", hint="name the folder of a Sunrise project"
        )
    chosen = _chosen(find(folder), main, folder)
    compiler = _compiler()
    listing = out / "sources.txt"
    listing.write_text("".join(f'"{path.as_posix()}"\n' for path in sources), encoding="utf-8")
    jars = _libraries(folder)
    path = os.pathsep.join(str(jar) for jar in (*_resources.jars(), *jars))
    command = [compiler, "--release", "17", "-proc:none", "-nowarn", "-g", "-encoding", "UTF-8"]
    done = subprocess.run(
        [*command, "-cp", path, "-d", str(out), f"@{listing}"], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CommandRejected(
            f"{folder} does not compile:\n{done.stderr.strip()}",
            parameter="app",
            hint="a class or method of Sunrise that is missing here is worth an issue",
        )
    project = next((file for file in _sources(folder, "xml") if file.name == PROJECT), None)
    return Application(chosen, out, project, tuple(background(folder)), jars)


def _chosen(found: list[str], main: str, folder: Path) -> str:
    fitting = [name for name in found if not main or name == main or name.rpartition(".")[2] == main]
    if len(fitting) == 1:
        return fitting[0]
    names = ", ".join(found) or "none"
    if main and not fitting:
        raise CommandRejected(
            f"{folder} has no application {main}", parameter="app-class", allowed=names, value=main
        )
    raise CommandRejected(
        f"{folder} has {len(fitting) or 'no'} applications: {names}",
        parameter="app-class",
        allowed=names,
        hint="choose one with --app-class" if fitting else "an application extends RoboticsAPIApplication",
    )


def _compiler() -> str:
    home = os.environ.get("JAVA_HOME")
    candidates = [str(Path(home) / "bin" / "javac")] if home else []
    for candidate in (*candidates, "javac"):
        if found := shutil.which(candidate):
            return found
    raise MissingExtra(
        "compiling an application needs a Java compiler, and there is no javac here",
        hint="install a JDK 17 or newer, or set JAVA_HOME",
    )
