"""The guard of Cartesian poses: a commanded flange keeps its speeds and accelerations, whatever is asked.

Translation and rotation are two chains in steps of the command period: the difference of two poses that are sent, as a
vector and as a rotation vector in base axes, is their velocity, the difference of two of these their acceleration. A
wish that moves as the limits allow passes unchanged; any other is approached along a way that brakes in time. Each step
ends inside the ball of legal velocities and begins from a velocity inside it, so that the limits hold by induction from
the start, which is the interpolator's pose and speed.

A pose here is seven numbers: x y z [m] and a unit quaternion x y z w.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

from heptarm.errors import LimitError
from heptarm.fri.guard import ROUNDING, SHARE

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

#: What is limited each for itself, as the report names it.
PARTS = ("flange", "rotation", "elbow")
#: A quaternion that is shorter tells no rotation.
SHORTEST = 1e-3
#: No wish is further from the base along an axis [m].
FURTHEST = 1e3
_ZERO: Vector = (0.0, 0.0, 0.0)
_REST = (0.0,) * 6


class PoseLimited(enum.IntEnum):
    """What the guard had to change."""

    NOT_FINITE = 0
    REACH = 1
    VELOCITY = 2
    ACCELERATION = 3


_ANGLES = ("", "rad", "rad/s", "rad/s²")
_UNITS = (("", "m", "m/s", "m/s²"), _ANGLES, _ANGLES)


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseLimits:
    """What the guard keeps of a commanded pose; the axes' own limits stay the cabinet's affair.

    Attributes:
        velocity: of the flange [m/s].
        acceleration: of the flange [m/s²].
        angular_velocity: of its rotation [rad/s].
        angular_acceleration: of its rotation [rad/s²].
        elbow_velocity: of the redundancy angle [rad/s].
        elbow_acceleration: of the redundancy angle [rad/s²].
        reach: how far a wish may be from the interpolator [m].

    Raises:
        LimitError: a limit is no positive number.
    """

    velocity: float = 0.25
    acceleration: float = 1.0
    angular_velocity: float = 1.0
    angular_acceleration: float = 4.0
    elbow_velocity: float = 0.5
    elbow_acceleration: float = 2.0
    reach: float = math.inf

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if not value > 0.0:
                raise LimitError(
                    f"{name} is {value:g}; a positive number is wanted", parameter=name, value=value
                )


class PoseReport:
    """What the guard limited, since it was made.

    Attributes:
        counts: cycles, by `PoseLimited` and part, shape [4][3].
        worst: largest magnitude asked, by `PoseLimited` and part.
        allowed: largest magnitude allowed then.
    """

    __slots__ = ("allowed", "counts", "worst")

    def __init__(self) -> None:
        self.counts = [[0] * len(PARTS) for _ in PoseLimited]
        self.worst = [[0.0] * len(PARTS) for _ in PoseLimited]
        self.allowed = [[0.0] * len(PARTS) for _ in PoseLimited]

    def add(self, kind: int, part: int, asked: float, allowed: float) -> None:
        """A part was limited in one cycle."""
        self.counts[kind][part] += 1
        if asked >= self.worst[kind][part]:
            self.worst[kind][part], self.allowed[kind][part] = asked, allowed

    @property
    def lines(self) -> list[str]:
        """One line for each thing and part that was limited, in words."""
        found = []
        for kind in PoseLimited:
            for part, count in enumerate(self.counts[kind]):
                if not count:
                    continue
                where, cycles = PARTS[part], f"{count} cycle{'s' * (count != 1)}"
                if kind is PoseLimited.NOT_FINITE:
                    found.append(f"{where}: asked for no finite number in {cycles}; the last one was kept")
                    continue
                unit = _UNITS[part][kind]
                found.append(
                    f"{where}: {kind.name.lower()} limited in {cycles}: "
                    f"{self.worst[kind][part]:.4g} {unit} asked, {self.allowed[kind][part]:.4g} allowed"
                )
        return found


class PoseGuard:
    """Limits the poses of one client.

    Args:
        limits: what to keep.

    Attributes:
        report: what was limited.
        xyz: translation that was sent last [m].
        quat: rotation that was sent last.
        v: last difference of the translations [m per step].
        w: last difference of the rotations [rad per step].
        e1: redundancy angle that was sent last [rad]; NaN where the interpolator has none.
        u: its last difference [rad per step].
        goal: the last wish, within the reach.
        is_started: between `start` and `stop`.
        was_limited: the last cycle changed something.
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
        """Limits in steps of the command period [s]."""
        limits, more = self.limits, 1.0 + ROUNDING
        self.period = period
        self._rates = (limits.velocity, limits.angular_velocity, limits.elbow_velocity)
        self._changes = (limits.acceleration, limits.angular_acceleration, limits.elbow_acceleration)
        self._tops = tuple(rate * period * more for rate in self._rates)
        self._mosts = tuple(change * period**2 * more for change in self._changes)

    def start(
        self,
        pose: Sequence[float],
        twist: Sequence[float] = _REST,
        *,
        period: float,
        e1: float = math.nan,
        e1_speed: float = 0.0,
    ) -> None:
        """Begin where the interpolator is, with its speed.

        Args:
            pose: interpolator's pose, shape (7,).
            twist: its velocity and angular velocity, base axes, shape (6,) [m/s, rad/s].
            period: distance of two commands [s].
            e1: interpolator's redundancy angle [rad]; NaN: it has none.
            e1_speed: its speed [rad/s].
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
        """Commands are no longer effective; the next one needs a `start`."""
        self.is_started = False

    @property
    def sent(self) -> tuple[float, ...]:
        """The pose that was sent last, shape (7,)."""
        return (*self.xyz, *self.quat)

    @property
    def is_still(self) -> bool:
        """No part moves."""
        return not any(self.v) and not any(self.w) and not self.u

    def pose(self, wish: Sequence[float] | None, ipo: Sequence[float] | None = None) -> tuple[float, ...]:
        """The pose to send.

        Args:
            wish: a pose, shape (7,); None brakes to a stop. What is not finite of the translation stays as it was
                wished last; a quaternion with such a number, or with none but zeros, stays as a whole.
            ipo: interpolator's pose, for the reach.

        Returns:
            A pose within all limits, shape (7,).
        """
        self.was_limited = False
        if wish is None:
            self.v, self.w = _slower(self.v, self._mosts[0]), _slower(self.w, self._mosts[1])
            self.xyz, self.quat = _plus(self.xyz, self.v), _turned(self.quat, self.w)
            self.goal = (self.xyz, self.quat)
            return self.sent
        before, turned = self.goal
        place, turn = self.goal = self._bounded(wish, before, turned, ipo)
        ahead = _minus(place, self.xyz)
        self.v = self._step(0, ahead, _minus(place, before), self.v)
        self.xyz = place if self.v == ahead else _plus(self.xyz, self.v)
        ahead = _turn(turn, self.quat)
        self.w = self._step(1, ahead, _turn(turn, turned), self.w)
        if self.w == ahead:  # of the two quaternions the one that is next to the last
            near = sum(a * b for a, b in zip(turn, self.quat, strict=True)) >= 0.0
            x, y, z, w = turn
            self.quat = turn if near else (-x, -y, -z, -w)
        else:
            self.quat = _turned(self.quat, self.w)
        return self.sent

    def elbow(self, wish: float | None) -> float:
        """The redundancy angle to send [rad]; to be asked after `pose`.

        Args:
            wish: an angle; None brakes to a stop, NaN keeps the last wish.
        """
        if wish is None:
            self.u = _slower((self.u, 0.0, 0.0), self._mosts[2])[0]
            self.e1 = self._e1_goal = self.e1 + self.u
            return self.e1
        before = self._e1_goal
        if not math.isfinite(wish):
            self._limited(PoseLimited.NOT_FINITE, 2, 0.0, 0.0)
            wish = before
        self._e1_goal = wish
        ahead = wish - self.e1
        self.u = self._step(2, (ahead, 0.0, 0.0), (wish - before, 0.0, 0.0), (self.u, 0.0, 0.0))[0]
        self.e1 = wish if self.u == ahead else self.e1 + self.u
        return self.e1

    # ---------------------------------------------------------------------------------------------- one part

    def _bounded(
        self, wish: Sequence[float], before: Vector, turned: Quaternion, ipo: Sequence[float] | None
    ) -> tuple[Vector, Quaternion]:
        """A wish of finite numbers, within the reach."""
        x, y, z = (
            min(max(new, -FURTHEST), FURTHEST) if math.isfinite(new) else old
            for new, old in zip(wish[:3], before, strict=True)
        )
        place: Vector = (x, y, z)
        if not all(map(math.isfinite, wish[:3])):
            self._limited(PoseLimited.NOT_FINITE, 0, 0.0, 0.0)
        turn = _unit(wish[3:])
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

    def _step(self, part: int, ahead: Vector, pace: Vector, v: Vector) -> Vector:
        """The velocity of this step.

        Args:
            part: 0 translation, 1 rotation, 2 redundancy angle.
            ahead: from here to the wish.
            pace: from the last wish to this one.
            v: the velocity of the last step.
        """
        top, most = self._tops[part], self._mosts[part]
        pace = _within(pace, top)
        lead, change = _minus(ahead, pace), _minus(ahead, v)
        far, speed, bend = _norm(lead), _norm(ahead), _norm(change)
        # on the wish's track, or near enough to be so with the next step
        if speed <= top and bend <= most and far <= most:
            return ahead
        period = self.period
        if speed > top:
            self._limited(PoseLimited.VELOCITY, part, speed / period, self._rates[part])
        else:
            self._limited(PoseLimited.ACCELERATION, part, max(bend, far) / period**2, self._changes[part])
        soft, wanted = SHARE * most, pace
        if far > 0.0:  # as fast as still stops at the moving goal, in steps of `soft`
            rate = min(far, soft * (math.sqrt(0.25 + 2.0 * far / soft) - 0.5))
            wanted = _within(_plus(pace, _times(rate / far, lead)), top)
        return _plus(v, _within(_minus(wanted, v), most))

    def _limited(self, kind: PoseLimited, part: int, asked: float, allowed: float) -> None:
        self.was_limited = True
        self.report.add(kind, part, asked, allowed)


def between(first: Sequence[float], second: Sequence[float]) -> tuple[float, ...]:
    """Translation and rotation vector from one pose to another, base axes, shape (6,) [m, rad]."""
    return (*_minus(second, first), *_turn(second[3:], first[3:]))


def moved(pose: Sequence[float], way: Sequence[float]) -> tuple[float, ...]:
    """A pose, shape (7,), after a translation and a rotation vector in base axes, shape (6,) [m, rad]."""
    return (*_plus(pose, way), *_turned(pose[3:], way[3:]))


def _minus(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _plus(a: Sequence[float], b: Sequence[float]) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _times(factor: float, a: Sequence[float]) -> Vector:
    return (factor * a[0], factor * a[1], factor * a[2])


def _norm(a: Vector) -> float:
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


def _within(a: Vector, most: float) -> Vector:
    """A vector that is no longer than `most`."""
    size = _norm(a)
    return a if size <= most else _times(most / size, a)


def _slower(v: Vector, most: float) -> Vector:
    """A velocity after one step of braking."""
    speed = _norm(v)
    return _ZERO if speed <= most else _times(1.0 - most / speed, v)


def _unit(quat: Sequence[float]) -> Quaternion | None:
    """The unit quaternion of its direction; None if it tells no rotation."""
    x, y, z, w = quat
    size = math.sqrt(x * x + y * y + z * z + w * w)
    if not SHORTEST <= size < math.inf:
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
    """The shortest rotation vector from one unit quaternion to another, base axes [rad]."""
    x, y, z, w = _product(goal, (-here[0], -here[1], -here[2], here[3]))
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return _ZERO
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    return _times(2.0 * math.atan2(sine, w) / sine, (x, y, z))


def _turned(quat: Sequence[float], turn: Sequence[float]) -> Quaternion:
    """A unit quaternion after a rotation vector in base axes [rad]."""
    x, y, z = turn
    angle = _norm((x, y, z))
    share = 0.5 * math.sin(0.5 * angle) / (0.5 * angle) if angle > 1e-12 else 0.5
    x, y, z, w = _product((share * x, share * y, share * z, math.cos(0.5 * angle)), quat)
    size = math.sqrt(x * x + y * y + z * z + w * w)
    return (x / size, y / size, z / size, w / size)
