"""Conditions as the plant watches them, once a tick, in few sums.

Java hands a condition over as numbers in postfix order (heptarm.doubles.ConditionOrder), each node as its kind and
what belongs to it:

    1 joint torque: joint, low, high            7 boolean signal: index, value
    2 force, 3 along, 4 across an axis:         8 number signal: index, low, high
      frame, axis, threshold                    9 point on the path: 0 from the start or 1 to the end, [m], [s]
    5 force, 6 torque along or about an axis:   32 all, 33 any of the last n, 34 not: n
      frame, axis, low, high

A frame is nine numbers: 1 if its point is fixed to the flange, x y z there or in the base; 1 if its axes are fixed to
the flange, their quaternion there or in the base.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot, inf, sqrt

import numpy as np

from heptarm.model.kinematics import flange
from heptarm.values.arrays import Array
from heptarm.values.pose import rotation
from heptarm.values.robot import RobotModel
from heptarm.virtual.planner import Plan
from heptarm.virtual.profile import TimeLaw
from heptarm.virtual.way import Way

Vec = tuple[float, float, float]

_HALVINGS = 30


class Sight:
    """What conditions see of the plant in one tick.

    Args:
        robot: the robot.
        signals: values of the IO image by index.

    Attributes:
        external: external load of the joints, shape (7,) [Nm].
        elapsed: time of the running motion's profile [s].
    """

    def __init__(self, robot: RobotModel, signals: Array) -> None:
        self._robot = robot
        self._signals = signals
        self._q: Array = np.zeros(7)
        self._wrench: Array = np.zeros(6)
        self._pose: tuple[tuple[Vec, Vec, Vec], Vec] | None = None
        self.external: Array = np.zeros(7)
        self.elapsed = 0.0

    def renew(self, q: Array, external: Array, wrench: Array, elapsed: float) -> None:
        """Look anew: joints [rad], their external load [Nm], wrench at the flange in base axes, the motion's time."""
        self._q, self.external, self._wrench, self.elapsed, self._pose = q, external, wrench, elapsed, None

    def signal(self, index: int) -> float:
        """Value of a signal."""
        return float(self._signals[index])

    def seen(self, frame: Frame) -> tuple[Vec, Vec]:
        """Force and torque at a frame's point, in its axes."""
        fx, fy, fz, tx, ty, tz = self._wrench.tolist()
        if self._pose is None:
            self._pose = flange(self._robot, self._q.tolist())
        columns, (px, py, pz) = self._pose
        ax, ay, az = frame.point
        if frame.is_point_carried:
            dx, dy, dz = (-(columns[0][i] * ax + columns[1][i] * ay + columns[2][i] * az) for i in range(3))
        else:
            dx, dy, dz = px - ax, py - ay, pz - az
        force = (fx, fy, fz)
        torque = (tx + dy * fz - dz * fy, ty + dz * fx - dx * fz, tz + dx * fy - dy * fx)
        if frame.are_axes_carried:
            force, torque = _turned(columns, force), _turned(columns, torque)
        return _turned(frame.axes, force), _turned(frame.axes, torque)


def _turned(columns: tuple[Vec, Vec, Vec], v: Vec) -> Vec:
    """Components of a vector along three axes."""
    x, y, z = ((c[0] * v[0] + c[1] * v[1] + c[2] * v[2]) for c in columns)
    return x, y, z


@dataclass(frozen=True, slots=True)
class Frame:
    """Where and along which axes a wrench is seen.

    Attributes:
        is_point_carried: the point moves with the flange.
        point: seen from the flange, or in the base [m].
        are_axes_carried: the axes turn with the flange.
        axes: their columns, seen from the flange, or in the base.
    """

    is_point_carried: bool
    point: Vec
    are_axes_carried: bool
    axes: tuple[Vec, Vec, Vec]

    @staticmethod
    def of(numbers: Sequence[float]) -> Frame:
        """A frame from its nine numbers."""
        columns = rotation(np.array(numbers[5:9])).T.tolist()
        x, y, z = numbers[1:4]
        return Frame(bool(numbers[0]), (x, y, z), bool(numbers[4]), tuple(map(tuple, columns)))  # type: ignore[arg-type]


Holds = Callable[[Sight], bool]


@dataclass(slots=True, eq=False)
class PathPoint:
    """A point on a path; where it is has to be found for each motion.

    Attributes:
        from_start: whether it counts from the start.
        distance: from the start, or, negative, to the end [m].
        delay: so long after the point [s].
        due: time of the motion's profile at which it is reached [s].
    """

    from_start: bool
    distance: float
    delay: float
    due: float = inf

    def __call__(self, sight: Sight) -> bool:
        """Whether it is reached."""
        return sight.elapsed >= self.due

    def find(self, robot: RobotModel, plan: Plan, part: int) -> None:
        """Find it on the path of a motion, or of a part of it; one that is there already has its ends only."""
        self.due = inf
        path, profile = plan.path, plan.profile
        if path is None or profile is None:
            is_still = plan.order.kind == "hold" or plan.order.is_servo
            if not is_still and not (self.from_start and self.distance > 0):
                self.due = max(0.0, self.delay)
            return
        way = plan.way or Way.along(robot, path, plan.start, plan.order.tcp)
        low, high = plan.span(part)
        place = way.place(self.distance, low, high, from_start=self.from_start)
        if place is not None:
            begin = _time(profile, low)
            self.due = max(begin, (begin if place == low else _time(profile, place)) + self.delay)


def _time(profile: TimeLaw, s: float) -> float:
    """When s is reached [s]."""
    if s <= 0.0:
        return 0.0
    low, high = 0.0, profile.duration
    if s >= 1.0:
        return high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if profile.at(middle)[0] < s else (low, middle)
    return high


@dataclass(slots=True, eq=False)
class Watching:
    """A condition that is watched.

    Attributes:
        holds: whether it holds.
        tell: called when it begins or ceases to hold, from the tick.
        breaks: it ends the motion it belongs to.
        part: see `Watch`.
        points: points on the path in it.
        at_once: told of, too, if it holds when looked at first.
        held: whether it held when looked at last; None before the first look.
    """

    holds: Holds
    tell: Callable[[bool], None]
    breaks: bool = False
    part: int = -1
    points: tuple[PathPoint, ...] = ()
    at_once: bool = True
    held: bool | None = field(default=None)

    def concerns(self, part: int) -> bool:
        """Whether it is watched while a part runs; a mere point of the path may lie some time behind its own part."""
        return self.part < 0 or self.part == part or (self.part < part and isinstance(self.holds, PathPoint))

    def look(self, sight: Sight) -> bool:
        """Look at it, and tell of a change; says whether it holds."""
        holds = self.holds(sight)
        if holds is not self.held:
            first, self.held = self.held is None, holds
            if not first or (holds and self.at_once):
                self.tell(holds)
        return holds


class Lookout:
    """Looks at the conditions of a plant.

    Args:
        robot: the robot.
        signals: values of the IO image by index.
    """

    def __init__(self, robot: RobotModel, signals: Array) -> None:
        self._robot = robot
        self._sight = Sight(robot, signals)
        self._observers: dict[int, Watching] = {}
        self._last = 0

    def observe(self, numbers: Sequence[float], tell: Callable[[bool], None], *, at_once: bool) -> int:
        """Watch a condition whatever moves, until `forget`; from any thread.

        Args:
            numbers: the condition.
            tell: called from the tick when it begins or ceases to hold.
            at_once: call it, too, if it holds already.
        """
        made = watching(numbers, tell)
        made.at_once = at_once
        self._last += 1
        self._observers = {**self._observers, self._last: made}  # the tick may be going through the old one
        return self._last

    def forget(self, number: int) -> None:
        """Watch a condition no more."""
        self._observers = {key: one for key, one in self._observers.items() if key != number}

    def begin(self, plan: Plan) -> tuple[Watching, ...]:
        """What to watch while a motion runs."""
        made = tuple(
            watching(one.condition, _once(one.fired), breaks=one.breaks, part=one.part)
            for one in plan.order.watches
        )
        for one in made:
            for point in one.points:
                point.find(self._robot, plan, one.part)
        return made

    @property
    def is_busy(self) -> bool:
        """Whether conditions are observed that belong to no motion."""
        return bool(self._observers)

    def look(
        self,
        q: Array,
        external: Array,
        wrench: Array,
        *,
        watches: Sequence[Watching],
        elapsed: float,
        part: int = 0,
    ) -> bool:
        """Look at everything in this tick; says whether a motion's break condition begins to hold.

        Args:
            q: joint positions, shape (7,) [rad].
            external: external load of the joints, shape (7,) [Nm].
            wrench: external wrench at the flange in base axes, shape (6,).
            watches: what belongs to the running motion.
            elapsed: time of its profile [s].
            part: of a batch or a spline: which part of it runs.
        """
        observers = self._observers
        if not observers and not watches:
            return False
        self._sight.renew(q, external, wrench, elapsed)
        for observer in observers.values():
            observer.look(self._sight)
        breaks = [one.look(self._sight) and one.breaks for one in watches if one.concerns(part)]
        return any(breaks)


def _once(fired: Callable[[], None]) -> Callable[[bool], None]:
    """Tell of the first time only."""
    told = False

    def tell(holds: bool) -> None:
        nonlocal told
        if holds and not told:
            told = True
            fired()

    return tell


def watching(
    numbers: Sequence[float], tell: Callable[[bool], None], *, breaks: bool = False, part: int = -1
) -> Watching:
    """A condition from its numbers.

    Raises:
        ValueError: they are none.
    """
    points: list[PathPoint] = []
    stack: list[Holds] = []
    at = 0
    while at < len(numbers):
        kind = int(numbers[at])
        size = _SIZES.get(kind)
        if size is None:
            raise ValueError(f"no condition of kind {kind}")
        values = numbers[at + 1 : at + 1 + size]
        at += 1 + size
        if kind >= 32:
            count = int(values[0])
            parts = tuple(stack[len(stack) - count :])
            del stack[len(stack) - count :]
            stack.append(_combined(kind, parts))
        elif kind == 9:
            points.append(PathPoint(values[0] == 0, values[1], values[2]))
            stack.append(points[-1])
        else:
            stack.append(_leaf(kind, values))
    if len(stack) != 1:
        raise ValueError(f"the numbers of a condition leave {len(stack)} results")
    return Watching(stack[0], tell, breaks, part, tuple(points))


_SIZES = {1: 3, 2: 11, 3: 11, 4: 11, 5: 12, 6: 12, 7: 2, 8: 3, 9: 3, 32: 1, 33: 1, 34: 1}


def _combined(kind: int, parts: tuple[Holds, ...]) -> Holds:
    if kind == 32:
        return lambda sight: all(part(sight) for part in parts)
    if kind == 33:
        return lambda sight: any(part(sight) for part in parts)
    (part,) = parts
    return lambda sight: not part(sight)


def _leaf(kind: int, values: Sequence[float]) -> Holds:
    index = int(values[0])
    if kind == 1:
        return lambda sight: not values[1] <= float(sight.external[index]) <= values[2]
    if kind == 7:
        return lambda sight: (sight.signal(index) != 0.0) == bool(values[1])
    if kind == 8:
        return lambda sight: not values[1] <= sight.signal(index) <= values[2]
    frame, axis = Frame.of(values[:9]), int(values[9])
    if kind in (5, 6):
        which, low, high = kind - 5, values[10], values[11]
        return lambda sight: not low <= sight.seen(frame)[which][axis] <= high
    threshold = values[10]
    if kind == 2:
        return lambda sight: hypot(*sight.seen(frame)[0]) > threshold
    if kind == 3:
        return lambda sight: abs(sight.seen(frame)[0][axis]) > threshold
    others = [i for i in range(3) if i != axis]
    return lambda sight: sqrt(sum(sight.seen(frame)[0][i] ** 2 for i in others)) > threshold
