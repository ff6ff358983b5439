"""Streaming: points that arrive one by one, each a period ahead, become one trajectory without stops between them.

MoveIt Servo sends such points to the topic `joint_trajectory`. Each point extends the active goal: the arm passes it
with the velocity of the stream, and settles at the last one when the stream ends.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from heptarm.ros.trajectory.goal import GoalRefused, TrajectoryGoal
from heptarm.ros.trajectory.trajectory import JointTrajectory, KinematicState
from heptarm.values.arrays import Array

#: Longest period of a stream [s]; a single point further ahead is an ordinary trajectory.
_LONGEST_PERIOD = 0.1
#: Largest difference between the time stamp of a streamed point and its arrival [s].
_LARGEST_DELAY = 0.5
#: Least time to a point [s], several cycles of the execution, and the factor by which it grows until the acceleration
#: to the point is small enough.
_LEAST_HORIZON, _GROWTH = 0.03, 1.25
#: The time to a point covers the longest recent gap between two messages with a margin, so that jitter does not show.
_HISTORY, _MARGIN, _LONGEST_GAP = 1.0, 1.5, 0.15
#: Largest distance from the arm to a point [rad]; the stream goes on while the motion that follows it opens.
_LARGEST_JUMP = 0.5
#: Age of the points that the velocity is estimated from [s], and the pause that begins a new stream [s].
_WINDOW, _PAUSE = 0.06, 0.3
#: Least time to settle at the last point [s].
_LEAST_SETTLING = 0.1


def is_streamed(goal: TrajectoryGoal, now: float) -> bool:
    """Whether a goal is a point of a stream: from the topic, a single point, a short period ahead."""
    if not goal.from_topic or len(goal.points) != 1 or not 0.0 < goal.points[0].time <= _LONGEST_PERIOD:
        return False
    return goal.start is None or abs(now - goal.start) <= _LARGEST_DELAY


class PointStream:
    """Makes trajectories through the points of a stream."""

    def __init__(self) -> None:
        self._points: deque[tuple[float, Array]] = deque()

    def extend(
        self, now: float, here: KinematicState, period: float, q: Array, dq: Array | None, acceleration: Array
    ) -> JointTrajectory:
        """Add a point.

        Args:
            now: time of its arrival [s].
            here: state to continue from.
            period: time from one point to the next [s].
            q: its positions, shape (7,) [rad].
            dq: its velocities, shape (7,) [rad/s]; None: estimate them from the stream.
            acceleration: largest one to reach the stream and to settle, shape (7,) [rad/s²].

        Returns:
            From `here` to the point with the velocity of the stream, then back to rest at the point.

        Raises:
            GoalRefused: the point is too far away.
        """
        away = np.abs(q - here.q)
        worst = int(np.argmax(away))
        if away[worst] > _LARGEST_JUMP:
            raise GoalRefused(
                f"a streamed point must be within {_LARGEST_JUMP:g} rad of the arm, "
                f"got {away[worst]:.4f} rad for joint {worst + 1}",
                hint="begin the stream at the current state, or send a trajectory",
            )
        if self._points and now - self._points[-1][0] > _PAUSE:
            self._points.clear()
        self._points.append((now, q))
        while now - self._points[0][0] > _HISTORY:
            self._points.popleft()
        gaps = np.diff([time for time, _ in self._points])
        gap = min(float(gaps.max(initial=period)), _LONGEST_GAP)
        speed = self._speed(period, max(_WINDOW, 2.0 * gap)) if dq is None else dq
        horizon = max(2.0 * period, _LEAST_HORIZON, _MARGIN * gap)
        while (_acceleration(here, q, speed, horizon) > acceleration).any():
            horizon *= _GROWTH
        # a cubic from (q, v) back to (q, 0) within s starts with the acceleration 4 v / s and overshoots by 4 v s / 27
        settling = max(_LEAST_SETTLING, float(np.max(4.0 * np.abs(speed) / acceleration)))
        return JointTrajectory(
            np.array([0.0, horizon, horizon + settling]),
            np.vstack([here.q, q, q]),
            np.vstack([here.dq, speed, np.zeros(7)]),
            np.full((3, 7), np.nan),
        )

    def _speed(self, period: float, window: float) -> Array:
        """Mean velocity of the stream over a window, shape (7,) [rad/s]."""
        end, last = self._points[-1]
        begin, first = next(one for one in self._points if end - one[0] <= window)
        if end - begin < period / 2.0:
            return np.zeros(7)
        return np.asarray((last - first) / (end - begin))


def _acceleration(here: KinematicState, q: Array, speed: Array, horizon: float) -> Array:
    """Largest acceleration of the cubic from a state to a point within a time, shape (7,) [rad/s²]."""
    mean = (q - here.q) / horizon
    begin = 6.0 * mean - 4.0 * here.dq - 2.0 * speed
    end = 2.0 * here.dq + 4.0 * speed - 6.0 * mean
    return np.asarray(np.maximum(np.abs(begin), np.abs(end)) / horizon)
