"""Measure the height of a table by touching it twice: fast, then slowly."""

import os

import heptarm as ha

TABLE = "sim://iiwa14?box=0.6,0,0.15,0.4,0.6,0.3"  # a box, 30 cm high

with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_TABLE", TABLE), watchdog=2.0) as arm:
    arm.move(ha.ptp(ha.deg(0, 35, 0, -80, 0, 65, 0)), speed=0.5)
    arm.move(ha.lin_rel(z=0.40 - arm.wait_for_rest().pose.xyz[2], frame="base", speed_mps=0.2))
    contact = arm.touch_twice("-z", frame="base", distance=0.4, force=10, slow_mps=0.01, retreat=0.02)
    assert contact.first is not None
    for name, one in (("fast", contact.first), ("slow", contact)):
        print(f"{name}: {one.pose.xyz[2] * 1e3:.2f} mm, {one.force[2]:.1f} N, {one.result.stopped_by}")
    assert abs(contact.pose.xyz[2] - 0.3) < 0.01
