"""Move along a square of four straight lines as one program, and print the distance between start and end."""

import os

import heptarm as ha

SIDE = 0.1  # m

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    start = arm.wait_for_rest().pose
    sides = ((0, SIDE), (SIDE, 0), (0, -SIDE), (-SIDE, 0))
    arm.move([ha.lin_rel(x=x, y=y, frame="base", speed_mps=0.25) for x, y in sides])
    print(f"closed within {start.distance_to(arm.wait_for_rest().pose) * 1e3:.3f} mm")
