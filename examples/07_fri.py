"""Swing the wrist by an FRI law that runs in a process of its own, and change one of its parameters meanwhile."""

import math
import os
from typing import Any

import heptarm as ha
from heptarm.fri import Output, State


def swing(s: State, out: Output, p: Any) -> None:
    out.q[6] += p.amplitude * (1.0 - math.cos(2.0 * math.pi * p.frequency * s.t)) / 2.0


with ha.connect(os.environ.get("HEPTARM_TARGET", "sim://iiwa14")) as arm:
    arm.move(ha.ptp(ha.deg(0, 30, 0, -90, 0, 60, 0)), speed=0.6)
    parameters = {"amplitude": 0.05, "frequency": 0.5}
    with arm.fri("position", period_ms=5, law=swing, params=parameters) as rt:
        rt.wait(2.0)
        print(f"A7 swings by {max(s.q[6] for s in rt.history()) - rt.start.q[6]:.3f} rad")
        rt.params.amplitude = 0.2
        rt.wait(2.0)
        print(f"A7 swings by {max(s.q[6] for s in rt.history()) - rt.start.q[6]:.3f} rad")
    print(rt.report)
