"""Print figures, one JSON object per line.

python -m bench                      all benchmarks
python -m bench --group fri,state    some groups
python -m bench --only round_trip    some benchmarks
python -m bench --list               groups, names and what they measure
python -m bench --store              store the figures in bench/results as well

Exit status: 0 if every limit is met, 1 if one is missed, 3 if none is missed but the machine left one undecided.
"""

from __future__ import annotations

import argparse
import json
import os
import sys

from bench.calibration import cameras, flange, identification  # noqa: F401  every import registers its benchmarks
from bench.contact import force  # noqa: F401
from bench.fri import faults, guard, hold, loop  # noqa: F401
from bench.lab import record  # noqa: F401
from bench.measure.figure import BENCHMARKS, Benchmark
from bench.measure.store import Store
from bench.motion import endpoints, follow, inverse_kinematics, paths  # noqa: F401
from bench.planning import rivals, search  # noqa: F401
from bench.protocol import garbage, round_trip  # noqa: F401
from bench.rl import contact, deploy, training  # noqa: F401
from bench.ros import nodes  # noqa: F401
from bench.safety import lost_client, stopping  # noqa: F401
from bench.servo import stream  # noqa: F401
from bench.simulator import life, tick  # noqa: F401
from bench.speed import dynamics, fleet, idle, kinematics, request, unpaced  # noqa: F401
from bench.state import push  # noqa: F401
from bench.strangers import libiiwa, programs  # noqa: F401
from bench.trust import lost_client as lost_clients  # noqa: F401
from bench.trust import network, outsiders, readings, soak  # noqa: F401


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", metavar="NAMES", type=_words, help="run these benchmarks")
    parser.add_argument("--group", metavar="GROUPS", type=_words, help="run the benchmarks of these groups")
    parser.add_argument("--list", action="store_true", help="list the benchmarks")
    parser.add_argument("--store", action="store_true", help="store the figures in bench/results")
    options = parser.parse_args()
    groups = sorted({benchmark.group for benchmark in BENCHMARKS.values()})
    for kind, asked, known in (
        ("benchmark", options.only, list(BENCHMARKS)),
        ("group", options.group, groups),
    ):
        for name in set(asked or ()) - set(known):
            print(f"no {kind} {name!r}; there are {', '.join(known)}", file=sys.stderr)
            return 2
    chosen = [
        one
        for one in sorted(BENCHMARKS.values(), key=lambda one: one.group)
        if one.name in (options.only or BENCHMARKS) and one.group in (options.group or groups)
    ]
    if options.list:
        for one in chosen:
            print(f"{one.group:10} {one.name:16} {one.doc}")
        return 0
    return _run(chosen, Store() if options.store else None)


def _words(text: str) -> list[str]:
    return text.split(",")


def _run(chosen: list[Benchmark], store: Store | None) -> int:
    """Run benchmarks; prints each figure as soon as it is measured."""
    verdicts: dict[str, bool | None] = {}
    for one in chosen:
        records, load = [], os.getloadavg()[0]
        for figure in one.figures():
            if figure.name in verdicts:
                raise RuntimeError(f"{figure.name} is measured twice; a figure's name is unique")
            verdicts[figure.name] = figure.ok
            records.append(figure.as_dict())
            print(json.dumps(records[-1], ensure_ascii=False), flush=True)
        if store is not None:
            store.put(one.name, records, load)
    missed = [name for name, ok in verdicts.items() if ok is False]
    undecided = [name for name, ok in verdicts.items() if ok is None]
    if missed:
        print(f"limit missed: {', '.join(missed)}", file=sys.stderr)
    if undecided:
        print(
            f"undecided: {', '.join(undecided)}; run them again on a quiet machine, or with BENCH_BLOCKS=15",
            file=sys.stderr,
        )
    return 1 if missed else 3 if undecided else 0


if __name__ == "__main__":
    sys.exit(main())
