"""Polish a surface with a constant force, along a path that is 5 mm wrong about where the surface is."""

import os

import numpy as np

import heptarm as ha
from heptarm.modes import pressing

TABLE = "sim://iiwa14?scene=table"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.18))  # the tips, closed
FORCE = 15.0  # [N]
ROWS = np.linspace(-0.06, 0.06, 4)

with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_SCENE", TABLE), watchdog=2.0) as arm, arm.tool(GRIPPER):
    arm.io.set({"OutputX3Pin1": False, "OutputX3Pin2": True})  # close the fingers
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
    down = arm.pose().quat
    arm.move(ha.ptp(ha.Pose.of((0.66, ROWS[0], 0.25), down)), speed=0.5)
    touched = arm.touch("z", distance=0.08, force=5.0, speed_mps=0.02)
    surface = touched.pose.xyz[2]
    path = []
    for index, y in enumerate(ROWS):  # lines along x, up and down; the path sinks by 5 mm from end to end
        ends = (0.66, 0.74) if index % 2 == 0 else (0.74, 0.66)
        path += [ha.Pose.of((x, y, surface - 0.005 * (x - 0.66) / 0.08), down) for x in ends]
    mode = pressing("z", FORCE, along=100.0)
    polishing = arm.start([ha.lin(pose, speed_mps=0.03, blend_m=0.003) for pose in path], mode=mode)
    forces = []
    for state in arm.states():
        if polishing.done:
            break
        if polishing.started:
            forces.append(-arm.wrench(axes="tool", state=state).force[2])
    polishing.wait()
    pressed = np.array(forces[len(forces) // 10 : -len(forces) // 10])
    print(f"{len(pressed)} forces: {pressed.mean():.1f} N, from {pressed.min():.1f} to {pressed.max():.1f} N")
    arm.move(ha.lin_rel(z=0.05, frame="base", speed_mps=0.1))
    assert abs(pressed.mean() - FORCE) < 1.5 and pressed.min() > 0.7 * FORCE
