"""Estimate of the setpoint and its velocity after a gap in the messages.

KUKA does not document what a controller does without answers: it may continue with the last velocity, brake, or stop.
The distance it has moved shows which. With constant deceleration from velocity v over the distance d in the time t, the
final velocity is 2 d / t - v: a controller that continued gives v by this formula, and one that stopped gives zero or
a negative value, which means rest. Commands that continue from this estimate have no step in any case.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

#: Largest deviation of a reading from the expected setpoint, in command periods of motion.
MAX_DEVIATION = 3.0


def motion_in_gap(speed: float, distance: float, time: float) -> tuple[float, float]:
    """Motion of an axis, or of a part of a pose along its direction, during a gap.

    Args:
        speed: velocity before the gap [1/s].
        distance: measured distance.
        time: duration of the gap [s].

    Returns:
        The distance, limited to the range from zero to constant velocity; and the velocity after the gap.
    """
    furthest = speed * time
    distance = distance if math.isfinite(distance) else 0.0
    distance = min(max(distance, min(furthest, 0.0)), max(furthest, 0.0))
    later = 2.0 * distance / time - speed
    return distance, min(max(later, min(speed, 0.0)), max(speed, 0.0))


def joints_after_gap(
    commanded: Sequence[float],
    speeds: Sequence[float],
    then: Sequence[float],
    now: Sequence[float],
    *,
    time: float,
    period: float,
    is_exact: bool,
) -> tuple[list[float], list[float]]:
    """Estimate the commanded positions and velocities of the axes after a gap.

    Args:
        commanded: commands for the last message before the gap [rad].
        speeds: velocities of these commands [rad/s].
        then: positions in that message, commanded ones if it has them, otherwise measured ones [rad].
        now: the same positions in the first message after the gap [rad].
        time: time between the two messages [s].
        period: command period [s].
        is_exact: whether the readings are the setpoint except for a lag; otherwise they may deviate permanently.

    Returns:
        Positions [rad] and velocities [rad/s] from which to continue.
    """
    positions, velocities = [], []
    for start, speed, before, after in zip(commanded, speeds, then, now, strict=True):
        distance, velocity = motion_in_gap(speed, after - before, time)
        expected = start + distance
        # the reading lags behind the commands while the axis moves, and no longer once it has stopped
        read = after + (start - before) * (velocity / speed if speed else 0.0)
        near = is_exact and abs(read - expected) <= MAX_DEVIATION * period * abs(speed)
        positions.append(read if near else expected)
        velocities.append(velocity)
    return positions, velocities


def vector_in_gap(
    speed: Sequence[float], displacement: Sequence[float], time: float
) -> tuple[list[float], list[float]]:
    """Motion of a part of a pose during a gap, along its direction before the gap; and its velocity after it.

    Args:
        speed: velocity before the gap, shape (3,) [m/s or rad/s].
        displacement: measured displacement, shape (3,) [m or rad].
        time: duration of the gap [s].
    """
    size = math.sqrt(speed[0] * speed[0] + speed[1] * speed[1] + speed[2] * speed[2])
    if size == 0.0:
        return [0.0] * 3, [0.0] * 3
    x, y, z = (a * b for a, b in zip(speed, displacement, strict=True))
    along = (x + y + z) / size
    distance, velocity = motion_in_gap(size, along, time)
    return [value * distance / size for value in speed], [value * velocity / size for value in speed]
