"""Define and attach a gripper and a workpiece: motions refer to its tip, and their weights are compensated."""

import os

import heptarm as ha

GRIPPER = ha.Tool("gripper", mass=1.2, com=(0, 0, 0.06), tcp=ha.Pose.at(0, 0, 0.15))
PART = ha.Workpiece("part", mass=0.5, com=(0, 0, 0.02))


def load(arm: ha.Arm) -> str:
    """Measured torque of A2, and how much of it counts as external [Nm]."""
    arm.move(ha.hold(0.5))
    return f"torque of A2 {arm.state.tau[1]:6.1f} Nm, external {abs(arm.state.tau_ext[1]):.1f} Nm"


with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    print("no tool: ", load(arm))
    with arm.tool(GRIPPER):
        print("gripper: ", load(arm))
        tip = arm.state.pose
        arm.move(ha.lin(tip @ ha.Pose.xyz_abc(0, 0, 0, *ha.deg(0, 20, 0)), speed_radps=0.5))
        print(f"turned about its tip, which moved by {arm.state.pose.distance_to(tip) * 1e3:.2f} mm")
        with arm.attached(PART):
            print("and part:", load(arm))
