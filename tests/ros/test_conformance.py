"""The cases of conformance against the runner alone, in simulated time: the base of every node."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from heptarm.errors import HeptarmError
from heptarm.ros.node.parameters import NodeConfiguration
from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalRefused, GoalResult, TrajectoryGoal
from heptarm.ros.trajectory.runner import GoalFeedback, MeasuredJoints, TrajectoryRunner
from heptarm.ros.trajectory.trajectory import KinematicState
from heptarm.values.checks import Array
from heptarm.values.robot import robot
from tests.conformance.case import HOME
from tests.conformance.cases import CASES
from tests.conformance.client import ReceivedFeedback, ReceivedResult, SentGoal

PERIOD = 0.01


class Bare:
    """A client of a runner; the arm is a few numbers."""

    preempted: tuple[GoalOutcome, ...] = (GoalOutcome.PREEMPTED,)
    timely = True
    empty_stops = True

    def __init__(self) -> None:
        self._values: dict[str, object] = {}
        configuration = NodeConfiguration.of({})
        self.joints = configuration.joints
        self._runner = TrajectoryRunner(self.joints, robot("iiwa14"), configuration.settings)
        self._time, self._q, self._dq = 100.0, HOME.copy(), np.zeros(7)
        self._how, self._scaling, self._active = "follows", 1.0, True
        self._slept = 0.0  # less than a period: it has not passed yet
        self._late: deque[KinematicState] = deque()
        self._ends: dict[int, GoalResult] = {}
        self._reported: dict[int, list[GoalFeedback]] = {}
        self._track: list[tuple[float, Array]] = []

    def now(self) -> float:
        return self._time + self._slept

    def sleep(self, seconds: float) -> None:
        self._slept += seconds
        while self._slept >= PERIOD - 1e-9:
            self._slept -= PERIOD
            self._tick()

    def place(self) -> KinematicState:
        return KinematicState(self._q.copy(), self._dq.copy(), np.zeros(7))

    def track(self, begin: float) -> list[tuple[float, Array]]:
        return [(time, q) for time, q in self._track if time >= begin]

    def send(self, goal: TrajectoryGoal) -> SentGoal:
        try:
            if not self._active:
                raise GoalRefused("inactive")
            return SentGoal(True, handle=self._runner.accept(goal, now=self.now(), state=self._measured()))
        except GoalRefused as error:
            return SentGoal(False, error.reason)

    def cancel(self, sent: SentGoal) -> bool:
        assert isinstance(sent.handle, int)
        self._runner.cancel(sent.handle, self._time)
        return True

    def result(self, sent: SentGoal, timeout: float = 60.0) -> ReceivedResult:
        assert isinstance(sent.handle, int)
        until = self._time + timeout
        while self._time < until:
            self._collect(self._runner.take_results())
            if sent.handle in self._ends:
                end = self._ends[sent.handle]
                return ReceivedResult(end.outcome, end.code, end.text)
            self._tick()
        raise TimeoutError("the goal does not end")

    def feedback(self, sent: SentGoal) -> list[ReceivedFeedback]:
        assert isinstance(sent.handle, int)
        return [
            ReceivedFeedback(
                self.joints,
                one.desired,
                one.actual,
                one.desired.q - one.actual.q,
                one.time,
                one.elapsed,
                one.index,
            )
            for one in self._reported.get(sent.handle, [])
        ]

    def behave(self, how: str) -> None:
        self._how = how
        self._late.clear()

    def override(self, value: float) -> None:
        self._scaling = value

    def set(self, **values: object) -> bool:
        wanted = self._values | {name.replace("__", "."): value for name, value in values.items()}
        try:
            self._runner.settings = NodeConfiguration.of(wanted).settings
        except HeptarmError:
            return False
        self._values = wanted
        return True

    def activate(self, *, on: bool) -> None:
        self._active = on
        if not on:
            self._runner.abort("deactivated", now=self._time)

    def topic(self, goal: TrajectoryGoal) -> None:
        if goal.points:
            self.send(replace(goal, from_topic=True))
        else:
            self._runner.cancel(self._runner.goal, self._time)

    def _measured(self) -> MeasuredJoints:
        return MeasuredJoints(self._time, self._q, self._dq, self._scaling)

    def _tick(self) -> None:
        self._time += PERIOD
        step = self._runner.advance(self._time, self._measured())
        self._collect(step.results)
        if step.feedback is not None:
            self._reported.setdefault(step.feedback.number, []).append(step.feedback)
        if step.command is None or self._how == "frozen":
            self._dq = np.zeros(7)
            return
        command = step.command
        if self._how == "lags":
            self._late.append(command)
            if len(self._late) <= 40:
                return
            command = self._late.popleft()
        self._dq = (command.q - self._q) / PERIOD
        self._q = command.q + 1e-6  # no arm is exact
        self._track.append((self._time, self._q))

    def _collect(self, ends: tuple[GoalResult, ...]) -> None:
        self._ends.update({end.number: end for end in ends})


@pytest.mark.parametrize("name", CASES)
def test_case(name: str) -> None:
    CASES[name](Bare())


def test_there_are_enough_cases_and_all_codes_are_among_their_ends() -> None:
    assert len(CASES) >= 130
    assert {code.name for code in ErrorCode} >= {"PATH_TOLERANCE_VIOLATED", "GOAL_TOLERANCE_VIOLATED"}
