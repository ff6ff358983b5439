"""Benchmarks: measure the figures that heptarm states. `python -m bench` prints them.

Each folder is a group of benchmarks: `protocol`, `state`, `lab`, `servo`, `motion`, `calibration`, `safety`,
`simulator`, `fri`, `ros`, `rl`. `measure` has their common parts: the figure record, blocks under a placement, the
store. `results` holds stored runs and the text from which `scripts/figures_page.py` makes
docs/explanation/figures.md; `java` holds a floor in Java. Black boxes of what a benchmark aborts on purpose go to
build/black-box, not to the user's folder.
"""

import os
from pathlib import Path

os.environ.setdefault("HEPTARM_BLACK_BOX", str(Path(__file__).resolve().parents[1] / "build" / "black-box"))
