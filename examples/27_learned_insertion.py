"""Insert a peg with a learned policy that feels where the hole is: 0.5 mm of clearance, its place known to 3 mm only.

27_learned_insertion.py [NUMBER [SEED [POLICY.npz]]]     that many insertions, 3 by default, with the included policy
"""

import os
import sys

import numpy as np

import heptarm as ha
from heptarm.rl.contact.peg_in_hole import PegInHole
from heptarm.rl.deploy_contact import deploy_contact
from heptarm.rl.policy import Policy, shipped_contact

PEG_IN_HOLE = "sim://iiwa14?scene=peg-in-hole"
GRIPPER = ha.Tool("two-finger", mass=1.0, com=(0, 0, 0.05), tcp=ha.Pose.at(0, 0, 0.16))
PEG = ha.Workpiece("peg", mass=0.19, com=(0, 0, 0.025), frames={"tip": ha.Pose.at(0, 0, 0.065)})
HOLDER, HOLE = (0.6, -0.1, 0.265), (0.6, 0.1, 0.24)  # the peg's head in its holder, the middle of the rim [m]
NUMBER = int(sys.argv[1]) if len(sys.argv) > 1 else 3
SEED = int(sys.argv[2]) if len(sys.argv) > 2 else 1
policy = Policy.load(sys.argv[3]) if len(sys.argv) > 3 else shipped_contact(PegInHole)

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
    head, hole = ha.Pose.of(HOLDER, down), ha.Pose.of(HOLE, down)
    arm.move(ha.ptp(head.shifted(z=0.1)), speed=0.5)
    arm.move(ha.lin(head, speed_mps=0.1))
    gripper.close()
    assert gripper.holds_something
    with arm.attached(PEG):
        arm.move(ha.lin_rel(z=0.1, frame="base", speed_mps=0.1))
        errors = policy.task.targets(np.random.default_rng(SEED), NUMBER)  # what the policy does not know
        report = deploy_contact(
            arm,
            policy,
            [policy.task.presumed(hole, error) for error in errors],
            errors,
            progress=lambda number, missing: print(f"{number + 1}: {missing * 1e3:.1f} mm missing"),
        )
print(report.summary())
