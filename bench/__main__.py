"""Prints the figures that heptarm promises, one JSON object a line.

python -m bench                 all of them
python -m bench --only NAME     one
python -m bench --list          their names
"""

from __future__ import annotations

import argparse
import json
import sys

from bench import (  # noqa: F401  they register themselves
    fri_codec,
    fri_faults,
    fri_guard,
    fri_hold,
    fri_loop,
    garbage,
    inverse,
    life,
    lost_client,
    motion,
    paths,
    rl,
    rl_deploy,
    ros,
    round_trip,
    servo,
    state_push,
    stopping,
)
from bench.registry import BENCHMARKS


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("--only", metavar="NAME", help="run one benchmark")
    parser.add_argument("--list", action="store_true", help="name the benchmarks")
    options = parser.parse_args()
    if options.list:
        for name, one in BENCHMARKS.items():
            print(f"{name:16} {one.line:5} {one.doc}")
        return 0
    if options.only and options.only not in BENCHMARKS:
        print(f"no benchmark {options.only!r}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    failed = 0
    for name, one in BENCHMARKS.items():
        if options.only not in (None, name):
            continue
        for figure in one.run():
            failed += not figure.ok
            print(json.dumps(figure.as_dict(), ensure_ascii=False), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
