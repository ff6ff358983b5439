"""Switch a lamp on and off at points of the path, and print the events of the motions."""

import os

import heptarm as ha
from heptarm.do import notify, set_output
from heptarm.values.condition.signals import path

LAMP = "LEDBlue"

with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.5)
    arm.io[LAMP] = False
    across = (
        ha.lin_rel(y=0.2, frame="base", speed_mps=0.1, blend_m=0.02)
        .trigger(path.after(0.05), set_output(LAMP, True))
        .trigger(path.before_end(0.05), notify("corner ahead"))
    )
    up = (
        ha.lin_rel(z=0.1, frame="base", speed_mps=0.1)
        .trigger(path.after(0.05), set_output(LAMP, False))
        .trigger(path.before_end(), notify("on top"))
    )
    handle = arm.start([across, up])
    seen = []
    for event in handle.events():
        print(f"motion {event.item}: {event.kind} {event.label}")
        seen.append(event.label)
    assert handle.wait().arrived and seen.index("corner ahead") < seen.index("on top")
    arm.io.wait(LAMP, False, timeout=10.0)
