"""Soak a virtual cabinet: everything at once, for as long as you like.

    python -m bench.trust --minutes 90 --seed 1 --out build/soak

The first third is the warm-up, whose growth of memory does not count: 90 minutes show an hour after it.
Writes one JSON line for each round to OUT/soak.jsonl and a plot to OUT/soak.png, and prints the verdict. It ends with 0
if nothing has grown and nothing was lost.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from bench.trust.soak import soak, summary


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m bench.trust",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--seed", type=int, default=1, help="of every choice")
    parser.add_argument(
        "--out", type=Path, default=Path("build/soak"), help="folder of the samples and the plot"
    )
    options = parser.parse_args()
    verdict = soak(60.0 * options.minutes, seed=options.seed, folder=options.out)
    print(json.dumps(summary(verdict), indent=1))
    return 0 if verdict.good else 1


if __name__ == "__main__":
    sys.exit(main())
