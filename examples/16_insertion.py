"""Insert a peg into a hole with 0.5 mm of clearance, whose place is known to 3 mm only: by a spiral search under force.

16_insertion.py [NUMBER [SEED]]     that many insertions, 3 by default
"""

import os
import sys

import numpy as np

import heptarm as ha
from heptarm.skills import insert

PEG_IN_HOLE = "sim://iiwa14?scene=peg-in-hole"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
PEG = ha.Workpiece("peg", mass=0.19, com=(0, 0, 0.025), frames={"tip": ha.Pose.at(0, 0, 0.065)})
HOLDER, HOLE = np.array((0.6, -0.1)), np.array((0.6, 0.1))
HEAD, TOP = 0.265, 0.24  # heights of the peg's head in its holder, and of the fixture [m]
NUMBER = int(sys.argv[1]) if len(sys.argv) > 1 else 3
random = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)


def above(xy: np.ndarray, z: float) -> ha.Pose:
    return ha.Pose.of((*xy, z), down)


target = os.environ.get("HEPTARM_TARGET_WITH_PEG_IN_HOLE", PEG_IN_HOLE)
with ha.connect(target, watchdog=2.0) as arm, arm.tool(GRIPPER):
    gripper = ha.TwoSignalGripper(
        arm,
        open="OutputX3Pin1",
        close="OutputX3Pin2",
        is_open="InputX3Pin3",
        is_closed="InputX3Pin4",
    )
    gripper.open()
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
    down = arm.pose().quat
    place, height = HOLDER, HEAD  # where the peg is
    for number in range(1, NUMBER + 1):
        arm.move(ha.ptp(above(place, height + 0.1)), speed=0.5)
        arm.move(ha.lin(above(place, height), speed_mps=0.1))
        gripper.close()
        assert gripper.holds_something
        with arm.attached(PEG):
            arm.move(ha.lin_rel(z=0.1, frame="base", speed_mps=0.1))
            error = random.uniform(-0.003, 0.003, 2)  # what the program does not know
            arm.move(ha.lin(above(HOLE + error, TOP + 0.075), speed_mps=0.2))
            done = insert(arm, "z", depth=0.03, force=10.0, search=ha.spiral(0.0055), distance=0.015)
            gripper.open()
        arm.move(ha.lin_rel(z=0.1, frame="base", speed_mps=0.1))
        peg = arm.operator.where("peg")
        print(
            f"{number}: {(error * 1e3).round(1)} mm off, inserted {done.depth * 1e3:.1f} mm deep after "
            f"{done.duration:.1f} s, the peg's tip is {(peg.xyz * 1e3).round(1)} mm"
        )
        assert np.linalg.norm(peg.xyz[:2] - HOLE) < 0.001 and peg.xyz[2] < TOP - 0.028
        place, height = HOLE, peg.xyz[2] + 0.065  # take it out again
