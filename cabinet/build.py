"""Compiles the cabinet: core and app for the robot's Java 6, the doubles for the workstation's Java 17.

    python cabinet/build.py            compile what has changed, write the jars
    python cabinet/build.py --force    compile everything
    python cabinet/build.py --sunrise2 compile the preview for Sunrise 2.x and its doubles as well

core knows nothing of KUKA; the doubles stand in for KUKA's classes and use core; app uses both. app2 is the
preview for Sunrise 2.x, with doubles of its own that stand on those of 1.x under another package; it is compiled
for tests only, and no jar of it is packed into the wheel. After the Eclipse compiler has run, every class of core
and app is looked at: class version 50, no member that Java 6 lacks, no forbidden package. Python's standard
library is enough, so that the wheel's build hook can call it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE) not in sys.path:
    sys.path.insert(0, str(HERE))

import classfile  # noqa: E402
import toolchain  # noqa: E402

ROOT = HERE.parent
OUT = ROOT / "build" / "cabinet"
JARS = ROOT / "src" / "heptarm" / "sim" / "jars"
_WARNING = "Test doubles for a virtual robot on a workstation. Never deploy this jar to a robot controller."


class BuildFailed(RuntimeError):
    """The cabinet does not compile, or its classes are not fit for a cabinet."""


@dataclass(frozen=True)
class Part:
    """A part of the cabinet.

    Attributes:
        name: of its classes' folder.
        jar: file name.
        needs: parts whose classes it uses.
        forbidden: packages that it may not name.
        for_robot: for a cabinet of 1.x: Java 6, checked class by class.
        release: Java release of the others.
        folders: of the sources; none: those of its name.
        moved: folder of sources in which KUKA's packages are renamed to `_MOVED` before they are compiled.
        shipped: part of the wheel.
    """

    name: str
    jar: str
    needs: tuple[str, ...] = ()
    forbidden: tuple[str, ...] = ()
    for_robot: bool = True
    release: str = "17"
    folders: tuple[str, ...] = ()
    moved: str = ""
    shipped: bool = True

    @property
    def file(self) -> Path:
        """Path of its jar."""
        return (JARS if self.shipped else OUT / "sunrise2") / self.jar


PARTS = (
    Part("core", "heptarm-core.jar", forbidden=("com/kuka/", "heptarm/app/", "heptarm/doubles/")),
    Part("doubles", "heptarm-doubles-not-for-robots.jar", needs=("core",), for_robot=False),
    Part("app", "heptarm-app.jar", needs=("core", "doubles"), forbidden=("heptarm/doubles/",)),
    Part("samples", "heptarm-samples.jar", needs=("core", "doubles", "app"), forbidden=("heptarm/doubles/",)),
    Part(
        "doubles2",
        "heptarm-doubles2-not-for-robots.jar",
        needs=("core",),
        for_robot=False,
        moved="doubles/src",
        shipped=False,
    ),
    *(
        Part(
            f"app2-fri-{version}",
            f"heptarm-app2-fri-{version}.jar",
            needs=("core", "doubles2"),
            for_robot=False,
            release="8",
            folders=("app2/src", f"app2/fri/{version}"),
            shipped=False,
        )
        for version in ("none", "2.5", "3.0")
    ),
)
#: Where KUKA's packages of 1.x are in the doubles of 2.x, which have other classes of the same names.
_MOVED = "heptarm.sunrise1."


def build(*, force: bool = False, sunrise2: bool = False) -> list[Path]:
    """Compiles every part whose sources, or whose needs, have changed since the last time.

    Args:
        force: compile everything.
        sunrise2: also the preview for Sunrise 2.x, which is not shipped compiled.

    Returns:
        The paths of the jars.

    Raises:
        BuildFailed: a compiler or a check refused something; the text names it.
        toolchain.ToolMissing: there is no JDK or no Eclipse compiler.
    """
    with _lock():
        digests: dict[str, str] = {}
        parts = [part for part in PARTS if part.shipped or sunrise2]
        for part in parts:
            digests[part.name] = _digest(part, [digests[name] for name in part.needs])
            stamp = OUT / f"{part.name}.stamp"
            fresh = part.file.exists() and stamp.exists() and stamp.read_text() == digests[part.name]
            if force or not fresh:
                stamp.unlink(missing_ok=True)
                _compile(part)
                _check(part)
                _pack(part)
                stamp.write_text(digests[part.name])
    return [part.file for part in parts]


def _sources(part: Part) -> list[Path]:
    return [
        path
        for folder in (part.folders or (f"{part.name}/src",))
        for path in sorted((HERE / folder).rglob("*.java"))
    ]


def _resources(part: Part) -> list[Path]:
    folder = (HERE / part.moved).parent if part.moved else HERE / part.name
    return sorted(path for path in (folder / "resources").rglob("*") if path.is_file())


def _moved(part: Part) -> list[Path]:
    """Copies of the sources whose packages are renamed."""
    copies = OUT / f"{part.name}-moved"
    shutil.rmtree(copies, ignore_errors=True)
    made = []
    for path in _originals(part):
        copy = copies / path.relative_to(HERE / part.moved)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(path.read_text(encoding="utf-8").replace("com.kuka.", _MOVED), encoding="utf-8")
        made.append(copy)
    return made


def _originals(part: Part) -> list[Path]:
    return sorted((HERE / part.moved).rglob("*.java")) if part.moved else []


def _digest(part: Part, needs: list[str]) -> str:
    digest = hashlib.sha256("".join(needs).encode())
    tools = [HERE / name for name in ("build.py", "toolchain.py", "classfile.py", "java7.txt")]
    for path in (*tools, *_sources(part), *_originals(part), *_resources(part)):
        digest.update(f"{path.relative_to(HERE)}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def _compile(part: Part) -> None:
    sources = _sources(part)
    if not sources:
        raise BuildFailed(f"cabinet/{part.name}/src holds no Java")
    classes = OUT / part.name
    shutil.rmtree(classes, ignore_errors=True)
    classes.mkdir(parents=True)
    sources += _moved(part)
    listing = OUT / f"{part.name}.sources"
    listing.write_text("".join(f'"{path.as_posix()}"\n' for path in sources), encoding="utf-8")
    path = os.pathsep.join(str(OUT / name) for name in part.needs)
    jdk = toolchain.find_jdk()
    if part.for_robot:
        library = toolchain.java7_library(jdk, OUT)
        command = [*toolchain.find_ecj(jdk), "-bootclasspath", str(library)]
        command += ["-source", "1.6", "-target", "1.6", "-nowarn"]
    else:
        command = [jdk.javac, "--release", part.release, "-Xlint:-options"]
    command += ["-proc:none", "-g", "-encoding", "UTF-8", "-d", str(classes)]
    command += ["-classpath", path or str(classes), f"@{listing}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BuildFailed(f"cabinet/{part.name} does not compile:\n{done.stdout}{done.stderr}")


def _check(part: Part) -> None:
    if not part.for_robot:
        return
    refusals = classfile.Refusals.load(HERE / "java7.txt", part.forbidden)
    wrong: list[str] = []
    for path in sorted((OUT / part.name).rglob("*.class")):
        wrong.extend(refusals.of(classfile.read(path.read_bytes())))
    if wrong:
        raise BuildFailed(f"cabinet/{part.name} is not fit for a cabinet:\n  " + "\n  ".join(wrong))


def _pack(part: Part) -> None:
    part.file.parent.mkdir(parents=True, exist_ok=True)
    classes = OUT / part.name
    files = {path.relative_to(classes).as_posix(): path.read_bytes() for path in classes.rglob("*.class")}
    for path in _resources(part):
        files[path.as_posix().rpartition("/resources/")[2]] = path.read_bytes()
    manifest = f"Manifest-Version: 1.0\r\nImplementation-Title: heptarm-{part.name}\r\n"
    if not part.for_robot:
        manifest += _fold(f"Heptarm-Warning: {_WARNING}")
        files["NEVER-DEPLOY-TO-A-ROBOT.txt"] = f"{_WARNING}\n".encode()
    temporary = part.file.with_name(f"{part.jar}.{os.getpid()}")
    with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as jar:
        _add(jar, "META-INF/MANIFEST.MF", f"{manifest}\r\n".encode())
        for name, data in sorted(files.items()):
            _add(jar, name, data)
    temporary.replace(part.file)


def _add(jar: zipfile.ZipFile, name: str, data: bytes) -> None:
    # A fixed date, so that the same sources give the same jar.
    info = zipfile.ZipInfo(name, date_time=(2026, 1, 1, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = 0o644 << 16
    jar.writestr(info, data)


def _fold(line: str) -> str:
    """Breaks a manifest line at the 72 bytes that the format allows."""
    rows = [line[:70]] + [line[at : at + 69] for at in range(70, len(line), 69)]
    return "\r\n ".join(rows) + "\r\n"


@contextlib.contextmanager
def _lock() -> Iterator[None]:
    """Keeps two builds of one checkout apart."""
    OUT.mkdir(parents=True, exist_ok=True)
    with (OUT / "lock").open("w") as file:
        with contextlib.suppress(ImportError):  # Windows has no fcntl; there builds are not locked
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def main() -> int:
    """Runs the build and lists the jars."""
    try:
        jars = build(force="--force" in sys.argv[1:], sunrise2="--sunrise2" in sys.argv[1:])
    except (BuildFailed, toolchain.ToolMissing) as error:
        print(f"cabinet: {error}", file=sys.stderr)
        return 1
    print("cabinet:", ", ".join(f"{jar.name} {jar.stat().st_size // 1024} KiB" for jar in jars))
    return 0


if __name__ == "__main__":
    sys.exit(main())
