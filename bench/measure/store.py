"""Stored runs: a file for each machine and day, from which the page of figures is made."""

from __future__ import annotations

import datetime
import json
import os
import platform
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from bench.measure.figure import BENCHMARKS

RESULTS = Path(__file__).resolve().parents[1] / "results"
#: What shortens or lengthens benchmarks; stored with the figures.
SETTINGS = "BENCH_"


class Store:
    """The file of this machine and day; a benchmark that is stored again replaces its figures there."""

    def __init__(self) -> None:
        self._machine = machine()
        self._date = datetime.date.today().isoformat()
        words = f"{self._machine['cpu']} {self._machine['cores']} cores".lower()
        slug = re.sub(r"[^a-z0-9]+", "-", words).strip("-")
        self.path = RESULTS / f"{slug}-{self._date}.jsonl"

    def put(self, benchmark: str, records: list[dict[str, Any]], load: float) -> None:
        """Store the figures of a benchmark.

        Args:
            benchmark: its name.
            records: its figures.
            load: the machine's load average before it began.
        """
        settings = {name: value for name, value in sorted(os.environ.items()) if name.startswith(SETTINGS)}
        run: dict[str, Any] = {"benchmark": benchmark, "commit": commit(), "load": round(load, 2)}
        if settings:
            run["settings"] = settings
        kept = [record for record in self._read() if record["run"]["benchmark"] in BENCHMARKS]
        kept = [record for record in kept if record["run"]["benchmark"] != benchmark]
        kept += [{**record, "run": run} for record in records]
        order = list(BENCHMARKS)
        kept.sort(key=lambda record: order.index(record["run"]["benchmark"]))
        lines = [{"machine": self._machine, "date": self._date}, *kept]
        RESULTS.mkdir(exist_ok=True)
        self.path.write_text("".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines))

    def _read(self) -> list[dict[str, Any]]:
        if not self.path.exists():
            return []
        return [json.loads(line) for line in self.path.read_text().splitlines()[1:]]


def machine() -> dict[str, Any]:
    """Properties of the machine that affect the figures."""
    text = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    model = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    kernel = re.match(r"[0-9.]*[0-9]", platform.release())
    flavour = re.search(r"PREEMPT\w*", platform.version())
    return {
        "cpu": model.group(1).strip() if model else platform.machine(),
        "cores": os.cpu_count() or 1,
        "kernel": " ".join(
            [
                platform.system(),
                kernel.group(0) if kernel else platform.release(),
                flavour.group(0) if flavour else "",
            ]
        ).strip(),
        "real_time": _may_be_real_time(),
        "python": platform.python_version(),
    }


def _may_be_real_time() -> bool:
    """Whether a process of this user gets a real-time priority."""
    code = "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))"
    return subprocess.run([sys.executable, "-c", code], check=False, capture_output=True).returncode == 0


def commit() -> str:
    """The commit that is measured; "+" behind it if what is measured has changed since, "" outside a repository."""
    head = _git("rev-parse", "--short=10", "HEAD")
    measured = ("src", "cabinet", "ros1", "ros2", "bench", ":!bench/results")
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", *measured)
    return head + ("+" if changed else "")


def _git(*words: str) -> str:
    command = ["git", *words]
    done = subprocess.run(command, check=False, cwd=RESULTS.parents[1], capture_output=True, text=True)
    return done.stdout.strip()
