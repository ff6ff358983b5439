"""Pose guard, in Python: what native/fri_guard.c has to do.

A pose has seven numbers: x y z [m] and a unit quaternion x y z w.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from heptarm.fri.guard.pose_guard import PoseLimited, PoseLimits, PoseReport

from .joint_guard import PLANNED, ROUNDING

#: Smallest norm of a quaternion that defines a rotation.
SMALLEST_NORM = 1e-3
#: Largest coordinate of a target [m].
LARGEST_COORDINATE = 1e3
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
_Motion = tuple[Vector, Quaternion, tuple[Vector, Quaternion], Vector, Vector, float, float, float]
_ZERO: Vector = (0.0, 0.0, 0.0)
_REST = (0.0,) * 6


class PoseGuard:
    """Limiter of the poses of one client.

    Args:
        limits: the limits.

    Attributes:
        report: what was limited.
        xyz: translation sent last [m].
        quat: rotation sent last, quaternion x y z w.
        v: last difference of the translations [m per step].
        w: last difference of the rotations [rad per step].
        e1: redundancy angle sent last [rad]; NaN where the interpolator has none.
        u: its last difference [rad per step].
        goal: last target, within the reach.
        is_started: whether commands are effective.
        was_limited: whether the last cycle was limited.
    """

    def __init__(self, limits: PoseLimits) -> None:
        self.limits = limits
        self.report = PoseReport()
        self.xyz, self.v, self.w = _ZERO, _ZERO, _ZERO
        self.quat: Quaternion = (0.0, 0.0, 0.0, 1.0)
        self.goal: tuple[Vector, Quaternion] = (self.xyz, self.quat)
        self.e1, self.u, self._e1_goal = math.nan, 0.0, math.nan
        self.is_started = self.was_limited = False
        self._scale(1e-3)

    def _scale(self, period: float) -> None:
        """Convert the limits to steps of the command period [s]."""
        limits, more = self.limits, 1.0 + ROUNDING
        self.period = period
        self._rates = (limits.velocity, limits.angular_velocity, limits.elbow_velocity)
        self._changes = (limits.acceleration, limits.angular_acceleration, limits.elbow_acceleration)
        self._tops = tuple(rate * period * more for rate in self._rates)
        self._mosts = tuple(change * period * period * more for change in self._changes)

    def start(
        self,
        pose: Sequence[float],
        twist: Sequence[float] = _REST,
        *,
        period: float,
        e1: float = math.nan,
        e1_speed: float = 0.0,
    ) -> None:
        """Start from pose and velocity of the interpolator.

        Args:
            pose: interpolator's pose, shape (7,).
            twist: its velocity and angular velocity, base axes, shape (6,) [m/s, rad/s].
            period: command period [s].
            e1: interpolator's redundancy angle [rad]; NaN if it has none.
            e1_speed: its velocity [rad/s].
        """
        self._scale(period)
        x, y, z = pose[:3]
        self.xyz, self.quat = (x, y, z), _unit(pose[3:]) or self.quat
        self.goal = (self.xyz, self.quat)
        self.v = _within(_times(period, twist[:3]), self._tops[0])
        self.w = _within(_times(period, twist[3:]), self._tops[1])
        self.e1 = self._e1_goal = e1
        self.u = _within((e1_speed * period, 0.0, 0.0), self._tops[2])[0]
        self.is_started, self.was_limited = True, False

    def stop(self) -> None:
        """Note that commands are no longer effective; `start` before the next one."""
        self.is_started = False

    @property
    def sent(self) -> tuple[float, ...]:
        """Pose sent last, shape (7,)."""
        return (*self.xyz, *self.quat)

    @property
    def motion(self) -> _Motion:
        """What was sent last and its motion; assign it to go back to that cycle."""
        return (self.xyz, self.quat, self.goal, self.v, self.w, self.e1, self.u, self._e1_goal)

    @motion.setter
    def motion(self, kept: _Motion) -> None:
        self.xyz, self.quat, self.goal, self.v, self.w, self.e1, self.u, self._e1_goal = kept

    @property
    def is_still(self) -> bool:
        """Whether every part is at rest."""
        return not any(self.v) and not any(self.w) and not self.u

    def pose(self, target: Sequence[float] | None, ipo: Sequence[float] | None = None) -> tuple[float, ...]:
        """Limit a target pose.

        Args:
            target: a pose, shape (7,); None brakes to a stop. Coordinates that are not finite keep the last target, and
                so does a whole quaternion that is not finite or zero.
            ipo: pose of the interpolator, to limit the reach; None: no limit.

        Returns:
            The pose to send, shape (7,).
        """
        self.was_limited = False
        if target is None:
            self.v, self.w = _slower(self.v, self._mosts[0]), _slower(self.w, self._mosts[1])
            self.xyz, self.quat = _plus(self.xyz, self.v), _turned(self.quat, self.w)
            self.goal = (self.xyz, self.quat)
            return self.sent
        before, turned = self.goal
        place, turn = self.goal = self._bounded(target, before, turned, ipo)
        ahead = _minus(place, self.xyz)
        self.v = self._step(0, ahead, _minus(place, before), self.v)
        self.xyz = place if self.v == ahead else _plus(self.xyz, self.v)
        ahead = _turn(turn, self.quat)
        self.w = self._step(1, ahead, _turn(turn, turned), self.w)
        if self.w == ahead:  # of the two equal quaternions, take the one closer to the last
            near = sum(a * b for a, b in zip(turn, self.quat, strict=True)) >= 0.0
            x, y, z, w = turn
            self.quat = turn if near else (-x, -y, -z, -w)
        else:
            self.quat = _turned(self.quat, self.w)
        return self.sent

    def elbow(self, target: float | None) -> float:
        """Limit a target redundancy angle [rad]; call it after `pose`.

        Args:
            target: an angle [rad]; None brakes to a stop, NaN keeps the last target.
        """
        if target is None:
            self.u = _slower((self.u, 0.0, 0.0), self._mosts[2])[0]
            self.e1 = self._e1_goal = self.e1 + self.u
            return self.e1
        before = self._e1_goal
        if not math.isfinite(target):
            self._limited(PoseLimited.NOT_FINITE, 2, 0.0, 0.0)
            target = before
        self._e1_goal = target
        ahead = target - self.e1
        self.u = self._step(2, (ahead, 0.0, 0.0), (target - before, 0.0, 0.0), (self.u, 0.0, 0.0))[0]
        self.e1 = target if self.u == ahead else self.e1 + self.u
        return self.e1

    # ---------------------------------------------------------------------------------------------- one part

    def _bounded(
        self, target: Sequence[float], before: Vector, turned: Quaternion, ipo: Sequence[float] | None
    ) -> tuple[Vector, Quaternion]:
        """Make the numbers of a target finite and limit its reach."""
        x, y, z = (
            min(max(new, -LARGEST_COORDINATE), LARGEST_COORDINATE) if math.isfinite(new) else old
            for new, old in zip(target[:3], before, strict=True)
        )
        place: Vector = (x, y, z)
        if not all(map(math.isfinite, target[:3])):
            self._limited(PoseLimited.NOT_FINITE, 0, 0.0, 0.0)
        turn = _unit(target[3:])
        if turn is None:
            self._limited(PoseLimited.NOT_FINITE, 1, 0.0, 0.0)
            turn = turned
        if ipo is not None:
            away, reach = _minus(place, ipo), self.limits.reach
            far = _norm(away)
            if far > reach * (1.0 + ROUNDING):
                self._limited(PoseLimited.REACH, 0, far, reach)
                place = _plus(ipo, _times(reach / far, away))
        return place, turn

    def _step(self, part: int, ahead: Vector, goal_v: Vector, v: Vector) -> Vector:
        """Velocity of this step.

        Args:
            part: 0: translation, 1: rotation, 2: redundancy angle.
            ahead: vector to the target.
            goal_v: vector from the last target to this one.
            v: velocity of the last step.
        """
        top, most = self._tops[part], self._mosts[part]
        goal_v = _within(goal_v, top)
        lag, change = _minus(ahead, goal_v), _minus(ahead, v)
        far, speed, bend = _norm(lag), _norm(ahead), _norm(change)
        # on track, or close enough to be on track with the next step
        if speed <= top and bend <= most and far <= most:
            return ahead
        period = self.period
        if speed > top:
            self._limited(PoseLimited.VELOCITY, part, speed / period, self._rates[part])
        else:
            self._limited(
                PoseLimited.ACCELERATION, part, max(bend, far) / (period * period), self._changes[part]
            )
        planned, wanted = PLANNED * most, goal_v
        if far > 0.0:  # largest velocity that still stops at the moving goal with the acceleration `planned`
            rate = min(far, planned * (math.sqrt(0.25 + 2.0 * far / planned) - 0.5))
            wanted = _within(_plus(goal_v, _times(rate / far, lag)), top)
        return _plus(v, _within(_minus(wanted, v), most))

    def _limited(self, kind: PoseLimited, part: int, asked: float, allowed: float) -> None:
        self.was_limited = True
        self.report.add(kind, part, asked, allowed)


def between(first: Sequence[float], second: Sequence[float]) -> tuple[float, ...]:
    """Translation and rotation vector between two poses, base axes, shape (6,) [m, rad]."""
    return (*_minus(second, first), *_turn(second[3:], first[3:]))


def moved(pose: Sequence[float], displacement: Sequence[float]) -> tuple[float, ...]:
    """Move a pose, shape (7,), by a translation and a rotation vector in base axes, shape (6,) [m, rad]."""
    return (*_plus(pose, displacement), *_turned(pose[3:], displacement[3:]))


def _minus(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _plus(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _times(factor: float, a: Sequence[float]) -> Vector:
    return (factor * a[0], factor * a[1], factor * a[2])


def _norm(a: Vector) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def _within(a: Vector, most: float) -> Vector:
    """Shorten a vector to the length `most`."""
    size = _norm(a)
    return a if size <= most else _times(most / size, a)


def _slower(v: Vector, most: float) -> Vector:
    """Velocity after one step of braking."""
    speed = _norm(v)
    return _ZERO if speed <= most else _times(1.0 - most / speed, v)


def _unit(quat: Sequence[float]) -> Quaternion | None:
    """Normalise a quaternion; None if it defines no rotation."""
    x, y, z, w = quat
    size = math.sqrt(x * x + y * y + z * z + w * w)
    if not SMALLEST_NORM <= size < math.inf:
        return None
    return (x / size, y / size, z / size, w / size)


def _product(p: Sequence[float], q: Sequence[float]) -> Quaternion:
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def _turn(goal: Sequence[float], here: Sequence[float]) -> Vector:
    """Shortest rotation vector from one unit quaternion to another, base axes [rad]."""
    x, y, z, w = _product(goal, (-here[0], -here[1], -here[2], here[3]))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return _ZERO
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    return _times(2.0 * math.atan2(sine, w) / sine, (x, y, z))


def _turned(quat: Sequence[float], turn: Sequence[float]) -> Quaternion:
    """Rotate a unit quaternion by a rotation vector in base axes [rad]."""
    x, y, z = turn
    angle = _norm((x, y, z))
    scale = 0.5 * math.sin(0.5 * angle) / (0.5 * angle) if angle > 1e-12 else 0.5
    x, y, z, w = _product((scale * x, scale * y, scale * z, math.cos(0.5 * angle)), quat)
    size = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / size, y / size, z / size, w / size)
