"""FRI law of the execution `fri`: set-points by controller time, independent of the scheduling of any process."""

from __future__ import annotations

import numpy as np

from heptarm.fri.loop.user_api import Output, Params, State


def follow(state: State, out: Output, params: Params) -> None:
    """Command the set-point of the current controller time; after the last one brake along the path.

    Args:
        state: the message to answer.
        out: the command; before the first set-points it stays that of the interpolator.
        params: `begin`, controller time of the first set-point [s], negative: there is none; `q`, set-points one
            send period apart, shape (n, 7) [rad]; `deceleration` after the last one [rad/s²].
    """
    if params.begin < 0.0:
        return
    q, period = params.q, state.period
    row, last = round((state.t - params.begin) / period), len(q) - 1
    if row <= last:
        out.q[:] = q[max(row, 0)]
        return
    speed = (q[last] - q[last - 1]) / period
    braking = float(np.abs(speed).max()) / params.deceleration
    passed = min((row - last) * period, braking)
    out.q[:] = q[last] + speed * (passed - passed * passed / (2.0 * braking) if braking else 0.0)
