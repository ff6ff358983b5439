"""Finds the JDK and the Eclipse compiler, and takes Java 7's library signatures from the JDK's record."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

INSTALL = "apt-get update && apt-get install -y --no-install-recommends openjdk-17-jdk-headless ecj"
_ECJ_JARS = ("/usr/share/java/ecj.jar", "/usr/share/java/eclipse-jdt-core.jar")
_ECJ_MAIN = "org.eclipse.jdt.internal.compiler.batch.Main"


class ToolMissing(RuntimeError):
    """A compiler is not on this machine; the text has the remedy."""


@dataclass(frozen=True)
class Jdk:
    """An installed Java development kit."""

    home: Path

    @property
    def java(self) -> str:
        """Path of the Java launcher."""
        return str(self.home / "bin" / "java")

    @property
    def javac(self) -> str:
        """Path of the Java compiler."""
        return str(self.home / "bin" / "javac")

    @cached_property
    def version(self) -> int:
        """Feature release, 17 for example."""
        try:
            said = (self.home / "release").read_text(
                encoding="utf-8"
            )  # a hundred times faster than to ask javac
        except OSError:
            done = subprocess.run([self.javac, "-version"], capture_output=True, text=True, check=True)
            said = done.stdout + done.stderr
        found = re.search(r'(?:javac |JAVA_VERSION=")(?:1\.)?(\d+)', said)
        return int(found.group(1)) if found else 0

    @property
    def knows_java_7(self) -> bool:
        """Whether it carries the library signatures of Java 7 (JDK 12 to 19 do)."""
        return 12 <= self.version < 20


def _homes() -> list[Path]:
    homes = [Path(os.environ[name]) for name in ("HEPTARM_JDK", "JAVA_HOME") if os.environ.get(name)]
    if on_path := shutil.which("javac"):
        homes.append(Path(on_path).resolve().parent.parent)
    for root in (Path("/usr/lib/jvm"), Path("/Library/Java/JavaVirtualMachines")):
        homes.extend(sorted(root.glob("*17*")) + sorted(root.glob("*17*/Contents/Home")))
    return [home for home in homes if (home / "bin" / "javac").exists()]


def find_jdk() -> Jdk:
    """Returns the best installed JDK: one that knows Java 7 if there is one.

    Raises:
        ToolMissing: no JDK of release 17 or later is installed.
    """
    jdks = [jdk for jdk in map(Jdk, _homes()) if jdk.version >= 17]
    for jdk in jdks:
        if jdk.knows_java_7:
            return jdk
    if jdks:
        return jdks[0]
    raise ToolMissing(
        f"no JDK 17 to compile the cabinet with. On Debian or Ubuntu:\n    sudo sh -c '{INSTALL}'"
    )


def find_ecj(jdk: Jdk) -> list[str]:
    """Returns the command that runs the Eclipse compiler, which still writes classes for Java 6.

    Raises:
        ToolMissing: it is not installed.
    """
    for jar in (os.environ.get("ECJ_JAR", ""), *_ECJ_JARS):
        if jar and Path(jar).exists():
            return [jdk.java, "-Xshare:auto", "-XX:TieredStopAtLevel=1", "-cp", jar, _ECJ_MAIN]
    if command := shutil.which("ecj"):
        return [command]
    raise ToolMissing(
        "the Eclipse compiler (ecj) is missing; only it still compiles for Java 6. On Debian or Ubuntu:\n"
        f"    sudo sh -c '{INSTALL}'\n"
        "elsewhere, with Maven's client, which checks its checksum:\n"
        "    mvn --strict-checksums dependency:copy -Dartifact=org.eclipse.jdt:ecj:3.32.0 -DoutputDirectory=build\n"
        "    export ECJ_JAR=$PWD/build/ecj-3.32.0.jar"
    )


def java7_library(jdk: Jdk, folder: Path) -> Path:
    """Writes a jar with the signatures of Java 7's library, or of the oldest that the JDK knows.

    Compiling against it, and not against the JDK's own library, refuses newer members and keeps newer
    descriptors (such as ``ByteBuffer.flip`` returning a ByteBuffer) out of the class files.

    Returns:
        The path of the jar.
    """
    release = "7" if jdk.knows_java_7 else "8"
    target = folder / f"library-{release}-of-jdk-{jdk.version}.jar"
    if not target.exists():
        folder.mkdir(parents=True, exist_ok=True)
        part = target.with_suffix(f".{os.getpid()}")
        with zipfile.ZipFile(jdk.home / "lib" / "ct.sym") as record, zipfile.ZipFile(part, "w") as jar:
            for name in record.namelist():
                releases, _, rest = name.partition("/")
                module, _, path = rest.partition("/")
                if release in releases and "." in module and path.endswith(".sig"):
                    jar.writestr(path.removesuffix(".sig") + ".class", record.read(name))
        part.replace(target)
    return target
