"""Without the extension an arm is controlled and recorded; what computes in C states what is missing."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.conftest import RunningCabinet

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
}.items():
    try:
        use()
    except Unavailable as error:
        text, hint = error.text, error.hint
    else:
        raise AssertionError(name)
    assert text.startswith("the compiled part of heptarm is missing: ") and chr(10) not in text, text
    assert "make native" in hint
assert compiled_link(None, lambda: 0, left=[], pending={}, spare=[], reading=lock, sending=lock) is None
print("done")
"""
#: What Windows has: the client in Python alone.
_CLIENT = """
import sys
sys.modules["heptarm._native"] = None
import heptarm as ha
from heptarm.panel.model import PanelArm
from heptarm.when import force

_, target, recording = sys.argv
with ha.connect(target, watchdog=5.0, timeout=30.0) as arm:
    with arm.record(recording):
        assert arm.move(ha.ptp([0.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0])).cause is ha.Cause.FINISHED
        assert arm.move(ha.lin_rel(z=-0.02, frame="base"), until=force > 15).cause is ha.Cause.FINISHED
        with arm.servo(rate=50) as sv:
            while sv.tick() and sv.t < 0.3:
                sv.set(sv.start.q + [0, 0, 0, 0, 0, 0, 0.05 * sv.t])
        assert sv.stats.sent > 5
    handle = arm.start(ha.ptp([1.0, 0.5, 0.0, -1.5, 0.0, 1.0, 0.0]), speed=0.1)
    assert handle.wait_started(10.0)
    shown = PanelArm(arm, halt=arm.stop)
    assert shown.poll().is_connected
    shown.stop()
    try:
        handle.wait(timeout=10.0)
    except ha.MotionAborted:
        pass
    else:
        raise AssertionError("the panel stopped nothing")
assert len(ha.load(recording).motions) == 3
print("done")
"""


def test_what_needs_it_reports_so_and_the_rest_works() -> None:
    run = subprocess.run(
        [sys.executable, "-c", _PROGRAM], capture_output=True, text=True, check=False, timeout=120
    )
    assert run.stdout == "done\n", run.stderr


def test_the_client_runs_in_python_alone(cabinet: RunningCabinet, tmp_path: Path) -> None:
    words = [sys.executable, "-c", _CLIENT, cabinet.target, str(tmp_path / "run.mcap")]
    run = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    assert run.stdout == "done\n", run.stderr
