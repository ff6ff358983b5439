"""Prints the table of docs/explanation/where-the-time-goes.md."""

from __future__ import annotations

import numpy as np

from bench.speed.request import PARTS, parts

if __name__ == "__main__":
    measured = {name: float(np.median(values)) for name, values in parts().items()}
    print("| part of a request | µs |\n|---|---|")
    for name, text in (PARTS | {"request_whole": "the whole request"}).items():
        print(f"| {text} | {measured[name]:.1f} |")
