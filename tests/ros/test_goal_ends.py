"""How goals end on an arm that only takes note: before their motion, in the order of stops, and on a slow arm."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from heptarm.ros.trajectory.goal import ErrorCode, GoalOutcome, GoalResult, TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.runner import ControlStep, GoalFeedback
from heptarm.ros.trajectory.spline_execution import SplineExecution
from heptarm.ros.trajectory.streamed_execution import CommandStream, StreamedExecution
from heptarm.values.result import Cause
from heptarm.values.robot import robot

NAMES = tuple(f"A{i}" for i in range(1, 8))
HOME = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
PATIENCE = 10.0
STATE = SimpleNamespace(
    stamp=0,
    sampled=0,
    joints=None,
    q=HOME,
    q_cmd=HOME,
    dq=np.zeros(7),
    motion=None,
    groups=SimpleNamespace(safety=None),
)
GOAL = TrajectoryGoal(NAMES, (TrajectoryPoint(1.0, tuple(HOME + 0.1)),))


class Results:
    """Receives results."""

    def __init__(self) -> None:
        self.results: list[GoalResult] = []
        self._changed = threading.Condition()

    def on_feedback(self, feedback: GoalFeedback) -> None:
        pass

    def on_result(self, result: GoalResult) -> None:
        with self._changed:
            self.results.append(result)
            self._changed.notify_all()

    def until(self, count: int) -> GoalResult:
        """Wait for so many results; returns the last one."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.results) >= count, PATIENCE), self.results
            return self.results[-1]


class StillStream:
    """A motion that is never commanded to leave home."""

    end_reason = "the test is over"

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self.commands: list[Any] = []

    def tick(self) -> float:
        threading.Event().wait(1e-3)
        return self._now()

    def command(self, step: ControlStep) -> None:
        self.commands.append(step.command.q)


class Streamed(StreamedExecution):
    """Opens its motion when a test lets it."""

    def __init__(self, arm: Any, listener: Results) -> None:
        self.opening, self.may_open = threading.Event(), threading.Event()
        self.stream = StillStream(lambda: self.now)
        super().__init__(arm, NAMES, listener, linger=0.01)

    @contextmanager
    def _motion(self) -> Iterator[CommandStream]:
        self.opening.set()
        assert self.may_open.wait(PATIENCE)
        yield self.stream


@pytest.fixture
def results() -> Results:
    return Results()


@pytest.fixture
def streamed(results: Results) -> Iterator[Streamed]:
    arm = SimpleNamespace(state=STATE, robot=robot("iiwa14"))
    made = Streamed(cast(Any, arm), results)
    yield made
    made.may_open.set()
    made.close()


@pytest.mark.parametrize("how", ["cancel", "abort", "drop"])
def test_a_goal_that_ends_before_the_thread_looks_has_a_result(
    streamed: Streamed, results: Results, how: str
) -> None:
    for count in range(1, 6):
        with streamed._changed:  # the thread looks when the goal has ended already
            number = streamed.accept(GOAL)
            getattr(streamed, how)(number if how == "cancel" else "the reason")
        end = results.until(count)
        assert end.number == number
        assert end.outcome is (GoalOutcome.CANCELED if how == "cancel" else GoalOutcome.ABORTED)
    assert not streamed.opening.is_set()


def test_a_goal_that_is_aborted_while_its_motion_opens_does_not_move(
    streamed: Streamed, results: Results
) -> None:
    streamed.accept(GOAL)
    assert streamed.opening.wait(PATIENCE)
    streamed.abort("stopped")
    streamed.may_open.set()
    assert results.until(1).text == "stopped"
    assert streamed.wait_idle(PATIENCE)
    assert all((q == HOME).all() for q in streamed.stream.commands)


class SplineArm:
    """An arm at rest; each motion sent to it is noted, and ends when it is cancelled or a test ends it."""

    def __init__(self) -> None:
        self.state, self.robot = STATE, robot("iiwa14")
        self.motions: list[SplineHandle] = []
        self.on_start: Callable[[], object] = lambda: None
        self.handle: type[SplineHandle] = SplineHandle

    def start(self, motion: object, *, speed: float, when: str) -> SplineHandle:
        self.on_start()
        self.motions.append(self.handle())
        return self.motions[-1]


class SplineHandle:
    """A motion of `SplineArm`."""

    def __init__(self) -> None:
        self.ended, self.cause = threading.Event(), Cause.FINISHED

    @property
    def done(self) -> bool:
        return self.ended.is_set()

    def cancel(self) -> None:
        self.cause = Cause.CANCELLED
        self.ended.set()

    def wait(self, timeout: float) -> Any:
        assert self.ended.wait(timeout)
        return SimpleNamespace(cause=self.cause, text="")


@pytest.fixture
def spline_arm() -> SplineArm:
    return SplineArm()


@pytest.fixture
def spline(spline_arm: SplineArm, results: Results) -> Iterator[SplineExecution]:
    made = SplineExecution(cast(Any, spline_arm), NAMES, results)
    yield made
    made.close()


def test_without_a_goal_there_is_none_to_cancel(spline: SplineExecution, streamed: Streamed) -> None:
    assert not spline.cancel(spline.goal)
    assert not streamed.cancel(streamed.goal)


def test_a_goal_that_waits_for_the_last_one_to_brake_does_not_move_after_an_abort(
    spline: SplineExecution, spline_arm: SplineArm, results: Results
) -> None:
    braking, may_rest = threading.Event(), threading.Event()

    class Slow(SplineHandle):
        def cancel(self) -> None:
            braking.set()

        def wait(self, timeout: float) -> Any:
            assert may_rest.wait(timeout)
            super().cancel()
            return super().wait(timeout)

    started = threading.Event()
    spline_arm.handle, spline_arm.on_start = Slow, started.set
    spline.accept(GOAL)
    assert started.wait(PATIENCE)
    spline.accept(GOAL)
    assert braking.wait(PATIENCE)
    spline.abort("stopped")
    may_rest.set()
    assert spline.wait_idle(PATIENCE)
    assert results.until(2).text == "stopped"
    assert len(spline_arm.motions) == 1


@pytest.mark.parametrize("arrives", [True, False])
def test_a_spline_that_is_slowed_down_is_not_late(
    spline: SplineExecution, spline_arm: SplineArm, results: Results, arrives: bool
) -> None:
    tolerances = replace(spline.settings.tolerances, goal_time=0.2)
    spline.settings = replace(spline.settings, tolerances=tolerances)
    started = threading.Event()
    spline_arm.on_start = started.set
    spline.accept(replace(GOAL, points=(TrajectoryPoint(0.1, GOAL.points[0].q),)))
    assert started.wait(PATIENCE)
    time.sleep(0.6)  # twice as long as the trajectory and goal_time
    assert not results.results
    if arrives:
        there = HOME + 0.1
        spline_arm.state = SimpleNamespace(**{**vars(STATE), "q": there, "q_cmd": there})
    spline_arm.motions[0].ended.set()
    end = results.until(1)
    assert end.outcome is (GoalOutcome.SUCCEEDED if arrives else GoalOutcome.ABORTED)
    assert end.code is (ErrorCode.SUCCESSFUL if arrives else ErrorCode.GOAL_TOLERANCE_VIOLATED)
