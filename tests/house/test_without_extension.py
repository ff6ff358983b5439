"""Without the extension values, wire and errors work, and what computes in C states in one sentence what is missing."""

from __future__ import annotations

import subprocess
import sys

_PROGRAM = """
import sys
sys.modules["heptarm._native"] = None
import heptarm.errors, heptarm.values.pose, heptarm.values.motion, heptarm.wire.messages, heptarm.wire.session
from heptarm.values.pose import Pose
from heptarm.values.robot import robot
from heptarm.wire.messages import Stop
assert not any(name.startswith("heptarm.model.native") for name in sys.modules)
assert Pose.at(1.0) @ Pose.at(1.0) == Pose.at(2.0) and Stop.decode(Stop().encode()) == Stop()

import heptarm.model as model, numpy as np
from heptarm._library import Unavailable
from heptarm.fri.loop.client import Client
from heptarm.io.tcp import connect, listening
from heptarm.laws.ready import shared_library
from heptarm.sim.plant.plant import Plant
from heptarm.io.exchange import compiled_link
import threading
lock = threading.Lock()
for name, use in {
    "model": lambda: model.forward(robot("iiwa7"), [0.0] * 7),
    "dynamics": lambda: model.gravity(robot("iiwa7"), [0.0] * 7),
    "FRI": lambda: Client(0, realtime=False),
    "laws": shared_library,
    "plant": Plant,
    "link": lambda: compiled_link(None, lambda: 0, left=[], pending={}, spare=[], reading=lock, sending=lock),
}.items():
    try:
        use()
    except Unavailable as error:
        text, hint = error.text, error.hint
    else:
        raise AssertionError(name)
    assert text.startswith("the compiled part of heptarm is missing: ") and chr(10) not in text, text
    assert "make native" in hint
print("done")
"""


def test_what_needs_it_reports_so_and_the_rest_works() -> None:
    run = subprocess.run(
        [sys.executable, "-c", _PROGRAM], capture_output=True, text=True, check=False, timeout=120
    )
    assert run.stdout == "done\n", run.stderr
