"""Swing the wrist with a stream of targets that are computed while the arm moves."""

import os

import numpy as np

import heptarm as ha

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    with arm.servo("joint", rate=100, speed=0.5, acceleration=1.0, watchdog=0.5) as sv:
        while sv.tick() and sv.t < 3.0:
            swing = 0.3 * np.sin(2.0 * sv.t)
            sv.set(sv.start.q + [0, 0, 0, 0, 0, swing, swing])
    stats = sv.stats
    print(f"{stats.sent} targets at {stats.rate:.0f} Hz, {stats.late_ticks} late ticks")
    print(f"age when applied: median {stats.age_median * 1e3:.2f} ms")
