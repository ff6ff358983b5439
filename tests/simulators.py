"""How tests run programs for users: patiently, and with virtual cabinets that run faster than time."""

from __future__ import annotations

#: Cabinet seconds per second, where nothing depends on real time: tests mostly wait for motions to end. A busy machine
#: that cannot keep up with it is slower, and no test depends on that. A simulated second costs little more than half of
#: what one costs in real time: fewer threads wake up for each tick.
FASTER = 5.0

#: Put before a program that is run as a process: connections that it makes are patient, for a busy machine is silent
#: for longer than the watchdog time that a user gets without asking.
PATIENT = """
import heptarm.arm.connect as _module
_module.connect.__kwdefaults__.update(watchdog=5.0, timeout=30.0)
"""

#: The same, and its own virtual cabinets run faster, unless it gives a speed itself.
PATIENT_AND_FASTER = (
    PATIENT
    + f"""
from dataclasses import replace as _replace
from heptarm.arm.link.local_simulator import PrivateCabinet as _PrivateCabinet
_start = _PrivateCabinet.start
def _start_faster(target, **more):
    if "speed" not in dict(target.options):
        target = _replace(target, options=(*target.options, ("speed", "{FASTER:g}")))
    return _start(target, **more)
_PrivateCabinet.start = _start_faster
"""
)
