"""Every fault of an FRI session, 100 times each."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator

from bench.measure.figure import Figure, benchmark
from heptarm.errors import HeptarmError
from tests.sim_fri import kills, scenarios

#: Fewer are for a quick check.
TIMES = int(os.environ.get("BENCH_TIMES", "100"))


@benchmark("fri_faults")
def fri_faults() -> Iterator[Figure]:
    """Faults that ended as designed, with the cause in words and a session that worked after it; 100 of each."""
    runs: dict[str, Callable[[], int]] = {}
    for fault in scenarios.FAULTS:
        runs[fault.__name__] = lambda fault=fault: scenarios.again(fault, TIMES)  # type: ignore[misc]
    runs["duplicates"] = lambda: scenarios.duplicates(TIMES)
    runs["garbage"] = lambda: scenarios.garbage(TIMES)
    runs["killed_client"] = lambda: kills.clients(TIMES)
    runs["killed_controller"] = lambda: kills.controllers(TIMES)
    for name, run in runs.items():
        begin, detail, survived = time.monotonic(), {}, 0
        try:
            survived = run()
        except (AssertionError, HeptarmError) as error:
            detail["failure"] = str(error)[:500]
        detail["seconds"] = f"{time.monotonic() - begin:.0f}"
        yield Figure(f"fri_fault_{name}", survived, "count", limit=TIMES, at_least=True, detail=detail)
