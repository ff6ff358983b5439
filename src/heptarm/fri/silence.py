"""After a silence: where the set-point of an arm is that nobody has commanded meanwhile, and how fast it moves.

What a controller does without answers is not published: it may go on with the last speed, brake, or stand. How far it
has come tells it. With a constant deceleration from speed v over the way w in the time t, the speed at the end is
2 w / t - v; a controller that went on has kept its speed by that formula, and one that stands gives none or a negative
one, which means rest. Commanding that goes on from there has no step, whatever the controller did.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

#: A reading so many command periods beside what is expected is not that of the set-point.
BESIDE = 3.0


def speed_after(speed: float, way: float, time: float) -> tuple[float, float]:
    """How an axis, or a part of a pose along its direction, was carried on.

    Args:
        speed: before the silence [1/s].
        way: how far it has come, as it was read.
        time: how long nothing was heard [s].

    Returns:
        The way that is possible, between none and all of it at the old speed; and the speed now.
    """
    furthest = speed * time
    way = min(max(way, min(furthest, 0.0)), max(furthest, 0.0))
    later = 2.0 * way / time - speed
    return way, min(max(later, min(speed, 0.0)), max(speed, 0.0))


def carried_on(
    chain: Sequence[float],
    speeds: Sequence[float],
    then: Sequence[float],
    now: Sequence[float],
    *,
    time: float,
    period: float,
    is_exact: bool,
) -> tuple[list[float], list[float]]:
    """Where axes are commanded to be after a silence, and how fast.

    Args:
        chain: what was commanded for the last message before the silence [rad].
        speeds: of the commands then [rad/s].
        then: what that message named: commanded positions, or measured ones where it has no others [rad].
        now: what the first message after the silence names [rad].
        time: between the two [s].
        period: of the commands [s].
        is_exact: the readings are those of the set-point but for a lag; else they may be beside it for good.

    Returns:
        Positions [rad] and speeds [rad/s] from which commanding goes on.
    """
    places, later = [], []
    for start, speed, before, after in zip(chain, speeds, then, now, strict=True):
        way, kept = speed_after(speed, after - before, time)
        expected = start + way
        # the reading lags behind the chain while the axis moves, and no more once it stands
        read = after + (start - before) * (kept / speed if speed else 0.0)
        near = is_exact and abs(read - expected) <= BESIDE * period * abs(speed)
        places.append(read if near else expected)
        later.append(kept)
    return places, later


def part_carried_on(
    speed: Sequence[float], way: Sequence[float], time: float
) -> tuple[list[float], list[float]]:
    """The way of a part of a pose in a silence, along the direction in which it moved, and its speed now.

    Args:
        speed: before the silence, shape (3,) [m/s or rad/s].
        way: as it was read, shape (3,) [m or rad].
        time: how long nothing was heard [s].
    """
    size = math.sqrt(sum(value * value for value in speed))
    if size == 0.0:
        return [0.0] * 3, [0.0] * 3
    along = sum(a * b for a, b in zip(speed, way, strict=True)) / size
    gone, kept = speed_after(size, along, time)
    return [value * gone / size for value in speed], [value * kept / size for value in speed]
