"""What brakes last brakes within limits: a session ends at speed towards a joint limit, in every manner it can."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.fri.guard.joint_guard import Limits
from tests.long import longer
from tests.sim_fri.lockstep import Lockstep

#: A6 is this far from where it is turned to; it then passes 0.5 to 2.5 rad/s on its way to the limit at 120°.
START = (0.0, 0.4, 0.0, -1.2, 0.0, 0.6, 0.0)
#: The other axes move as well, and faster than A6: a stop along one common direction would brake A6 too weakly.
TARGET = np.array((1.5, 0.4, 1.5, -1.2, 2.5, 4.0, -2.5))


@pytest.mark.parametrize(
    ("manner", "period"),
    longer(
        [("leave", 1), ("stop", 5), ("close", 10), ("silence", 1), ("silence", 10)],
        [(manner, period) for manner in ("leave", "stop", "close", "silence") for period in (1, 5, 10)],
    ),
)
def test_the_end_of_a_session_passes_no_limit(manner: str, period: int) -> None:
    for moment in (0.25, 0.5, 0.7):  # while it accelerates, at full speed, while it brakes before the limit
        session = Lockstep(q=START, period_ms=period)
        limits = Limits.of(session.plant.robot)
        session.command(TARGET)
        session.run(moment)
        before = session.plant.snapshot.q_cmd[5]
        session.end(manner)
        session.run(1.0)
        reached = np.array([one.q_cmd[5] for one in session.track])
        assert reached[-1] > before, "it was moving towards the limit"
        # the guard's own limit, one degree before the robot's; between its commands the cabinet interpolates
        assert reached.max() <= limits.q_max[5] + (1e-3 if period == 1 else 5e-3), np.degrees(reached.max())
        assert np.ptp(reached[-50:]) < 1e-6, "and it has come to rest"
        measured = np.array([one.q[5] for one in session.track])
        assert measured.max() <= session.plant.robot.q_max[5]
