"""Evaluates the files of Recorder: python read.py FOLDER."""

import csv
import math
import pathlib
import sys

folder = pathlib.Path(sys.argv[1])
names, *rows = [line.split() for line in (folder / "path.log").read_text().splitlines()]
table = {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}
time, x, y, z = (table[name] for name in ("time", "position_X", "position_Y", "position_Z"))
speed = [
    math.dist((x[i], y[i], z[i]), (x[i + 4], y[i + 4], z[i + 4])) / (time[i + 4] - time[i])
    for i in range(len(time) - 4)
]
print(f"{len(time)} samples, one in {1000 * (time[-1] - time[0]) / (len(time) - 1):.0f} ms")
print(f"starts {y[0] - y[-1]:.0f} mm after the start of the path")
print(f"fastest {max(speed):.0f} mm/s")
print(f"A7 turns by {max(table['jointPosition_A7']) - min(table['jointPosition_A7']):.1f} deg")
with open(folder / "samples.csv", newline="") as file:
    samples = list(csv.DictReader(file, delimiter=";"))
print(f"{len(samples)} rows, all forces valid: {all(row['valid'] == 'true' for row in samples)}")
