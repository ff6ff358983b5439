"""Follow pose targets on straight lines, along a square whose next corner the program chooses while the arm moves."""

import os

import heptarm as ha

CORNERS = [(0.0, 0.06, 0.0), (0.0, 0.06, 0.06), (0.0, 0.0, 0.06), (0.0, 0.0, 0.0)]

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    with arm.servo("lin", rate=50, speed_mps=0.15, acceleration_mps2=1.0, watchdog=0.5) as sv:
        start = sv.start.pose
        for corner in CORNERS:
            goal = ha.Pose.of(start.xyz + corner, start.quat)
            while sv.tick() and arm.state.pose.distance_to(goal) > 2e-3:
                sv.set(goal)
            print(f"{sv.t:4.1f} s: corner {corner}")
    print(f"{sv.stats.sent} targets, {sv.stats.refused} refused")
