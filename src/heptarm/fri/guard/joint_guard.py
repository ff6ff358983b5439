"""Joint guard: limits the positions, torques and wrenches that a client sends, and reports what it limited."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

from heptarm.errors import LimitError
from heptarm.values.arrays import array, finite, instance, scalar, within
from heptarm.values.robot import RobotModel

AXES = 7
#: Fraction of acceleration and jerk with which an approach is planned; the rest corrects deviations.
PLANNED = 0.8
#: A target is on track as long as its velocity changes by less than the largest jerk divided by this.
ON_TRACK = 4.0
#: Relative tolerance of the limits, for rounding.
ROUNDING = 1e-9
#: Unit of each limit, for errors.
_LIMIT_UNITS = {
    "dq_max": "rad/s",
    "ddq_max": "rad/s²",
    "dddq_max": "rad/s³",
    "tau_max": "Nm",
    "dtau_max": "Nm/s",
    "wrench_max": "N or Nm",
    "dwrench_max": "N/s or Nm/s",
    "reach": "rad",
}


def positive(value: object, name: str, unit: str) -> float:
    """A positive number; it may be infinite.

    Raises:
        ShapeError: it is no number.
        LimitError: it is not positive, or NaN.
    """
    number = scalar(value, name, unit=unit)
    if not number > 0.0:
        raise LimitError(f"{name} must be positive, got {number:g} {unit}", parameter=name, value=number)
    return number


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of the joint guard.

    Attributes:
        q_min: 7 positions [rad].
        q_max: 7 positions [rad].
        dq_max: 7 velocities [rad/s].
        ddq_max: 7 accelerations [rad/s²].
        dddq_max: 7 jerks [rad/s³].
        tau_max: 7 superposed torques [Nm].
        dtau_max: their rates [Nm/s].
        wrench_max: superposed wrench, 6 numbers [N, Nm].
        dwrench_max: its rates [N/s, Nm/s].
        reach: largest distance of a target from the interpolator [rad].

    Raises:
        LimitError: a limit is not positive, or a position range is empty.
    """

    q_min: tuple[float, ...]
    q_max: tuple[float, ...]
    dq_max: tuple[float, ...]
    ddq_max: tuple[float, ...]
    dddq_max: tuple[float, ...]
    tau_max: tuple[float, ...]
    dtau_max: tuple[float, ...]
    wrench_max: tuple[float, ...] = (150.0, 150.0, 150.0, 50.0, 50.0, 50.0)
    dwrench_max: tuple[float, ...] = (3000.0, 3000.0, 3000.0, 1000.0, 1000.0, 1000.0)
    reach: float = math.inf

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            if name == "reach":
                positive(self.reach, name, "rad")
                continue
            values = array(getattr(self, name), 6 if "wrench" in name else AXES, name).tolist()
            object.__setattr__(self, name, tuple(values))
            for value in () if name in ("q_min", "q_max") else values:
                positive(value, name, _LIMIT_UNITS[name])
        for axis, (low, high) in enumerate(zip(self.q_min, self.q_max, strict=True), 1):
            if not low < high:
                raise LimitError(
                    f"q_min of A{axis} must be below q_max = {high:g} rad, got {low:g} rad: the range is empty",
                    parameter="q_min",
                    value=low,
                )

    @classmethod
    def of(
        cls,
        robot: RobotModel,
        *,
        fraction: float = 0.95,
        margin: float = math.radians(1.0),
        reach: float = math.inf,
    ) -> Limits:
        """Make limits slightly inside those of a robot.

        Args:
            robot: the robot.
            fraction: fraction of velocity, acceleration, jerk and torque, (0, 1].
            margin: distance from the position limits [rad].
            reach: largest distance of a target from the interpolator [rad].

        Raises:
            LimitError: an argument makes a limit zero or a position range empty.
        """
        instance(robot, RobotModel, "robot")
        fraction = within(fraction, "fraction", 0.0, 1.0, above=True)
        margin = finite(margin, "margin", unit="rad")
        tau = tuple(float(value) * fraction for value in robot.tau_max)
        return cls(
            q_min=tuple(float(value) + margin for value in robot.q_min),
            q_max=tuple(float(value) - margin for value in robot.q_max),
            dq_max=tuple(float(value) * fraction for value in robot.dq_max),
            ddq_max=tuple(float(value) * fraction for value in robot.ddq_max),
            dddq_max=tuple(float(value) * fraction for value in robot.dddq_max),
            tau_max=tau,
            dtau_max=tuple(20.0 * value for value in tau),
            reach=reach,
        )


class Limited(enum.IntEnum):
    """Quantity that the guard limited."""

    NOT_FINITE = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    JERK = 4
    TORQUE = 5
    WRENCH = 6


_UNITS = ("", "rad", "rad/s", "rad/s²", "rad/s³", "Nm", "N or Nm")


class JointReport:
    """Counts and extremes of what a joint guard has limited.

    Attributes:
        counts: cycles, by `Limited` and axis, shape [7][7].
        worst: largest requested magnitude, by `Limited` and axis.
        allowed: largest magnitude allowed at that time.
    """

    __slots__ = ("allowed", "counts", "worst")

    def __init__(self) -> None:
        self.counts = [[0] * AXES for _ in Limited]
        self.worst = [[0.0] * AXES for _ in Limited]
        self.allowed = [[0.0] * AXES for _ in Limited]

    def add(self, kind: int, axis: int, asked: float, allowed: float) -> None:
        """Count an axis that was limited in one cycle."""
        self.counts[kind][axis] += 1
        if abs(asked) >= self.worst[kind][axis]:
            self.worst[kind][axis] = abs(asked)
            self.allowed[kind][axis] = abs(allowed)

    @property
    def lines(self) -> list[str]:
        """One line of text for each quantity and axis that was limited."""
        found = []
        for kind in Limited:
            name, unit = kind.name.lower().replace("_", " "), _UNITS[kind]
            for axis, count in enumerate(self.counts[kind]):
                if not count:
                    continue
                where = f"wrench[{axis}]" if kind is Limited.WRENCH else f"A{axis + 1}"
                cycles = f"{count} cycle{'s' * (count != 1)}"
                if kind is Limited.NOT_FINITE:
                    found.append(f"{where}: target not finite in {cycles}; the last one was kept")
                    continue
                asked, allowed = self.worst[kind][axis], self.allowed[kind][axis]
                found.append(
                    f"{where}: {name} limited in {cycles}: {asked:.4g} {unit} requested, {allowed:.4g} allowed"
                )
        return found


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
        self.A = [value * period**2 * more for value in limits.ddq_max]
        self.J = [value * period**3 * more for value in limits.dddq_max]
        # closer to a position limit than this, the stopping distance has to be checked
        self.near = [overrun(v, a, a, j) + v for v, a, j in zip(self.V, self.A, self.J, strict=True)]

    def start(self, q: Sequence[float], dq: Sequence[float], *, period: float) -> None:
        """Start from position and velocity of the interpolator, with zero torque.

        Args:
            q: interpolator's position [rad]; from outside the position limits an axis can only move inwards.
            dq: its velocity [rad/s].
            period: command period [s].
        """
        self._scale(period)
        self.q, self.r, self.a = list(q), list(q), [0.0] * AXES
        self.v = [min(max(value * period, -top), top) for value, top in zip(dq, self.V, strict=True)]
        self.tau, self.wrench = [0.0] * AXES, [0.0] * 6
        for axis in range(AXES):
            v, a, j = self.v[axis], self.A[axis], self.J[axis]
            self.low[axis] = min(self.limits.q_min[axis], q[axis] - overrun(-v, 0.0, a, j))
            self.high[axis] = max(self.limits.q_max[axis], q[axis] + overrun(v, 0.0, a, j))
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
        if lower <= wanted <= upper and ON_TRACK * abs(step - goal_v) <= jerk:
            acc = wanted
        else:
            self._report_violation(i, step, wanted, a)
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
        speed = v + acc
        there = q + speed
        if (
            there + overrun(speed, acc, top, jerk) > self.high[i]
            or there - overrun(-speed, -acc, top, jerk) < self.low[i]
        ):
            braking = brake(v, a, top, jerk)
            if braking != acc and wanted == acc:
                self._report_violation(i, step, wanted, a)
            return braking
        return acc

    def _report_violation(self, i: int, step: float, wanted: float, a: float) -> None:
        """Report the first limit that a target violates."""
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
