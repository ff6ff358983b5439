"""Connect, move, and print the pose of the flange."""

import os

import heptarm as ha

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    result = arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.5)
    print(result.cause.value, f"after {result.duration:.2f} s")
    print(arm.wait_for_rest().pose)
