"""Stop at a collision, print the joint and its torque, and react with compliance."""

import os

import heptarm as ha
from heptarm.values.mode.impedance import JointImpedance

TABLE = "sim://iiwa14?box=0.6,0,0.15,0.4,0.6,0.3"  # a box in the path of the arm

with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_TABLE", TABLE), watchdog=2.0) as arm:
    arm.move(ha.ptp(ha.deg(0, 35, 0, -80, 0, 65, 0)), speed=0.5)
    arm.wait_for_rest()
    try:
        with arm.guarded(arm.collision_guard(12.0)):
            arm.move(ha.lin_rel(z=-0.4, frame="base", speed_mps=0.05))
        raise RuntimeError("nothing was in the way")
    except ha.CollisionDetected as error:
        print(error)
    arm.move(ha.hold(0.5), mode=JointImpedance(stiffness=100.0))
    arm.move(ha.lin_rel(z=0.03, frame="base", speed_mps=0.1))
    print(f"at rest again, {arm.wait_for_rest().pose.xyz[2] * 1e3:.0f} mm high")
