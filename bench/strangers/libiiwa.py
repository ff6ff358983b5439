"""The bridge for libiiwa beside libiiwa's own application, each on a virtual cabinet of its own, asked by turns.

LIBIIWA is the folder of a clone of libiiwa, which is not part of this repository; without it only the bridge is asked.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from bench.measure.blocks import Placement, by_turns, pin
from bench.measure.cabinet import Cabinet
from bench.measure.figure import Figure, benchmark
from tests.bridge.libiiwa import LibiiwaProgram
from tests.cli.running import HEPTARM
from tests.interrupts import ctrl_c_interrupts

#: The environment variable with the folder of libiiwa.
_VARIABLE = "LIBIIWA"
#: Requests of a block.
_REQUESTS = 1000
#: Largest round trip as a multiple of that of libiiwa's application.
_LIMIT = 1.5


@contextmanager
def _connected(*command: str) -> Iterator[tuple[LibiiwaProgram, int]]:
    """A program, and the process that has connected to it; the command gets the port in place of PORT."""
    program = LibiiwaProgram("f")
    words = [*HEPTARM, *(word.replace("PORT", str(program.port)) for word in command)]
    with ctrl_c_interrupts():
        process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
    try:
        program.accept()
        yield program, process.pid
    finally:
        program.close()
        process.terminate()
        process.wait(timeout=60.0)


def _times(program: LibiiwaProgram) -> list[float]:
    """Round trips of requests for the state [s]."""
    times = []
    for _ in range(_REQUESTS):
        began = time.perf_counter_ns()
        program.ask(0)
        times.append((time.perf_counter_ns() - began) * 1e-9)
    return times


@benchmark("libiiwa_answer")
def libiiwa_answer() -> Iterator[Figure]:
    """Round trip of a request of libiiwa through the bridge, beside that of libiiwa's application."""
    folder = os.environ.get(_VARIABLE)
    with ExitStack() as stack:
        cabinet = stack.enter_context(Cabinet())
        ours, bridge = stack.enter_context(
            _connected("bridge", "libiiwa", "--target", cabinet.target, "--port", "PORT")
        )
        if not folder:
            print(f"{_VARIABLE} names no clone of libiiwa: its application is not measured")
            yield Figure("libiiwa_answer", float(np.median(_times(ours))) * 1e6, "us")
            return
        address = ("--app-data", "controller_ip=127.0.0.1", "--app-data", "controller_port=PORT")
        theirs, application = stack.enter_context(
            _connected("sim", "app", str(Path(folder) / "java"), "--app-class", "LibIiwa", *address)
        )

        def place(placement: Placement) -> None:
            for process in (cabinet.process.pid, bridge, application):
                pin(process, placement.far)

        for found in by_turns(lambda: _times(ours), lambda: _times(theirs), place):
            yield found.figure("libiiwa_answer", 50, "us", limit=_LIMIT, scale=1e6)
