"""Polish a curved shell with a constant force, along straight lines that do not know of the curve."""

import os
from pathlib import Path

import numpy as np

import heptarm as ha
from heptarm.modes import pressing

SHELL = f"sim://iiwa14?scene={Path(__file__).with_suffix('.xml')}"
HEAD = ha.Tool("polisher", mass=1.0, com=(0, 0, 0.057), tcp=ha.Pose.at(0, 0, 0.14))
FORCE = 15.0  # [N]
ENDS = (0.55, 0.65)  # of the lines along x [m]: the shell is 4 mm lower there than in the middle
LINES = np.linspace(-0.06, 0.06, 4)

with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_SHELL", SHELL), watchdog=2.0) as arm, arm.tool(HEAD):
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
    down = arm.pose().quat
    arm.move(ha.ptp(ha.Pose.of((ENDS[0], LINES[0], 0.27), down)), speed=0.5)
    height = arm.touch("z", distance=0.04, force=5.0, speed_mps=0.02).pose.xyz[2]
    path = []
    for index, y in enumerate(LINES):
        path += [ha.Pose.of((x, y, height), down) for x in (ENDS if index % 2 == 0 else ENDS[::-1])]
    mode = pressing("z", FORCE, along=100.0)
    polishing = arm.start([ha.lin(pose, speed_mps=0.03) for pose in path], mode=mode)
    forces, heights = [], []
    for state in arm.states():
        if polishing.done:
            break
        if polishing.started:
            forces.append(arm.wrench(axes="base", state=state).force[2])
            heights.append(state.pose.xyz[2])
    polishing.wait()
    arm.move(ha.lin_rel(z=0.05, frame="base", speed_mps=0.1))
    middle = forces[len(forces) // 10 : -len(forces) // 10]
    error, lost = np.sqrt(np.mean(np.subtract(middle, FORCE) ** 2)), np.mean(np.abs(middle) < 0.5)
    print(f"{len(middle)} forces: {FORCE:g} N within {error:.2f} N (RMS), {lost:.1%} without contact")
    print(f"the head followed {(max(heights) - min(heights)) * 1e3:.1f} mm of the curve")
    assert error < 1.5 and lost == 0.0
