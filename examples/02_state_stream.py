"""Print the state ten times per second, for one second, while the arm moves."""

import os

import numpy as np

import heptarm as ha

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    handle = arm.start(ha.ptp(ha.deg(30, 30, 0, -90, 0, 60, 0)), speed=0.5)
    for state in arm.states(rate=10, duration=1.0):
        print(np.degrees(state.q).round(1), f"{state.age * 1e3:.1f} ms old, {handle.progress:.0%}")
    print(handle.wait().cause.value)
