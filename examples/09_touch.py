"""Find the height of a table by touching it: down until a force is felt, up a little, and once more, slowly."""

import os

import heptarm as ha
from heptarm.when import force

TABLE = "sim://iiwa14?box=0.6,0,0.15,0.4,0.6,0.3"  # a box, 30 cm high
touch = force(frame="base").along("z") > 10


def heights(arm: ha.Arm) -> list[float]:
    """Heights at which the flange touched, the last one at the lowest speed [m]."""
    seen = []
    for speed in (0.05, 0.01):
        result = arm.move(ha.lin_rel(z=-0.4, frame="base", speed_mps=speed), until=touch)
        if result.stopped_by is None or result.fired_at is None:
            raise RuntimeError("there is no table")
        print(f"{result.stopped_by} at {speed * 1e3:.0f} mm/s: {result.fired_at.pose.xyz[2] * 1e3:.1f} mm")
        seen.append(float(result.fired_at.pose.xyz[2]))
        arm.move(ha.lin_rel(z=0.02, frame="base", speed_mps=0.1))
    return seen


with ha.connect(os.environ.get("HEPTARM_TARGET_WITH_TABLE", TABLE)) as arm:
    arm.move(ha.ptp(ha.deg(0, 35, 0, -80, 0, 65, 0)), speed=0.5)
    arm.move(ha.lin_rel(z=0.40 - arm.wait_for_rest().pose.xyz[2], frame="base", speed_mps=0.2))
    assert abs(heights(arm)[-1] - 0.3) < 0.01
