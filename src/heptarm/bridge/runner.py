"""Runs goals: what is commanded, what is told and how they end, without threads, sockets or clocks.

::

    runner.accept(goal, now=now, state=state)          # raises GoalRefused
    while runner.busy:
        step = runner.advance(now, state)              # command, feedback, ends
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from heptarm.bridge.check import Rules, read
from heptarm.bridge.course import Course, Leg
from heptarm.bridge.goal import Code, End, Goal, Outcome
from heptarm.bridge.tolerance import Bounds, Tolerances
from heptarm.bridge.trajectory import Brake, Sample, Trajectory
from heptarm.errors import LimitError
from heptarm.values.arrays import Array, Value, frozen
from heptarm.values.robot import RobotModel


def _goal_bounds() -> Tolerances:
    position, velocity = frozen(np.full(7, 0.01)), frozen(np.full(7, 0.02))
    return Tolerances(goal=Bounds(position=position, velocity=velocity), goal_time=2.0)


def _two() -> Array:
    return frozen(np.full(7, 2.0))


@dataclass(frozen=True, slots=True, eq=False)
class Settings(Value):
    """How goals are run; may change between goals.

    Attributes:
        rules: what a goal may be.
        tolerances: defaults.
        deceleration: of a cancelled goal, shape (7,) [rad/s²].
        lookahead: how long a command takes to become motion [s]; commands are sampled so much ahead.
    """

    rules: Rules = field(default_factory=Rules)
    tolerances: Tolerances = field(default_factory=_goal_bounds)
    deceleration: Array = field(default_factory=_two)
    lookahead: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Measured(Value):
    """What is known of the arm.

    Attributes:
        time: when it was measured, on the runner's clock [s].
        q: positions, shape (7,) [rad].
        dq: velocities, shape (7,) [rad/s]; NaN: not known.
        scaling: factor on the speed of all motions, 0 or more: the cabinet's override; 0 while it pauses.
    """

    time: float
    q: Array
    dq: Array
    scaling: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Feedback(Value):
    """How far a goal is.

    Attributes:
        number: of the goal.
        desired: where the arm should be.
        actual: where it is; its acceleration is not known and told as 0.
        time: of the trajectory, scaled [s].
        elapsed: since its start [s].
        index: of the way-point being approached.
    """

    number: int
    desired: Sample
    actual: Sample
    time: float
    elapsed: float
    index: int


@dataclass(frozen=True, slots=True)
class Step:
    """What comes of one step.

    Attributes:
        command: where to go, now.
        course: where to go from now on.
        feedback: of the goal under way; None: there is none.
        ends: goals that ended since the last step.
    """

    command: Sample
    course: Course
    feedback: Feedback | None
    ends: tuple[End, ...]


@dataclass(slots=True, eq=False)
class _Running:
    number: int
    goal: Goal
    trajectory: Trajectory
    tolerances: Tolerances
    begin: float | None  # None: with the next step
    tau: float = 0.0
    looked: bool = False
    over: float | None = None  # when the end of the trajectory was reached
    offset: int = 0  # way-points that were left out or put before the goal's own
    late: float = 0.0  # how long ago the goal's start was when it came


class Runner:
    """At most one goal at a time; a new one takes the place of the old one.

    Args:
        names: of the joints, seven, in the arm's order.
        robot: its limits.
        settings: see `Settings`.

    Attributes:
        settings: may be exchanged; a goal under way keeps its tolerances.
    """

    def __init__(self, names: Sequence[str], robot: RobotModel, settings: Settings | None = None) -> None:
        self.names = tuple(names)
        self.settings = settings or Settings()
        self._robot = robot
        self._running: _Running | None = None
        self._brake: tuple[float, Brake] | None = None
        self._command: Sample | None = None
        self._now: float | None = None
        self._scaling = 1.0
        self._ends: list[End] = []
        self._number = 0
        self.warning = ""

    @property
    def busy(self) -> bool:
        """Whether a goal is under way or the arm is braking."""
        return self._running is not None or self._brake is not None

    @property
    def goal(self) -> int:
        """Number of the goal under way; 0: none."""
        return 0 if self._running is None else self._running.number

    def accept(self, goal: Goal, *, now: float, state: Measured) -> int:
        """Take a goal; one under way ends as preempted.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it makes no sense; whatever ran goes on.
        """
        now = self._instant(now)
        later = goal.start is not None and goal.start > now
        brake = self._braking(now) if later and self.busy else self._brake
        here = self._here(now, state)
        if later and goal.start is not None:
            here = brake[1].sample(goal.start - brake[0]) if brake is not None else Sample.at_rest(here.q)
        trajectory = read(goal, self.names, self._robot, here=here, now=now, rules=self.settings.rules)
        tolerances, self.warning = self.settings.tolerances.of(goal, self.names)
        self._end(Outcome.PREEMPTED, Code.INVALID_GOAL, "another goal took the place of this one")
        self._brake = brake if later else None
        self._number += 1
        begin = goal.start if later else None if self._now is None else now
        offset = len(trajectory.times) - len(goal.points)
        late = 0.0 if goal.start is None or later else now - goal.start
        self._running = _Running(self._number, goal, trajectory, tolerances, begin, offset=offset, late=late)
        return self._number

    def at(self, time: float) -> Sample | None:
        """What the goal under way wants at a time [s]; None: there is none, or it has not begun or is over then."""
        run = self._running
        if run is None or run.begin is None or time < run.begin:
            return None
        looked = run.begin if self._now is None else max(self._now, run.begin)
        tau = run.tau + time - looked
        return run.trajectory.sample(tau) if 0.0 <= tau <= run.trajectory.duration else None

    def cancel(self, number: int, now: float) -> bool:
        """End a goal early; the arm brakes. False: it is not under way."""
        if self._running is None or self._running.number != number:
            return False
        self._brake = self._braking(now)
        self._end(Outcome.CANCELED, Code.SUCCESSFUL, "cancelled; the arm brakes")
        return True

    def abort(self, text: str, *, now: float | None = None) -> None:
        """End the goal under way because of something outside.

        Args:
            text: why.
            now: brake from here; None: the arm follows no more, so there is nothing to command.
        """
        self._brake = None if now is None else self._braking(now)
        self._end(Outcome.ABORTED, Code.INVALID_GOAL, text)
        if now is None:
            self.forget()

    def forget(self) -> None:
        """The arm follows no more: the next goal starts from where it is measured."""
        self._brake, self._command, self._now = None, None, None

    def ends(self) -> tuple[End, ...]:
        """Goals that ended since this was asked, or since the last step."""
        ended, self._ends = tuple(self._ends), []
        return ended

    def advance(self, now: float, state: Measured) -> Step:
        """One step.

        Args:
            now: the time [s]; never earlier than before.
            state: the newest measurement.

        Raises:
            LimitError: the scaling is negative or not a number.
        """
        if not state.scaling >= 0.0:
            raise LimitError(f"scaling is {state.scaling}; 0 or more is wanted", parameter="scaling")
        passed = 0.0 if self._now is None else max(0.0, now - self._now)
        self._now = now
        self._scaling = state.scaling
        feedback = None
        if self._running is not None:
            feedback = self._follow(self._running, now, passed, state)
        if self._brake is not None and (self._running is None or self._waits(now)):
            self._command = self._brake[1].sample(now - self._brake[0])
            if now - self._brake[0] >= self._brake[1].duration:
                self._brake = None
        if self._command is None:
            self._command = Sample.at_rest(state.q)
        return Step(self._command, self._course(now, self._command), feedback, self.ends())

    # ------------------------------------------------------------------------------------ inside

    def _waits(self, now: float) -> bool:
        return self._running is not None and self._running.begin is not None and now < self._running.begin

    def _course(self, now: float, command: Sample) -> Course:
        """Where the arm is led from this step on."""
        run, brake, pace = self._running, self._brake, self._scaling
        legs: list[Leg] = []
        waits = self._waits(now)
        if run is None or waits:
            path = brake[1] if brake is not None else self._brake_from(Sample.at_rest(command.q))
            legs.append(Leg(now if brake is None else brake[0], path))
        if run is not None:
            begin = run.begin if waits and run.begin is not None else now
            legs.append(Leg(begin, run.trajectory, run.tau + pace * self.settings.lookahead, pace))
        key = (0.0 if run is None else run.number, waits, 0.0 if brake is None else brake[0], pace)
        return Course(key, tuple(legs))

    def _instant(self, now: float) -> float:
        """When something that comes now changes the course: from the last step on, for all before is commanded."""
        return now if self._now is None else self._now

    def _follow(self, run: _Running, now: float, passed: float, state: Measured) -> Feedback | None:
        """One step of the goal under way."""
        if run.begin is None:
            run.begin = now
        elif now > run.begin:
            run.tau += state.scaling * min(passed, now - run.begin)
        elif now < run.begin:
            return None
        else:
            run.tau = 0.0
        self._brake = None
        way = run.trajectory
        self._command = way.sample(run.tau + state.scaling * self.settings.lookahead)
        # the measurement is older than now: hold against it where the arm should have been then
        age = min(max(0.0, now - state.time), now - run.begin)
        then = max(0.0, run.tau - state.scaling * age)
        desired = way.sample(then)
        actual = Sample(state.q, state.dq, np.zeros(7))
        index = max(way.index(run.tau), min(1, len(way.times) - 1)) - run.offset
        elapsed = now - run.begin + run.late
        feedback = Feedback(run.number, desired, actual, run.tau + run.late, elapsed, index)
        self._judge(run, now, desired, state)
        return feedback

    def _judge(self, run: _Running, now: float, desired: Sample, state: Measured) -> None:
        """Whether the goal ends with this step."""
        arrived = run.tau >= run.trajectory.duration
        if not arrived or not run.looked:
            run.looked = True
            broken = run.tolerances.path.worst(self.names, desired, state.q, state.dq)
            if broken:
                self._end(Outcome.ABORTED, Code.PATH_TOLERANCE_VIOLATED, f"off the path: {broken}")
                self._brake = self._braking(now)
                return
        if not arrived:
            return
        if run.over is None:
            run.over = now
        broken = run.tolerances.goal.worst(self.names, run.trajectory.end, state.q, state.dq)
        waited = now - run.over
        if not broken:
            self._end(Outcome.SUCCEEDED, Code.SUCCESSFUL, "the arm has arrived")
            self._brake = self._braking(now) if run.trajectory.end.dq.any() else None
        elif run.tolerances.goal_time > 0.0 and waited > run.tolerances.goal_time:
            text = f"not there {waited:.3f} s after the end: {broken}"
            self._end(Outcome.ABORTED, Code.GOAL_TOLERANCE_VIOLATED, text)
            self._brake = self._braking(now)
        else:  # the end is waited for at rest, though the arm was to pass it
            self._command = Sample.at_rest(run.trajectory.end.q)

    def _here(self, now: float, state: Measured) -> Sample:
        """Where a new trajectory begins: where the arm is told to be, or where it is if it is told nothing."""
        run = self._running
        if run is not None and (run.begin is None or now >= run.begin):
            return run.trajectory.sample(run.tau)
        if self._brake is not None:
            return self._brake[1].sample(now - self._brake[0])
        if self._command is not None:
            return Sample.at_rest(self._command.q)
        return Sample.at_rest(state.q)

    def _braking(self, now: float) -> tuple[float, Brake] | None:
        """A way to rest from what is commanded now."""
        if self._brake is not None:
            return self._brake
        if self._command is None:
            return None
        begin = replace(self._command, dq=self._scaling * self._command.dq, ddq=np.zeros(7))
        return self._instant(now), self._brake_from(begin)

    def _brake_from(self, begin: Sample) -> Brake:
        return Brake(begin, self.settings.deceleration, self._robot.q_min, self._robot.q_max)

    def _end(self, outcome: Outcome, code: Code, text: str) -> None:
        if self._running is not None:
            self._ends.append(End(self._running.number, outcome, code, text))
            self._running = None
