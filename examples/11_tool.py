"""A gripper that a client defines: its tip moves, its weight is not felt, and what it holds is not felt either."""

import os

import heptarm as ha

GRIPPER = ha.Tool("gripper", mass=1.2, com=(0, 0, 0.06), tcp=ha.Pose.at(0, 0, 0.15))
PART = ha.Workpiece("part", mass=0.5, com=(0, 0, 0.02))


def load(arm: ha.Arm) -> str:
    """What A2 has to hold, and what it takes for an external force [Nm]."""
    arm.move(ha.hold(0.5))
    return f"A2 holds {arm.state.tau[1]:6.1f} Nm, of which {abs(arm.state.tau_ext[1]):.1f} Nm from outside"


with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    print("bare:    ", load(arm))
    with arm.tool(GRIPPER):
        print("gripper: ", load(arm))
        tip = arm.state.pose
        arm.move(ha.lin(tip @ ha.Pose.xyz_abc(0, 0, 0, *ha.deg(0, 20, 0)), speed_radps=0.5))
        print(f"turned about its tip, which moved by {arm.state.pose.distance_to(tip) * 1e3:.2f} mm")
        with arm.attached(PART):
            print("and part:", load(arm))
