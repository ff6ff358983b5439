"""Pick three parts out of one bin and place them into another, with a gripper behind two signals."""

import os

import heptarm as ha

BINS = "sim://iiwa14?scene=bins"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
PART = ha.Workpiece("cube", mass=0.08)
PARTS = [(0.53, 0.20), (0.61, 0.15), (0.61, 0.25)]  # where they are [m]
PLACES = [(0.53, -0.20), (0.61, -0.15), (0.61, -0.25)]
GRASP, ABOVE = 0.232, 0.36  # heights of the tip: between the walls of a bin, and above them

with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_BINS", BINS), watchdog=2.0) as arm, arm.tool(GRIPPER):
    gripper = ha.TwoSignalGripper(
        arm,
        open="OutputX3Pin1",
        close="OutputX3Pin2",
        is_open="InputX3Pin3",
        is_closed="InputX3Pin4",
    )
    gripper.open()
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
    down = arm.pose().quat  # the fingers open along the base's y
    for (x, y), (to_x, to_y) in zip(PARTS, PLACES):
        arm.move(ha.ptp(ha.Pose.of((x, y, ABOVE), down)), speed=0.5)
        arm.move(ha.lin(ha.Pose.of((x, y, GRASP), down), speed_mps=0.15))
        gripper.close()
        assert gripper.holds_something, f"no part at x={x}, y={y}"
        with arm.attached(PART):
            arm.move(ha.lin_rel(z=ABOVE - GRASP, frame="base", speed_mps=0.25))
            arm.move(ha.ptp(ha.Pose.of((to_x, to_y, ABOVE), down)), speed=0.4)
            arm.move(ha.lin(ha.Pose.of((to_x, to_y, GRASP + 0.002), down), speed_mps=0.15))
        gripper.open()
        arm.move(ha.lin_rel(z=ABOVE - GRASP, frame="base", speed_mps=0.25))
        print(f"placed at x={to_x}, y={to_y}")
    for number, (x, y) in enumerate(PLACES, 1):  # look into the simulator's world
        part = arm.operator.where(f"part_{number}")
        print(f"part_{number}: {part.xyz.round(3)}")
        assert part.distance_to(ha.Pose.of((x, y, 0.226))) < 0.01
