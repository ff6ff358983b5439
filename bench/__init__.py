"""Figures of heptarm; black boxes of what they abort on purpose go to build/black-box, not to the user's folder."""

import os
from pathlib import Path

os.environ.setdefault("HEPTARM_BLACK_BOX", str(Path(__file__).resolve().parents[1] / "build" / "black-box"))
