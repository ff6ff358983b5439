"""The law of the way `fri`: set-points by the controller's time, so that no process' schedule is in them."""

from __future__ import annotations

import numpy as np

from heptarm.rt import Output, Params, State


def follow(state: State, out: Output, params: Params) -> None:
    """Command the set-point of the controller's time; after the last one brake along the way.

    Args:
        state: the message to answer.
        out: what to command; before the first set-points it stays the interpolator's.
        params: `begin`, the controller's time of the first set-point [s], negative: there are none; `q`, set-points
            a send period apart, shape (n, 7) [rad]; `deceleration` after the last one [rad/s²].
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
