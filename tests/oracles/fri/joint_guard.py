"""Joint guard, in Python: what native/fri_guard.c has to do to the last bit."""

from __future__ import annotations

import math
from collections.abc import Sequence

from heptarm.fri.guard.joint_guard import AXES, JointReport, Limited, Limits

#: Fraction of acceleration and jerk with which an approach is planned; the rest corrects deviations.
PLANNED = 0.8
#: A target is on track as long as its velocity changes by less than the largest jerk divided by this.
ON_TRACK = 4.0
#: Relative tolerance of the limits, for rounding; of a distance to a position limit [rad].
ROUNDING, SLACK = 1e-9, 1e-12
#: For so long the cabinet goes on without an answer [s], at least so many command periods.
COAST, COAST_PERIODS = 5e-3, 2.0


class JointGuard:
    """Limiter of the joint commands of one client.

    Args:
        limits: the limits.
        report: report to use; None creates one.

    Attributes:
        q: positions sent last [rad].
        v: its last difference [rad per step].
        a: the last difference of that [rad per step²].
        r: last target, within the position limits [rad].
        tau: the torques sent last [Nm].
        wrench: the wrench sent last [N, Nm].
        is_started: whether commands are effective.
        was_limited: whether the last cycle was limited.
    """

    def __init__(self, limits: Limits, *, report: JointReport | None = None) -> None:
        self.limits = limits
        self.report = report or JointReport()
        self.q = [0.0] * AXES
        self.v = [0.0] * AXES
        self.a = [0.0] * AXES
        self.r = [0.0] * AXES
        self.tau = [0.0] * AXES
        self.wrench = [0.0] * 6
        self.low = list(limits.q_min)
        self.high = list(limits.q_max)
        self.is_started = self.was_limited = False
        self._scale(1e-3)

    def _scale(self, period: float) -> None:
        """Convert the limits to steps of the command period [s]."""
        limits, more = self.limits, 1.0 + ROUNDING
        self.period = period
        self.V = [value * period * more for value in limits.dq_max]
        self.A = [value * period * period * more for value in limits.ddq_max]
        self.J = [value * period * period * period * more for value in limits.dddq_max]
        self.coast = max(COAST, COAST_PERIODS * period) / period
        # closer to a position limit than this, the stopping distance has to be checked
        self.near = [
            overrun(v, a, a, j) + v * (1.0 + self.coast)
            for v, a, j in zip(self.V, self.A, self.J, strict=True)
        ]

    def start(self, q: Sequence[float], dq: Sequence[float], *, period: float) -> None:
        """Start from position and velocity of the interpolator, with zero torque.

        Args:
            q: interpolator's position [rad]; from outside the position limits an axis can only move inwards.
            dq: its velocity [rad/s].
            period: command period [s].
        """
        self._scale(period)
        self.q = [new if math.isfinite(new) else old for new, old in zip(q, self.q, strict=True)]
        self.r, self.a = list(self.q), [0.0] * AXES
        dq = [value if math.isfinite(value) else 0.0 for value in dq]
        self.v = [min(max(value * period, -top), top) for value, top in zip(dq, self.V, strict=True)]
        self.tau, self.wrench = [0.0] * AXES, [0.0] * 6
        for axis in range(AXES):
            v, a, j = self.v[axis], self.A[axis], self.J[axis]
            here, coast = self.q[axis], self.coast
            self.low[axis] = min(
                self.limits.q_min[axis], here - overrun(-v, 0.0, a, j) - coast * max(-v, 0.0)
            )
            self.high[axis] = max(self.limits.q_max[axis], here + overrun(v, 0.0, a, j) + coast * max(v, 0.0))
        self.is_started, self.was_limited = True, False

    def stop(self) -> None:
        """Note that commands are no longer effective; `start` before the next one."""
        self.is_started = False

    @property
    def sent(self) -> tuple[list[float], ...]:
        """Copies of what was sent last and of its motion; assign them to go back to that cycle."""
        return (self.q[:], self.v[:], self.a[:], self.r[:], self.tau[:], self.wrench[:])

    @sent.setter
    def sent(self, kept: tuple[list[float], ...]) -> None:
        self.q, self.v, self.a, self.r, self.tau, self.wrench = (one[:] for one in kept)

    @property
    def is_still(self) -> bool:
        """Whether every axis is at rest."""
        return not any(self.v) and not any(self.a)

    def position(self, target: Sequence[float] | None, ipo: Sequence[float] | None = None) -> list[float]:
        """Limit a target position.

        Args:
            target: 7 positions [rad]; None brakes every axis to a stop.
            ipo: position of the interpolator, to limit the reach; None: no limit.

        Returns:
            7 positions to send [rad]; valid until the next call.
        """
        self.was_limited = False
        q, v, a, r = self.q, self.v, self.a, self.r
        for i in range(AXES):
            now, speed = q[i], v[i]
            if target is None:
                acc = brake(speed, a[i], self.A[i], self.J[i])
                v[i] = speed = speed + acc
                a[i] = acc
                q[i] = r[i] = now + speed
                continue
            goal, before = target[i], r[i]
            if not self.low[i] <= goal <= self.high[i] or ipo is not None:
                goal = self._bounded(i, goal, before, None if ipo is None else ipo[i])
            r[i] = goal
            step, jerk, high = goal - now, self.J[i], self.V[i]
            acc = step - speed
            if (  # on track and within the limits: the most frequent case
                -jerk <= ON_TRACK * (step - goal + before) <= jerk
                and -jerk <= acc - a[i] <= jerk
                and abs(step) + acc * acc / (2.0 * jerk) <= high
                and -self.A[i] <= acc <= self.A[i]
                and self.low[i] + self.near[i] <= goal <= self.high[i] - self.near[i]
            ):
                q[i], v[i], a[i] = goal, step, acc
                continue
            acc = self._approach(i, goal, before)
            v[i] = speed + acc
            a[i] = acc
            q[i] = goal if acc == step - speed else now + v[i]
        return q

    def torque(self, target: Sequence[float]) -> list[float]:
        """Limit magnitude and rate of target torques [Nm]; return those to send."""
        limits = self.limits
        self._slew(self.tau, target, limits.tau_max, limits.dtau_max, Limited.TORQUE)
        return self.tau

    def force(self, target: Sequence[float]) -> list[float]:
        """Limit magnitude and rate of a target wrench [N, Nm]; return the one to send."""
        limits = self.limits
        self._slew(self.wrench, target, limits.wrench_max, limits.dwrench_max, Limited.WRENCH)
        return self.wrench

    # ---------------------------------------------------------------------------------------------- one axis

    def _bounded(self, i: int, goal: float, before: float, ipo: float | None) -> float:
        """Limit a target to the position limits and the reach."""
        if not math.isfinite(goal):
            self._limited(Limited.NOT_FINITE, i, 0.0, 0.0)
            return before
        low, high = self.low[i], self.high[i]
        if ipo is not None:
            reach = self.limits.reach
            low, high = max(low, min(ipo - reach, high)), min(high, max(ipo + reach, low))
        bounded = min(max(goal, low), high)
        if bounded != goal:
            self._limited(Limited.POSITION, i, goal, bounded)
        return bounded

    def _approach(self, i: int, goal: float, before: float) -> float:
        """Acceleration of this step towards a moving goal that cannot be reached in one step."""
        q, v, a, high, top, jerk = self.q[i], self.v[i], self.a[i], self.V[i], self.A[i], self.J[i]
        upper = min(a + jerk, top, ramp(high - v, jerk))
        lower = max(a - jerk, -top, -ramp(high + v, jerk))
        goal_v = min(max(goal - before, -high), high)
        step = goal - q
        wanted = step - v
        is_there = lower <= wanted <= upper and ON_TRACK * abs(step - goal_v) <= jerk
        if is_there:
            acc = wanted
        else:
            # in the frame of the moving goal, mirrored so that it lies ahead
            sign = 1.0 if step >= goal_v else -1.0
            ahead, speed, bent = sign * (step - goal_v), sign * (v - goal_v), sign * a
            most, least = (upper, lower) if sign > 0 else (-lower, -upper)
            planned_a, planned_j = PLANNED * top, PLANNED * jerk
            least = min(max(brake(speed, bent, planned_a, planned_j), least), most)
            room = ahead - speed - most - overrun(speed + most, most, planned_a, planned_j)
            if room >= 0.0:
                acc = sign * most
            else:  # interpolate between full acceleration and braking: just stops at the goal
                rest = ahead - speed - least - overrun(speed + least, least, planned_a, planned_j)
                acc = sign * (least if rest <= 0.0 else least + (most - least) * rest / (rest - room))
        kept = self._held_back(i, acc)
        if not is_there or kept != acc:
            self._report_violation(i, step, wanted, a)
        return kept

    def _excess(self, i: int, acc: float) -> float:
        """By how much an axis would pass a position limit after a step, if the cabinet then had to stop it."""
        speed = self.v[i] + acc
        there, top, jerk = self.q[i] + speed, self.A[i], self.J[i]
        above = there + overrun(speed, acc, top, jerk) + self.coast * max(speed, 0.0) - self.high[i]
        below = self.low[i] - there + overrun(-speed, -acc, top, jerk) + self.coast * max(-speed, 0.0)
        return max(above, below)

    def _held_back(self, i: int, acc: float) -> float:
        """The acceleration nearest to a planned one with which the axis still stops before its limit."""
        over = self._excess(i, acc)
        if over <= 0.0:
            return acc
        braking = brake(self.v[i], self.a[i], self.A[i], self.J[i])
        room = self._excess(i, braking)
        if room >= 0.0:
            return braking
        kept = braking + (acc - braking) * room / (room - over)
        return kept if self._excess(i, kept) <= SLACK else braking

    def _report_violation(self, i: int, step: float, wanted: float, a: float) -> None:
        """Report the first limit that a target violates."""
        period = self.period
        if abs(step) > self.V[i]:
            self._limited(Limited.VELOCITY, i, step / period, self.limits.dq_max[i])
        elif abs(wanted) > self.A[i]:
            self._limited(Limited.ACCELERATION, i, wanted / (period * period), self.limits.ddq_max[i])
        else:
            self._limited(Limited.JERK, i, (wanted - a) / (period * period * period), self.limits.dddq_max[i])

    def _limited(self, kind: Limited, axis: int, asked: float, allowed: float) -> None:
        self.was_limited = True
        self.report.add(kind, axis, asked, allowed)

    def _slew(
        self,
        last: list[float],
        target: Sequence[float],
        most: Sequence[float],
        rate: Sequence[float],
        kind: Limited,
    ) -> None:
        for i, value in enumerate(target):
            if math.isfinite(value):
                bounded = min(max(value, -most[i]), most[i])
                if bounded != value:
                    self._limited(kind, i, value, most[i])
            else:
                bounded = last[i]
                self._limited(Limited.NOT_FINITE, i, 0.0, 0.0)
            step = rate[i] * self.period
            last[i] = min(max(bounded, last[i] - step), last[i] + step)


def ramp(room: float, jerk: float) -> float:
    """Largest acceleration that raises the velocity by at most `room` if it falls by `jerk` in each step."""
    if room <= 0.0:
        return room
    n = int((math.sqrt(1.0 + 8.0 * room / jerk) - 1.0) * 0.5)
    return n * jerk + (room - jerk * n * (n + 1) * 0.5) / (n + 1)


def brake(v: float, a: float, top: float, jerk: float) -> float:
    """Acceleration of one step of the fastest stop."""
    target = -ramp(v, jerk) if v > 0.0 else ramp(-v, jerk)
    return min(max(target, -top, a - jerk), top, a + jerk)


def overrun(v: float, a: float, top: float, jerk: float) -> float:
    """Upper bound of the stopping distance in the positive direction.

    From the state with zero acceleration (a past one if the axis is already braking) a stop takes v^1.5/jerk^0.5, or at
    the acceleration limit v/2 (v/top + top/jerk); the distance between that state and now is added.
    """
    peak = v + a * a / (2.0 * jerk)
    if a >= 0.0:
        covered = (v if v > 0.0 else 0.0) * a / jerk + a * a * a / (3.0 * jerk * jerk)
    elif v <= 0.0:
        return 0.0
    elif a * a >= 2.0 * jerk * v:  # braking harder than necessary
        return v * (1.0 - a / jerk)
    else:
        covered = a * (peak - a * a / (6.0 * jerk)) / jerk
    if peak <= 0.0:
        return 0.0
    rest = (
        peak * math.sqrt(peak / jerk) if peak * jerk <= top * top else 0.5 * peak * (peak / top + top / jerk)
    )
    return max(covered + rest, 0.0)
