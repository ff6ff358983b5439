"""A program for iiwaPy3, as its users write them: joints, a straight line, a stream. Nothing here is heptarm's.

heptarm bridge kst --target sim://iiwa14
python iiwapy3_moves.py                                 # needs iiwaPy3: the folder of its client is a package
"""

from __future__ import annotations

import math
import sys
import time

from python_client.iiwaPy3 import iiwaPy3

HOME = [math.radians(a) for a in (0, 30, 0, -90, 0, 60, 0)]
NEAR = [q + d for q, d in zip(HOME, (0.1, 0.05, 0.1, 0.1, 0.1, -0.1, 0.2))]


def off(one: list[float], other: list[float]) -> float:
    """Largest difference."""
    return max(abs(a - b) for a, b in zip(one, other))


iiwa = iiwaPy3(sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1")
try:
    iiwa.movePTPJointSpace(NEAR, [0.5])
    print(f"joints: {1e3 * off(iiwa.getJointsPos(), NEAR):.3f} mrad off")

    pose = iiwa.getEEFPos()  # mm, rad
    target = [*pose[:2], pose[2] - 50.0, *pose[3:]]
    iiwa.movePTPLineEEF(target, [100])
    print(f"line: {off(iiwa.getEEFPos()[:3], target[:3]):.3f} mm off")

    start = iiwa.getJointsPos()
    iiwa.realTime_startDirectServoJoints()
    for step in range(1, 101):
        iiwa.sendJointsPositions([q + (h - q) * step / 100 for q, h in zip(start, HOME)])
        time.sleep(0.01)
    time.sleep(0.5)
    iiwa.realTime_stopDirectServoJoints()
    print(f"stream: {1e3 * off(iiwa.getJointsPos(), HOME):.3f} mrad off")
finally:
    iiwa.close()
