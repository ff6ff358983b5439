"""The guard: what is sent never breaks the limits, whatever is asked; it limits and reports, it never cuts the session.

Each axis is a chain in steps of the command period: the finite differences of what is sent are its velocity,
acceleration and jerk. A wish that moves as the axis can passes unchanged. Any other is approached along a path that
brakes in time. A step is taken only if the axis can still stop inside its position limits afterwards; if not it brakes,
which it could from where it stood before. So the limits hold by induction from the start, which is the interpolator's
position and speed.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence

from heptarm.fri.limits import Limits

AXES = 7
#: Share of acceleration and jerk that an approach is planned with; the rest keeps it on its path.
SHARE = 0.8
#: A wish may use a limit fully, up to rounding.
ROUNDING = 1e-9


class Limited(enum.IntEnum):
    """What the guard had to change."""

    NOT_FINITE = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    JERK = 4
    TORQUE = 5
    WRENCH = 6


_UNITS = ("", "rad", "rad/s", "rad/s²", "rad/s³", "Nm", "N or Nm")


class Report:
    """What the guard limited, since it was made.

    Attributes:
        counts: cycles, by `Limited` and axis, shape [7][7].
        worst: largest magnitude asked, by `Limited` and axis.
        allowed: largest magnitude allowed then.
    """

    __slots__ = ("allowed", "counts", "worst")

    def __init__(self) -> None:
        self.counts = [[0] * AXES for _ in Limited]
        self.worst = [[0.0] * AXES for _ in Limited]
        self.allowed = [[0.0] * AXES for _ in Limited]

    def add(self, kind: int, axis: int, asked: float, allowed: float) -> None:
        """One axis was limited in one cycle."""
        self.counts[kind][axis] += 1
        if abs(asked) >= self.worst[kind][axis]:
            self.worst[kind][axis] = abs(asked)
            self.allowed[kind][axis] = abs(allowed)

    @property
    def lines(self) -> list[str]:
        """One line for each thing and axis that was limited, in words."""
        found = []
        for kind in Limited:
            name, unit = kind.name.lower().replace("_", " "), _UNITS[kind]
            for axis, count in enumerate(self.counts[kind]):
                if not count:
                    continue
                where = f"wrench[{axis}]" if kind is Limited.WRENCH else f"A{axis + 1}"
                cycles = f"{count} cycle{'s' * (count != 1)}"
                if kind is Limited.NOT_FINITE:
                    found.append(f"{where}: asked for no finite number in {cycles}; the last one was kept")
                    continue
                asked, allowed = self.worst[kind][axis], self.allowed[kind][axis]
                found.append(
                    f"{where}: {name} limited in {cycles}: {asked:.4g} {unit} asked, {allowed:.4g} allowed"
                )
        return found


class Guard:
    """Limits the commands of one client.

    Args:
        limits: what to keep.
        report: where to count; None for an own one.

    Attributes:
        q: what was sent last [rad].
        v: its last difference [rad per step].
        a: the last difference of that [rad per step²].
        r: the last wish, within the position limits [rad].
        tau: the torques sent last [Nm].
        wrench: the wrench sent last [N, Nm].
        is_started: between `start` and `stop`.
        was_limited: the last cycle changed something.
    """

    def __init__(self, limits: Limits, *, report: Report | None = None) -> None:
        self.limits = limits
        self.report = report or Report()
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
        """Limits in steps of the command period [s]."""
        limits, more = self.limits, 1.0 + ROUNDING
        self.period = period
        self.V = [value * period * more for value in limits.dq_max]
        self.A = [value * period**2 * more for value in limits.ddq_max]
        self.J = [value * period**3 * more for value in limits.dddq_max]
        # nearer to a position limit than this, stopping in time has to be looked at
        self.near = [_overrun(v, a, a, j) + v for v, a, j in zip(self.V, self.A, self.J, strict=True)]

    def start(self, q: Sequence[float], dq: Sequence[float], *, period: float) -> None:
        """Begin where the interpolator is, with its speed, and with no torque.

        Args:
            q: interpolator's position [rad]; a start outside the position limits may only go inwards.
            dq: its velocity [rad/s].
            period: distance of two commands [s].
        """
        self._scale(period)
        self.q, self.r, self.a = list(q), list(q), [0.0] * AXES
        self.v = [min(max(value * period, -top), top) for value, top in zip(dq, self.V, strict=True)]
        self.tau, self.wrench = [0.0] * AXES, [0.0] * 6
        for axis in range(AXES):
            v, a, j = self.v[axis], self.A[axis], self.J[axis]
            self.low[axis] = min(self.limits.q_min[axis], q[axis] - _overrun(-v, 0.0, a, j))
            self.high[axis] = max(self.limits.q_max[axis], q[axis] + _overrun(v, 0.0, a, j))
        self.is_started, self.was_limited = True, False

    def stop(self) -> None:
        """Commands are no longer effective; the next one needs a `start`."""
        self.is_started = False

    @property
    def is_still(self) -> bool:
        """Every axis stands."""
        return not any(self.v) and not any(self.a)

    def position(self, wish: Sequence[float] | None, ipo: Sequence[float] | None = None) -> list[float]:
        """The position to send.

        Args:
            wish: 7 positions [rad]; None brakes every axis to a stop.
            ipo: interpolator's position, for the reach.

        Returns:
            7 positions within all limits; valid until the next call.
        """
        self.was_limited = False
        q, v, a, r = self.q, self.v, self.a, self.r
        for i in range(AXES):
            now, speed = q[i], v[i]
            if wish is None:
                acc = _brake(speed, a[i], self.A[i], self.J[i])
                v[i] = speed = speed + acc
                a[i] = acc
                q[i] = r[i] = now + speed
                continue
            goal, before = wish[i], r[i]
            if not self.low[i] <= goal <= self.high[i] or ipo is not None:
                goal = self._bounded(i, goal, before, None if ipo is None else ipo[i])
            r[i] = goal
            step, jerk, high = goal - now, self.J[i], self.V[i]
            acc = step - speed
            if (  # on the wish's track and within the limits: the most frequent case
                -jerk <= 4.0 * (step - goal + before) <= jerk
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

    def torque(self, wish: Sequence[float]) -> list[float]:
        """The torques to send, within magnitude and rate; starts from zero."""
        limits = self.limits
        self._slew(self.tau, wish, limits.tau_max, limits.dtau_max, Limited.TORQUE)
        return self.tau

    def force(self, wish: Sequence[float]) -> list[float]:
        """The wrench to send, within magnitude and rate; starts from zero."""
        limits = self.limits
        self._slew(self.wrench, wish, limits.wrench_max, limits.dwrench_max, Limited.WRENCH)
        return self.wrench

    # ---------------------------------------------------------------------------------------------- one axis

    def _bounded(self, i: int, goal: float, before: float, ipo: float | None) -> float:
        """A wish within the position limits and the reach."""
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
        """The acceleration of this step towards a goal that cannot be met as it moves."""
        q, v, a, high, top, jerk = self.q[i], self.v[i], self.a[i], self.V[i], self.A[i], self.J[i]
        upper = min(a + jerk, top, _ramp(high - v, jerk))
        lower = max(a - jerk, -top, -_ramp(high + v, jerk))
        pace = min(max(goal - before, -high), high)
        step = goal - q
        wanted = step - v
        if lower <= wanted <= upper and abs(step - pace) <= 0.25 * jerk:
            acc = wanted
        else:
            self._tell(i, step, wanted, a)
            # in the frame of the moving goal, mirrored so that it lies ahead
            sign = 1.0 if step >= pace else -1.0
            ahead, speed, bent = sign * (step - pace), sign * (v - pace), sign * a
            most, least = (upper, lower) if sign > 0 else (-lower, -upper)
            soft, gentle = SHARE * top, SHARE * jerk
            least = min(max(_brake(speed, bent, soft, gentle), least), most)
            room = ahead - speed - most - _overrun(speed + most, most, soft, gentle)
            if room >= 0.0:
                acc = sign * most
            else:  # between full acceleration and braking lies the one that just stops at the goal
                rest = ahead - speed - least - _overrun(speed + least, least, soft, gentle)
                acc = sign * (least if rest <= 0.0 else least + (most - least) * rest / (rest - room))
        speed = v + acc
        there = q + speed
        if (
            there + _overrun(speed, acc, top, jerk) > self.high[i]
            or there - _overrun(-speed, -acc, top, jerk) < self.low[i]
        ):
            braking = _brake(v, a, top, jerk)
            if braking != acc and wanted == acc:
                self._tell(i, step, wanted, a)
            return braking
        return acc

    def _tell(self, i: int, step: float, wanted: float, a: float) -> None:
        """Name the first thing that a wish would break."""
        period = self.period
        if abs(step) > self.V[i]:
            self._limited(Limited.VELOCITY, i, step / period, self.limits.dq_max[i])
        elif abs(wanted) > self.A[i]:
            self._limited(Limited.ACCELERATION, i, wanted / period**2, self.limits.ddq_max[i])
        else:
            self._limited(Limited.JERK, i, (wanted - a) / period**3, self.limits.dddq_max[i])

    def _limited(self, kind: Limited, axis: int, asked: float, allowed: float) -> None:
        self.was_limited = True
        self.report.add(kind, axis, asked, allowed)

    def _slew(
        self,
        last: list[float],
        wish: Sequence[float],
        most: Sequence[float],
        rate: Sequence[float],
        kind: Limited,
    ) -> None:
        for i, value in enumerate(wish):
            if math.isfinite(value):
                bounded = min(max(value, -most[i]), most[i])
                if bounded != value:
                    self._limited(kind, i, value, most[i])
            else:
                bounded = last[i]
                self._limited(Limited.NOT_FINITE, i, 0.0, 0.0)
            step = rate[i] * self.period
            last[i] = min(max(bounded, last[i] - step), last[i] + step)


def _ramp(room: float, jerk: float) -> float:
    """Largest acceleration from which, falling by `jerk` each step, the speed rises by `room` at most."""
    if room <= 0.0:
        return room
    n = int((math.sqrt(1.0 + 8.0 * room / jerk) - 1.0) * 0.5)
    return n * jerk + (room - jerk * n * (n + 1) * 0.5) / (n + 1)


def _brake(v: float, a: float, top: float, jerk: float) -> float:
    """The acceleration of one step of the shortest way to a stop."""
    target = -_ramp(v, jerk) if v > 0.0 else _ramp(-v, jerk)
    return min(max(target, -top, a - jerk), top, a + jerk)


def _overrun(v: float, a: float, top: float, jerk: float) -> float:
    """How far braking still goes in the positive direction, at most.

    From where the acceleration is (was, if the axis brakes already) zero, a stop needs v^1.5/jerk^0.5, or with the
    acceleration at its limit v/2 (v/top + top/jerk); what lies between that moment and now is added.
    """
    peak = v + a * a / (2.0 * jerk)
    if a >= 0.0:
        way = (v if v > 0.0 else 0.0) * a / jerk + a * a * a / (3.0 * jerk * jerk)
    elif v <= 0.0:
        return 0.0
    elif a * a >= 2.0 * jerk * v:  # braking is harder than it needs
        return v * (1.0 - a / jerk)
    else:
        way = a * (peak - a * a / (6.0 * jerk)) / jerk
    if peak <= 0.0:
        return 0.0
    rest = (
        peak * math.sqrt(peak / jerk) if peak * jerk <= top * top else 0.5 * peak * (peak / top + top / jerk)
    )
    return max(way + rest, 0.0)
