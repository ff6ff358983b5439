"""Evaluates break conditions, triggers and observed conditions once per tick."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import hypot, inf
from typing import Protocol

import numpy as np

from heptarm.model.kinematics import flange
from heptarm.planning import seam
from heptarm.planning.jerk_profile import TimeLaw
from heptarm.planning.motion import ServoMotion
from heptarm.planning.plan import Plan
from heptarm.sim.controller.command import ConditionWatch
from heptarm.values.checks import Array
from heptarm.values.pose import rotation
from heptarm.values.robot import RobotModel

Vec = tuple[float, float, float]

_HALVINGS = 30


class LoadEstimate(Protocol):
    """External load of the arm, as the controller estimates it.

    Attributes:
        torque: acting on the joints, shape (7,) [Nm].
        wrench: acting on the flange, base axes, shape (6,) [N, Nm].
    """

    torque: Array
    wrench: Array


class ConditionInputs:
    """State of the plant in one tick, as conditions read it.

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

    def update(self, q: Array, external: Array, wrench: Array, elapsed: float) -> None:
        """Take the state of a tick: joints [rad], external torques [Nm], wrench at the flange, motion time [s]."""
        self._q, self.external, self._wrench, self.elapsed, self._pose = q, external, wrench, elapsed, None

    def signal(self, index: int) -> float:
        """Value of a signal."""
        return float(self._signals[index])

    def wrench(self, frame: WrenchFrame) -> tuple[float, ...]:
        """Force and torque at a frame's origin, in its axes, 6 entries."""
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
        return *_turned(frame.axes, force), *_turned(frame.axes, torque)


def _turned(columns: tuple[Vec, Vec, Vec], v: Vec) -> Vec:
    """Components of a vector along three axes."""
    x, y, z = ((c[0] * v[0] + c[1] * v[1] + c[2] * v[2]) for c in columns)
    return x, y, z


@dataclass(frozen=True, slots=True)
class WrenchFrame:
    """Point and axes in which a wrench is expressed.

    Attributes:
        is_point_carried: the point moves with the flange.
        point: in the flange's axes, or in the base [m].
        are_axes_carried: the axes turn with the flange.
        axes: their columns in the flange's axes, or in the base.
    """

    is_point_carried: bool
    point: Vec
    are_axes_carried: bool
    axes: tuple[Vec, Vec, Vec]

    @staticmethod
    def of(frame: seam.MeasuringFrame) -> WrenchFrame:
        """The frame of a condition."""
        columns = rotation(np.array(frame.axes)).T.tolist()
        x, y, z = frame.point
        return WrenchFrame(frame.point_moves, (x, y, z), frame.axes_move, tuple(map(tuple, columns)))  # type: ignore[arg-type]


Predicate = Callable[[ConditionInputs], bool]


@dataclass(slots=True, eq=False)
class PathPoint:
    """A point on a path; its time has to be found for each motion.

    Attributes:
        from_start: whether it counts from the start.
        distance: from the start, or, negative, to the end [m].
        delay: time after the point [s].
        due: time of the motion's profile at which it is reached [s].
    """

    from_start: bool
    distance: float
    delay: float
    due: float = inf

    def __call__(self, inputs: ConditionInputs) -> bool:
        """Whether it is reached."""
        return inputs.elapsed >= self.due

    def find(self, plan: Plan, part: int) -> None:
        """Find it on the path of a motion, or of a part of it; a motion without a path has only its ends."""
        self.due = inf
        timing, lengths = plan.timing, plan.lengths
        if timing is None or lengths is None:
            is_still = isinstance(plan.motion, seam.Hold | ServoMotion)
            if not is_still and not (self.from_start and self.distance > 0):
                self.due = max(0.0, self.delay)
            return
        low, high = plan.span(part)
        place = lengths.find(self.distance, low, high, from_start=self.from_start)
        if place is not None:
            begin = _time(timing.profile, low)
            self.due = max(begin, (begin if place == low else _time(timing.profile, place)) + self.delay)


def _time(profile: TimeLaw, s: float) -> float:
    """Time at which s is reached [s]."""
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
class WatchedCondition:
    """A condition that is evaluated in every tick.

    Attributes:
        holds: the condition.
        notify: called when it begins or ceases to hold, from the tick.
        breaks: it ends the motion it belongs to.
        part: see `ConditionWatch`.
        points: points on the path that it contains.
        at_once: also notify if it holds at the first evaluation.
        held: its last value; None before the first evaluation.
    """

    holds: Predicate
    notify: Callable[[bool], None]
    breaks: bool = False
    part: int = -1
    points: tuple[PathPoint, ...] = ()
    at_once: bool = True
    held: bool | None = field(default=None)

    def applies_to(self, part: int) -> bool:
        """Whether it is evaluated while a part runs; a point on the path may be due after its own part."""
        return self.part < 0 or self.part == part or (self.part < part and isinstance(self.holds, PathPoint))

    def check(self, inputs: ConditionInputs) -> bool:
        """Evaluate it and report a change; returns whether it holds."""
        holds = self.holds(inputs)
        if holds is not self.held:
            first, self.held = self.held is None, holds
            if not first or (holds and self.at_once):
                self.notify(holds)
        return holds


class ConditionMonitor:
    """Evaluates the conditions of a plant.

    Args:
        robot: the robot.
        signals: values of the IO image by index.
    """

    def __init__(self, robot: RobotModel, signals: Array) -> None:
        self._inputs = ConditionInputs(robot, signals)
        self._observers: dict[int, WatchedCondition] = {}
        self._last = 0

    def observe(self, condition: seam.Condition, notify: Callable[[bool], None], *, at_once: bool) -> int:
        """Observe a condition independently of motions, until `forget`; from any thread.

        Args:
            condition: the condition.
            notify: called from the tick when it begins or ceases to hold.
            at_once: also call it if the condition holds already.
        """
        made = watched_condition(condition, notify)
        made.at_once = at_once
        self._last += 1
        self._observers = {**self._observers, self._last: made}  # the tick may be iterating over the old one
        return self._last

    def forget(self, number: int) -> None:
        """Stop observing a condition."""
        self._observers = {key: observer for key, observer in self._observers.items() if key != number}

    def begin(self, plan: Plan, watches: Sequence[ConditionWatch]) -> tuple[WatchedCondition, ...]:
        """The conditions to evaluate while a motion runs, of a command with this plan."""
        made = tuple(
            watched_condition(watch.condition, _once(watch.fired), breaks=watch.breaks, part=watch.part)
            for watch in watches
        )
        for watch in made:
            for point in watch.points:
                point.find(plan, watch.part)
        return made

    @property
    def is_busy(self) -> bool:
        """Whether conditions are observed that belong to no motion."""
        return bool(self._observers)

    def check(
        self,
        q: Array,
        external: Array,
        wrench: Array,
        *,
        watches: Sequence[WatchedCondition],
        elapsed: float,
        part: int = 0,
    ) -> bool:
        """Evaluate all conditions in this tick; returns whether a break condition of the motion holds.

        Args:
            q: joint positions, shape (7,) [rad].
            external: external load of the joints, shape (7,) [Nm].
            wrench: external wrench at the flange in base axes, shape (6,).
            watches: conditions of the running motion.
            elapsed: time of its profile [s].
            part: running part of a batch or a spline.
        """
        observers = self._observers
        if not observers and not watches:
            return False
        self._inputs.update(q, external, wrench, elapsed)
        for observer in observers.values():
            observer.check(self._inputs)
        breaks = [watch.check(self._inputs) and watch.breaks for watch in watches if watch.applies_to(part)]
        return any(breaks)


def _once(fired: Callable[[], None]) -> Callable[[bool], None]:
    """Call `fired` at the first time only."""
    is_done = False

    def notify(holds: bool) -> None:
        nonlocal is_done
        if holds and not is_done:
            is_done = True
            fired()

    return notify


def watched_condition(
    condition: seam.Condition, notify: Callable[[bool], None], *, breaks: bool = False, part: int = -1
) -> WatchedCondition:
    """Prepare a condition for evaluation in every tick."""
    points: list[PathPoint] = []
    return WatchedCondition(_predicate(condition, points), notify, breaks, part, tuple(points))


def _predicate(condition: seam.Condition, points: list[PathPoint]) -> Predicate:
    """The predicate of a condition; collects its points on the path."""
    if isinstance(condition, seam.AllOf | seam.AnyOf):
        combine = all if isinstance(condition, seam.AllOf) else any
        parts = [_predicate(part, points) for part in condition.parts]
        return lambda inputs: combine(part(inputs) for part in parts)
    if isinstance(condition, seam.Inverted):
        inverted = _predicate(condition.part, points)
        return lambda inputs: not inverted(inputs)
    if isinstance(condition, seam.PathReached):
        points.append(
            PathPoint(condition.reference is seam.PathReference.START, condition.distance, condition.delay)
        )
        return points[-1]
    if isinstance(condition, seam.SignalIs):
        return lambda inputs: (inputs.signal(condition.place) != 0.0) == condition.value
    if isinstance(condition, seam.SignalOutside):
        return lambda inputs: not condition.low <= inputs.signal(condition.place) <= condition.high
    if isinstance(condition, seam.JointTorqueOutside):
        return lambda inputs: not condition.low <= float(inputs.external[condition.joint]) <= condition.high
    frame = WrenchFrame.of(condition.frame)
    if isinstance(condition, seam.WrenchAbove):
        chosen = [i for i, component in enumerate(seam.WrenchComponents) if component in condition.components]
        return lambda inputs: hypot(*(inputs.wrench(frame)[i] for i in chosen)) > condition.threshold
    return lambda inputs: not condition.low <= inputs.wrench(frame)[condition.component] <= condition.high
