"""Guide the arm by hand, save the trajectory and replay it. On a simulator this program pushes the arm."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread

import numpy as np

import heptarm as ha


def person(arm: ha.Arm) -> None:
    """Hold the switch of the hand guiding device, push until a joint has turned by 10 degrees, release the switch."""
    arm.wait_until(lambda state: state.motion is not None and state.motion.active)
    start = arm.state.q
    arm.operator.guide()
    arm.operator.start_push([0, 8, 5], duration=60.0)
    arm.wait_until(lambda state: np.abs(state.q - start).max() > np.radians(10))
    arm.operator.start_push([0, 0, 0], duration=0.0)
    arm.operator.let_go()


with ha.connect(os.environ.get("HEPTARM_TARGET_TO_GUIDE", "sim://iiwa14"), watchdog=2.0) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.5)
    arm.wait_for_rest()
    if arm.is_virtual:
        Thread(target=person, args=(arm,)).start()
    whole = arm.teach(ha.hand_guide(joint_velocity=0.5), timeout=50.0)

    taught = whole.trimmed().thinned()
    print(f"{whole.duration:.1f} s were recorded, {len(taught)} of {len(whole)} points are kept")
    with TemporaryDirectory() as folder:
        file = taught.save(Path(folder) / "taught.npz")
        replay = arm.replay(ha.Trajectory.load(file), by="spline", speed_scaling=0.5)
    print(f"{replay.result.cause.value}, {np.degrees(replay.deviation):.2f} deg largest deviation")
