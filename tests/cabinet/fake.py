"""The cabinet's core on a fake robot, in a plain JVM without the Sunrise API."""

from __future__ import annotations

import functools
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import TracebackType

ROOT = Path(__file__).resolve().parents[2]
_OUT = ROOT / "build" / "cabinet" / "fake"

sys.path.insert(0, str(ROOT / "cabinet"))

import build  # noqa: E402
import toolchain as toolchain  # noqa: E402


@functools.cache
def classes(folder: str = "java") -> str:
    """Class path of the cabinet's jars and the test's own classes, compiled where they have changed."""
    jars = [jar for jar in build.build() if folder != "java" or jar.name == "heptarm-core.jar"]
    sources = sorted((Path(__file__).parent / folder).rglob("*.java"))
    raw = b"".join(path.read_bytes() for path in (*jars, *sources))
    out = _OUT / hashlib.sha256(raw).hexdigest()[:16]
    path = os.pathsep.join(str(jar) for jar in jars)
    if not out.exists():
        _OUT.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(dir=_OUT))  # another worker may compile at the same time
        javac = [toolchain.find_jdk().javac, "--release", "17", "-d", str(part), "-classpath", path]
        subprocess.run([*javac, *map(str, sources)], check=True)
        try:
            part.rename(out)
        except OSError:  # the other one was faster
            shutil.rmtree(part)
    return f"{path}{os.pathsep}{out}"


class FakeCabinet:
    """The core as a process.

    Args:
        rate: cabinet seconds per second.
        key: pre-shared key.
        allow: allow-list.
        heartbeat: of the server [s]; a client may be silent for five of them.
        getter: what each reading of the robot costs [s].
        datagrams: open the UDP port.
        files: most open files; 0: as many as here.
        log: file for its log.
    """

    def __init__(
        self,
        *,
        log: Path,
        rate: float = 1.0,
        key: str = "",
        allow: str = "",
        heartbeat: float = 2.0,
        getter: float = 0.0,
        datagrams: bool = True,
        files: int = 0,
    ) -> None:
        self.log = log
        options = ["-Xmx64m", "-Xss512k", "-XX:+UseSerialGC", "-XX:TieredStopAtLevel=1", "-cp", classes()]
        values = [str(rate), key, allow, str(heartbeat), str(getter), "udp" if datagrams else "tcp"]
        within = ["sh", "-c", f'ulimit -n {files}; exec "$@"', "sh"] if files else []
        with log.open("w") as file:
            self.process = subprocess.Popen(
                [*within, toolchain.find_jdk().java, *options, "heptarm.fake.FakeCabinet", *values],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=file,
                text=True,
            )
        self.port = int(self._line())

    def _line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def _say(self, text: str) -> str:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{text}\n")
        self.process.stdin.flush()
        return self._line()

    def threads(self) -> list[str]:
        """Names of the server's threads."""
        return sorted(self._say("threads").split())

    def revoke_control(self) -> None:
        """An operator takes control away from the client that has it; returns when its motions have been ended."""
        self._say("revoke")

    def close(self) -> list[str]:
        """Closes the server; returns the names of the threads that are left."""
        left = self._say("close").split()
        assert self.process.wait(timeout=10) == 0
        return left

    def is_alive(self) -> bool:
        return self.process.poll() is None

    def errors(self) -> list[str]:
        """Errors that the server has logged."""
        return [line for line in self.log.read_text().splitlines() if line.startswith("error")]

    def __enter__(self) -> FakeCabinet:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()
