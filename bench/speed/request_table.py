"""Prints the table of docs/explanation/where-the-time-goes.md, and how busy the machine was meanwhile.

The fastest tenth stays about the same on a machine that does other things at the same time; the median does not.
"""

from __future__ import annotations

import os

import numpy as np

from bench.speed.request import PARTS, parts

if __name__ == "__main__":
    found, noise = parts()
    measured = {name: np.median(values, axis=0).tolist() for name, values in found.items()}
    print("| part of a request | fastest tenth [µs] | median [µs] |\n|---|---|---|")
    for name, text in (PARTS | {"request_whole": "the whole request"}).items():
        fastest, median = measured[name]
        print(f"| {text} | {fastest:.1f} | {median:.1f} |")
    state = "other processes were busy" if noise.is_noisy else "the machine was quiet"
    print(f"\n{state}; load average {os.getloadavg()[0]:.1f}")
