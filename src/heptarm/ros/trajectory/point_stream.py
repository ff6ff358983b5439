"""Streaming: messages that arrive at a high rate become one trajectory without stops between them.

There are two kinds. A *point* is a single one, a period ahead, such as teleoperation nodes and older versions of MoveIt
Servo send. A *window* is a few points around the present with a time stamp, such as MoveIt Servo sends since 2.9: each
message repeats the points of the last one and adds one at the end. Either extends the active goal: the arm passes the
points with the velocity of the stream, and settles at the last one when the stream ends.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection

import numpy as np

from heptarm.ros.trajectory.goal import GoalRefused, TrajectoryGoal
from heptarm.ros.trajectory.send_times import PublishInfo, SendTimes
from heptarm.ros.trajectory.trajectory import JointTrajectory, KinematicState
from heptarm.values.checks import Array
from heptarm.values.robot import RobotModel

#: Longest period of a stream of points [s], and longest window; what ends later is an ordinary trajectory.
_LONGEST_PERIOD, _LONGEST_WINDOW = 0.1, 0.5
#: Largest difference between the time stamp of a message and its arrival [s].
_LARGEST_DELAY = 0.5
#: Least time to a point [s], several cycles of the execution, and the factor by which it grows until the acceleration
#: to the point is small enough; longest time to it.
_LEAST_HORIZON, _GROWTH, _LONGEST_HORIZON = 0.06, 1.25, 2.0
#: The time to a point covers the longest recent gap between two messages with a margin, so that jitter does not show.
_HISTORY, _MARGIN, _LONGEST_GAP = 1.0, 1.5, 0.15
#: Largest distance from the arm to a point [rad]; the stream goes on while the motion that follows it opens.
_LARGEST_JUMP = 0.5
#: Age of the points that position and velocity are estimated from [s], and the pause that begins a new stream [s].
_WINDOW, _PAUSE = 0.06, 0.3
#: Least time to settle at the last point [s].
_LEAST_SETTLING = 0.1
#: Largest velocity that counts as rest [rad/s].
_REST = 1e-6


def is_streamed(goal: TrajectoryGoal, now: float) -> bool:
    """Whether a goal belongs to a stream: from the topic, and it ends a short time from now."""
    if not goal.from_topic or not goal.points:
        return False
    if goal.start is not None and abs(now - goal.start) > _LARGEST_DELAY:
        return False
    longest = _LONGEST_PERIOD if len(goal.points) == 1 else _LONGEST_WINDOW
    return 0.0 < goal.points[-1].time <= longest


class PointStream:
    """Makes trajectories through the points of a stream.

    Args:
        robot: its limits.
    """

    def __init__(self, robot: RobotModel) -> None:
        self._robot = robot
        self._points: deque[tuple[float, Array]] = deque()  # when they were sent, and where they are
        self._arrivals: deque[float] = deque()
        self._times = SendTimes()

    def add_point(
        self,
        now: float,
        begin: float,
        here: KinematicState,
        period: float,
        q: Array,
        dq: Array | None,
        acceleration: Array,
        sent: PublishInfo | None = None,
    ) -> JointTrajectory:
        """Continue through a point that the arm is to reach a period after it was sent.

        The arm needs longer than a period to join the stream smoothly. So the trajectory leads to where the stream will
        be then, by its velocity: the arm follows without lag as long as that does not change.

        Args:
            now: time of its arrival [s].
            begin: time 0 of the trajectory, the last step of the execution [s].
            here: state to continue from.
            period: time from one point to the next [s].
            q: its positions, shape (7,) [rad].
            dq: its velocities, shape (7,) [rad/s]; None: estimate them from the stream.
            acceleration: largest one to reach the stream and to settle, shape (7,) [rad/s²].
            sent: when or as which its message was published; None: points count from their arrival.

        Returns:
            From `here` to the stream, then back to rest at the point.

        Raises:
            GoalRefused: the point is too far away.
        """
        _check_distance(here, q)
        if self._arrivals and now - self._arrivals[-1] > _PAUSE:
            self._points.clear()
            self._arrivals.clear()
            self._times.restart()
        time, pause = self._times.add(now, period, sent)
        if pause > _LONGEST_GAP or (pause > 0.0 and np.abs(here.dq).max() < _REST):
            self._arrivals.clear()  # nothing was sent: that was no jitter
        self._arrivals.append(now)
        if pause:
            self._points = deque((then + pause, place) for then, place in self._points)
        while self._points and self._points[-1][0] >= time:
            self._points.pop()  # of an earlier count
        self._points.append((time, q))
        while now - self._arrivals[0] > _HISTORY:
            self._arrivals.popleft()
        while time - self._points[0][0] > _HISTORY:
            self._points.popleft()
        gap = _longest_gap(self._arrivals, period)
        place, speed = self._fit(
            period, max(_WINDOW, 2.0 * _longest_gap([then for then, _ in self._points], period))
        )
        speed = speed if dq is None else dq
        horizon = max(2.0 * period, _LEAST_HORIZON, _MARGIN * gap)
        while True:
            aim, velocity = self._ahead(q, place, speed, begin - time + horizon - period)
            excess = (_acceleration(here, aim, velocity, horizon) > acceleration).any()
            if not excess or horizon > _LONGEST_HORIZON:
                break
            horizon *= _GROWTH
        return self._settled(here, np.array([horizon]), aim[None], velocity[None], q, acceleration)

    def add_window(
        self, here: KinematicState, times: Array, q: Array, dq: Array | None, acceleration: Array
    ) -> JointTrajectory:
        """Continue through a window of points.

        Args:
            here: state to continue from.
            times: of the points from now on, increasing, shape (n,) [s]; those of the past are left out.
            q: their positions, shape (n, 7) [rad].
            dq: their velocities, shape (n, 7) [rad/s]; None: differences of the positions.
            acceleration: largest one to reach the stream and to settle, shape (7,) [rad/s²].

        Returns:
            From `here` to the first point that can be reached smoothly, through the others, then to rest at the last.

        Raises:
            GoalRefused: the points are too far away, or all in the past.
        """
        if times[-1] <= 0.0:
            raise GoalRefused(
                f"the last of {len(times)} streamed points must be in the future, got {-times[-1]:.3f} s ago",
                hint="synchronise the clocks of both machines",
            )
        speeds = np.gradient(q, times, axis=0) if dq is None else dq
        first = next(
            (
                k
                for k, time in enumerate(times)
                if time >= _LEAST_HORIZON
                and (_acceleration(here, q[k], speeds[k], float(time)) <= acceleration).all()
            ),
            len(times),
        )
        if first < len(times):
            _check_distance(here, q[first])
            return self._settled(here, times[first:], q[first:], speeds[first:], q[-1], acceleration)
        _check_distance(here, q[-1])
        horizon = max(float(times[-1]), _LEAST_HORIZON)
        while True:
            aim, velocity = self._ahead(q[-1], q[-1], speeds[-1], horizon - float(times[-1]))
            excess = (_acceleration(here, aim, velocity, horizon) > acceleration).any()
            if not excess or horizon > _LONGEST_HORIZON:
                break
            horizon *= _GROWTH
        return self._settled(here, np.array([horizon]), aim[None], velocity[None], q[-1], acceleration)

    def _settled(
        self, here: KinematicState, times: Array, q: Array, dq: Array, rest: Array, acceleration: Array
    ) -> JointTrajectory:
        """From a state through points, then to rest; joints that would leave their range stop at the last point."""
        q, dq = np.vstack([here.q, q]), np.vstack([here.dq, dq])
        times = np.concatenate([[0.0], times])
        # a cubic from (q, v) back to (q, 0) within s starts with the acceleration 4 v / s and overshoots by 4 v s / 27
        settling = max(_LEAST_SETTLING, float(np.max(4.0 * np.abs(dq[-1]) / acceleration)))
        farthest = q[-1] + 4.0 / 27.0 * settling * dq[-1]
        dq[-1] = np.where((farthest < self._robot.q_min) | (farthest > self._robot.q_max), 0.0, dq[-1])
        if np.abs(dq[-1]).max() > _REST or np.abs(q[-1] - rest).max() > 0.0:
            times = np.append(times, times[-1] + settling)
            q, dq = np.vstack([q, rest]), np.vstack([dq, np.zeros(7)])
        return JointTrajectory(times, q, dq, np.full(q.shape, np.nan))

    def _ahead(self, q: Array, place: Array, speed: Array, time: float) -> tuple[Array, Array]:
        """Place [rad] and velocity of the stream after a time [s]; joints that would leave their range rest at `q`."""
        there = place + speed * time
        inside = (there >= self._robot.q_min) & (there <= self._robot.q_max)
        return np.where(inside, there, q), np.where(inside, speed, 0.0)

    def _fit(self, period: float, window: float) -> tuple[Array, Array]:
        """Present position [rad] and velocity [rad/s] of the stream, shape (7,): a straight line through its points."""
        end, last = self._points[-1]
        recent = [point for point in self._points if end - point[0] <= window]
        times = np.array([time for time, _ in recent]) - end
        if times[0] > -period / 2.0:
            return last, np.zeros(7)
        places = np.array([place for _, place in recent])
        centred = times - times.mean()
        slope = centred @ places / (centred @ centred)
        return places.mean(axis=0) - slope * times.mean(), slope


def _longest_gap(times: Collection[float], period: float) -> float:
    """Longest time between two of several, which increase [s]."""
    return min(float(np.diff(np.fromiter(times, float)).max(initial=period)), _LONGEST_GAP)


def _check_distance(here: KinematicState, q: Array) -> None:
    away = np.abs(q - here.q)
    worst = int(np.argmax(away))
    if away[worst] > _LARGEST_JUMP:
        raise GoalRefused(
            f"a streamed point must be within {_LARGEST_JUMP:g} rad of the arm, "
            f"got {away[worst]:.4f} rad for joint {worst + 1}",
            hint="begin the stream at the current state, or send a trajectory",
        )


def _acceleration(here: KinematicState, q: Array, speed: Array, horizon: float) -> Array:
    """Largest acceleration of the cubic from a state to a point within a time, shape (7,) [rad/s²]."""
    mean = (q - here.q) / horizon
    begin = 6.0 * mean - 4.0 * here.dq - 2.0 * speed
    end = 2.0 * here.dq + 4.0 * speed - 6.0 * mean
    return np.asarray(np.maximum(np.abs(begin), np.abs(end)) / horizon)
