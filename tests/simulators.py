"""Virtual cabinets that run faster than time, for tests that mostly wait for motions to end."""

from __future__ import annotations

#: Cabinet seconds per second. A busy machine keeps up with it, and it costs little more than real time does.
FASTER = 3.0

#: Put before a program that is run as a process: its own virtual cabinets run faster, unless it gives a speed itself.
PATCH = f"""
from dataclasses import replace as _replace
from heptarm.arm.link.local_simulator import PrivateCabinet as _PrivateCabinet
_start = _PrivateCabinet.start
def _start_faster(target, **more):
    if "speed" not in dict(target.options):
        target = _replace(target, options=(*target.options, ("speed", "{FASTER:g}")))
    return _start(target, **more)
_PrivateCabinet.start = _start_faster
"""
