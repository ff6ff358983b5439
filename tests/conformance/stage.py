"""A cabinet with faults as a process, from any environment: the cabinet itself needs the project's own."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
PYTHON = ROOT / ".venv" / "bin" / "python"
#: ROS' wheels set these for their own environment; a process of another one must not have them.
FOREIGN = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH", "PYTHONPATH")


def environment() -> dict[str, str]:
    """This process' environment without what belongs to ROS, and with these sources."""
    return {name: value for name, value in os.environ.items() if name not in FOREIGN} | {
        "PYTHONPATH": str(ROOT / "src")
    }


class Stage:
    """A virtual cabinet with injectable faults; it can be killed and restarted on its port."""

    def __init__(self, *options: str) -> None:
        self._options = options
        self.port = 0
        # also of a restart: it belongs to the creator of this object, see tests.processes
        self._environment = environment()
        self.process = self._start()

    def _start(self) -> subprocess.Popen[str]:
        command = [str(PYTHON), str(Path(__file__).with_name("faulty.py")), "--port", str(self.port)]
        command += ["--drive-monitoring", "off"]  # the drives of an arm that does not follow would trip
        command += ["--data", "heptarm.heartbeat=2"]  # a busy machine may hold it up for longer than a second
        process = subprocess.Popen(
            [*command, *self._options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self._environment,
            start_new_session=True,
        )
        assert process.stdout is not None
        ready = json.loads(process.stdout.readline() or '{"ready": false}')
        assert ready["ready"], ready
        self.port = ready["port"]
        return process

    @property
    def target(self) -> str:
        """The target to connect to."""
        return f"sim://127.0.0.1:{self.port}"

    def do(self, word: str) -> None:
        """follows, frozen, lags, press, release, or what an operator does: see `faulty`."""
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.write(word + "\n")
        self.process.stdin.flush()
        assert self.process.stdout.readline().strip() == word

    def kill(self) -> None:
        """As by a power cut."""
        self.process.kill()
        self._gone()

    def restart(self) -> None:
        """On the same port, arm at home."""
        self.process = self._start()

    def close(self) -> None:
        """End it."""
        if self.process.poll() is None:
            assert self.process.stdin is not None
            self.process.stdin.close()
        self._gone()

    def _gone(self) -> None:
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(20)
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.close()
        self.process.stdout.close()
