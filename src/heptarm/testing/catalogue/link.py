"""Scenarios: the connection between this program and the cabinet."""

from __future__ import annotations

import time

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.errors import ConnectionLost
from heptarm.testing.measure import below, fresh, holds, near, note
from heptarm.testing.scenario import Risk, scenario
from heptarm.testing.stage import HOME
from heptarm.values.motion.ptp import ptp
from heptarm.values.pose import deg

_QUESTIONS = 100


@scenario(line=9, rows="O1 O3 O11", risk=Risk.STILL)
def round_trip(arm: Arm) -> None:
    """Round-trip time of a request."""
    times = []
    for _ in range(_QUESTIONS):
        began = time.perf_counter()
        arm.set_override(1.0)
        times.append(time.perf_counter() - began)
    median, late = np.percentile(times, [50, 99])
    note(f"median {median * 1e3:.2f} ms, 99 of 100 within {late * 1e3:.2f} ms")
    # Nagle's delay alone would be 0.04 s each time; a busy machine is slow only now and then
    below(min(times), 0.02, "fastest of 100 round trips", unit="s")


@scenario(line=9, rows="O9 G21", risk=Risk.STILL)
def clock(arm: Arm) -> None:
    """The age of a state is known without synchronised clocks: the session compares the two clocks."""
    ages = [state.age for state in arm.states(duration=0.3)]
    # a busy machine makes states older; a wrong difference of the clocks shows in all of them
    below(
        float(np.abs(ages).min()), 0.05 * max(arm.real_time_factor, 1.0), "smallest age of a state", unit="s"
    )


@scenario(line=10, rows="O6 O7 O8 O10", risk=Risk.FAULT, virtual=True, space=0.5, needs=("ptp",))
def lost(arm: Arm) -> None:
    """When the connection breaks during a motion, the arm stops, both sides report it, and the client reconnects."""
    handle = arm.start(ptp(HOME + deg(50, 0, 0, 0, 0, 0, 0), speed=0.1))
    arm.wait_until(lambda s: abs(s.q[0] - HOME[0]) > 0.02, timeout=20.0)
    arm.connection.link.cut()
    try:
        handle.wait(timeout=20.0)
        holds(False, "the motion ends with an error")
    except ConnectionLost as error:
        note(error.text)
    recovery = arm.recover(timeout=20.0)
    holds(recovery.done and arm.in_control, f"recovered: {recovery}")
    rests = arm.wait_for_rest()
    holds(
        0.01 < rests.q[0] < np.radians(45),
        f"the arm stopped on its path, at {np.degrees(rests.q[0]):.1f} deg",
    )
    near(fresh(arm).q, rests.q, 1e-3, "and rests there", unit="rad")
