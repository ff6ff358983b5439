"""Somebody else's Sunrise application: its sources compiled against the doubles, its process data found."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from heptarm import _resources
from heptarm.errors import CommandRejected, MissingExtra

#: What Workbench names a project's process data, frames and tools.
PROJECT = "RoboticsAPI.data.xml"

_APPLICATION = re.compile(r"\bclass\s+(\w+)\s+extends\s+(?:[\w.]+\.)?(RoboticsAPI(?:Cyclic)?Application)\b")
_PACKAGE = re.compile(r"^\s*package\s+([\w.]+)\s*;", re.MULTILINE)
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Application:
    """A compiled application.

    Attributes:
        main: its class.
        classes: folder with all classes.
        project: the project's `RoboticsAPI.data.xml`; None: there is none.
    """

    main: str
    classes: Path
    project: Path | None


def find(folder: Path) -> list[str]:
    """The applications in a folder of Java sources, by their full names."""
    found = []
    for source in sorted(folder.rglob("*.java")):
        text = _COMMENT.sub("", source.read_text(encoding="utf-8", errors="replace"))
        package = _PACKAGE.search(text)
        for match in _APPLICATION.finditer(text):
            if not re.search(r"\babstract\s+$", text[: match.start()]):
                found.append(f"{package[1]}.{match[1]}" if package else match[1])
    return found


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
    sources = sorted(folder.rglob("*.java"))
    if not sources:
        raise CommandRejected(
            f"{folder} holds no Java sources", parameter="app", hint="name the folder of a Sunrise project"
        )
    chosen = _chosen(find(folder), main, folder)
    compiler = _compiler()
    listing = out / "sources.txt"
    listing.write_text("".join(f'"{path.as_posix()}"\n' for path in sources), encoding="utf-8")
    path = os.pathsep.join(str(jar) for jar in (*_resources.jars(), *sorted(folder.rglob("*.jar"))))
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
    project = next(iter(sorted(folder.rglob(PROJECT))), None)
    return Application(chosen, out, project)


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
