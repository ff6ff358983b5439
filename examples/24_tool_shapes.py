"""Give a tool shapes: a path on which it would hit the table is refused, and its tip touches the simulated one."""

import os

import heptarm as ha
from heptarm import shapes

TABLE = 0.16  # height [m]
BOX = f"0.6,0,{TABLE / 2},0.4,0.8,{TABLE}"
PROBE = ha.Tool(
    "probe",
    mass=0.4,
    com=(0, 0, 0.08),
    tcp=ha.Pose.at(0, 0, 0.2),
    shapes=[
        shapes.cylinder(0.03, 0.1, at=ha.Pose.at(0, 0, 0.05)),
        shapes.capsule(0.008, 0.084, at=ha.Pose.at(0, 0, 0.15)),
    ],
)

with ha.connect(os.environ.get("HEPTARM_TARGET", f"sim://iiwa14?box={BOX}")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    with arm.tool(PROBE):
        arm.collision_check = ha.CollisionModel(arm.robot.name, boxes=[BOX])
        try:
            arm.move(ha.lin_rel(z=-0.06, frame="base", speed_mps=0.1))
        except ha.CollisionForeseen as error:
            print("refused:", error.text)
        arm.collision_check = None
        contact = arm.touch("z", distance=0.07, force=6.0)
        print(f"touched with {contact.force[2]:.1f} N at a height of {contact.pose.z * 1e3:.0f} mm")
        arm.move(ha.lin_rel(z=0.08, frame="base", speed_mps=0.1))
