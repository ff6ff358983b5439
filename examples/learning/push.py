"""Push a puck to goals with the included policy, which sees where the puck is; on a real arm a camera would.

push.py [NUMBER [SEED [POLICY.npz]]]     that many pushes, 3 by default
"""

import sys
from pathlib import Path

import numpy as np

import heptarm as ha
from heptarm import shapes
from heptarm.rl.contact.push import Push
from heptarm.rl.deploy_contact import deploy_contact
from heptarm.rl.policy import Policy, shipped_contact

NUMBER = int(sys.argv[1]) if len(sys.argv) > 1 else 3
SEED = int(sys.argv[2]) if len(sys.argv) > 2 else 1
policy = Policy.load(sys.argv[3]) if len(sys.argv) > 3 else shipped_contact(Push)
ROD = ha.Tool(
    "rod",
    mass=0.3,
    com=(0, 0, 0.1),
    frames={"tip": ha.Pose.at(0, 0, 0.2)},
    shapes=[shapes.capsule(0.01, 0.17, at=ha.Pose.at(0, 0, 0.105))],
)

scene = Path(__file__).with_name("push.xml")
with ha.connect(f"sim://iiwa14?scene={scene}", watchdog=2.0) as arm, arm.tool(ROD):
    arm.move(ha.ptp(ha.deg(0, 25, 0, -90, 0, 65, 0)), speed=0.5)
    pushed = 0
    for goal in policy.task.targets(np.random.default_rng(SEED), NUMBER):
        arm.operator.place("puck", Push.origin @ ha.Pose.at(goal[0], goal[1], -0.015))
        report = deploy_contact(
            arm, policy, Push.origin, [goal], bodies=lambda: {"puck": arm.operator.where("puck")}
        )
        pushed += int(report.success[0])
        print(f"{1e3 * report.mean:.1f} mm from the goal")
print(f"{pushed} of {NUMBER} pucks within {1e3 * policy.task.radius:.0f} mm of their goals")
