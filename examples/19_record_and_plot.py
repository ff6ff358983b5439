"""Record two motions, print what the recording contains, and plot it."""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

import heptarm as ha

folder = Path(tempfile.mkdtemp())
camera = ha.Camera(size=(320, 240)) if "--pictures" in sys.argv else None  # draws a model of the arm
with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)))
    with arm.record(folder / "run.mcap", rate=500, camera=camera) as rec:
        rec.note("there")
        arm.move(ha.lin_rel(y=0.1, frame="base", speed_mps=0.2))
        rec.note("back")
        arm.move(ha.lin_rel(y=-0.1, frame="base", speed_mps=0.2))

run = ha.load(folder / "run.mcap")
print(run)
print(*run.motions, sep="\n")
there = run.between("there", "back")
print(f"fastest axis on the way there: {np.degrees(np.abs(there['dq']).max()):.1f} deg/s")
run.plot("q", "dq", "path").savefig(folder / "run.png")
print(f"plotted in {folder / 'run.png'}")
if camera is not None:
    print(f"{len(run.pictures.save(folder))} pictures in {folder}")
