"""Compiles the cabinet: core and app for the robot's Java 6, the doubles for the workstation's Java 17.

    python cabinet/build.py            compile what has changed, write the jars
    python cabinet/build.py --force    compile everything

core knows nothing of KUKA; the doubles stand in for KUKA's classes and use core; app uses both. After the
Eclipse compiler has run, every class of core and app is looked at: class version 50, no member that Java 6
lacks, no forbidden package. Python's standard library is enough, so that the wheel's build hook can call it.
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
    """One of the three parts of the cabinet."""

    name: str
    jar: str
    needs: tuple[str, ...] = ()
    forbidden: tuple[str, ...] = ()
    for_robot: bool = True


PARTS = (
    Part("core", "heptarm-core.jar", forbidden=("com/kuka/", "heptarm/app/", "heptarm/doubles/")),
    Part("doubles", "heptarm-doubles-not-for-robots.jar", needs=("core",), for_robot=False),
    Part("app", "heptarm-app.jar", needs=("core", "doubles"), forbidden=("heptarm/doubles/",)),
    Part("samples", "heptarm-samples.jar", needs=("core", "doubles", "app"), forbidden=("heptarm/doubles/",)),
)


def build(*, force: bool = False) -> list[Path]:
    """Compiles every part whose sources, or whose needs, have changed since the last time.

    Args:
        force: compile everything.

    Returns:
        The paths of the jars.

    Raises:
        BuildFailed: a compiler or a check refused something; the text names it.
        toolchain.ToolMissing: there is no JDK or no Eclipse compiler.
    """
    with _lock():
        digests: dict[str, str] = {}
        for part in PARTS:
            digests[part.name] = _digest(part, [digests[name] for name in part.needs])
            stamp = OUT / f"{part.name}.stamp"
            fresh = (JARS / part.jar).exists() and stamp.exists() and stamp.read_text() == digests[part.name]
            if force or not fresh:
                stamp.unlink(missing_ok=True)
                _compile(part)
                _check(part)
                _pack(part)
                stamp.write_text(digests[part.name])
    return [JARS / part.jar for part in PARTS]


def _sources(part: Part) -> list[Path]:
    return sorted((HERE / part.name / "src").rglob("*.java"))


def _resources(part: Part) -> list[Path]:
    return sorted(path for path in (HERE / part.name / "resources").rglob("*") if path.is_file())


def _digest(part: Part, needs: list[str]) -> str:
    digest = hashlib.sha256("".join(needs).encode())
    tools = [HERE / name for name in ("build.py", "toolchain.py", "classfile.py", "java7.txt")]
    for path in (*tools, *_sources(part), *_resources(part)):
        digest.update(f"{path.relative_to(HERE)}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def _compile(part: Part) -> None:
    sources = _sources(part)
    if not sources:
        raise BuildFailed(f"cabinet/{part.name}/src holds no Java")
    classes = OUT / part.name
    shutil.rmtree(classes, ignore_errors=True)
    classes.mkdir(parents=True)
    listing = OUT / f"{part.name}.sources"
    listing.write_text("".join(f'"{path.as_posix()}"\n' for path in sources), encoding="utf-8")
    path = os.pathsep.join(str(OUT / name) for name in part.needs)
    jdk = toolchain.find_jdk()
    if part.for_robot:
        library = toolchain.java7_library(jdk, OUT)
        command = [*toolchain.find_ecj(jdk), "-bootclasspath", str(library)]
        command += ["-source", "1.6", "-target", "1.6", "-nowarn"]
    else:
        command = [jdk.javac, "--release", "17", "-Xlint:-options"]
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
    JARS.mkdir(parents=True, exist_ok=True)
    classes, resources = OUT / part.name, HERE / part.name / "resources"
    files = {path.relative_to(classes).as_posix(): path.read_bytes() for path in classes.rglob("*.class")}
    files |= {path.relative_to(resources).as_posix(): path.read_bytes() for path in _resources(part)}
    manifest = f"Manifest-Version: 1.0\r\nImplementation-Title: heptarm-{part.name}\r\n"
    if not part.for_robot:
        manifest += _fold(f"Heptarm-Warning: {_WARNING}")
        files["NEVER-DEPLOY-TO-A-ROBOT.txt"] = f"{_WARNING}\n".encode()
    temporary = JARS / f"{part.jar}.{os.getpid()}"
    with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as jar:
        _add(jar, "META-INF/MANIFEST.MF", f"{manifest}\r\n".encode())
        for name, data in sorted(files.items()):
            _add(jar, name, data)
    temporary.replace(JARS / part.jar)


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
        jars = build(force="--force" in sys.argv[1:])
    except (BuildFailed, toolchain.ToolMissing) as error:
        print(f"cabinet: {error}", file=sys.stderr)
        return 1
    print("cabinet:", ", ".join(f"{jar.name} {jar.stat().st_size // 1024} KiB" for jar in jars))
    return 0


if __name__ == "__main__":
    sys.exit(main())
