"""The preview of a runner predicts its commands, and the process of the FRI loop follows them."""

from __future__ import annotations

import numpy as np
import pytest

from heptarm.fri.loop.user_api import Output, Params
from heptarm.ros.trajectory.fri_execution import _FriStream
from heptarm.ros.trajectory.fri_law import follow
from heptarm.ros.trajectory.goal import TrajectoryGoal, TrajectoryPoint
from heptarm.ros.trajectory.runner import ControlStep, ExecutionSettings, MeasuredJoints, TrajectoryRunner
from heptarm.values.robot import robot

NAMES = tuple(f"A{i}" for i in range(1, 8))
HOME = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
PERIOD = 0.005


def goal(*, start: float | None = None) -> TrajectoryGoal:
    """A curve of one second; every joint moves differently."""
    times = np.linspace(0.0, 1.0, 11)[1:]
    away = np.linspace(0.1, 0.4, 7)
    travel = [HOME + away * (10 * t**3 - 15 * t**4 + 6 * t**5) for t in times]
    speed = [away * 30 * t**2 * (1 - t) ** 2 for t in times]
    points = tuple(
        TrajectoryPoint(float(t), tuple(q), tuple(v)) for t, q, v in zip(times, travel, speed, strict=True)
    )
    return TrajectoryGoal(NAMES, points, start)


class Stage:
    """A runner and an arm that is where it is commanded to be."""

    def __init__(self) -> None:
        self.runner = TrajectoryRunner(NAMES, robot("iiwa14"), ExecutionSettings())
        self.now, self.q, self.scaling = 10.0, HOME, 1.0
        self.numbers: list[int] = []
        self.step()

    def step(self) -> ControlStep:
        """One step; the arm is there at once."""
        self.now += PERIOD
        step = self.runner.advance(self.now, MeasuredJoints(self.now, self.q, np.zeros(7), self.scaling))
        self.q = step.command.q
        return step

    def accept(self, wanted: TrajectoryGoal) -> int:
        number = self.runner.accept(
            wanted, now=self.now, state=MeasuredJoints(self.now, self.q, np.zeros(7), self.scaling)
        )
        self.numbers.append(number)
        return number

    def prediction_error(self, count: int) -> float:
        """Largest difference between the next commands and their preview [rad]."""
        preview = self.step().preview
        times = self.now + PERIOD * np.arange(1.0, count + 1.0)
        predicted = preview.positions(times)
        done = np.array([self.step().command.q for _ in range(count)])
        return float(np.abs(predicted - done).max())


@pytest.fixture
def stage() -> Stage:
    return Stage()


def test_a_preview_predicts_commands(stage: Stage) -> None:
    stage.accept(goal())
    assert stage.prediction_error(100) < 1e-12
    assert stage.prediction_error(150) < 1e-12, "beyond its end, too"


def test_a_preview_has_a_future_start(stage: Stage) -> None:
    stage.accept(goal(start=stage.now + 0.2))
    assert stage.prediction_error(200) < 1e-12


def test_a_preview_has_the_speed_of_the_override(stage: Stage) -> None:
    stage.accept(goal())
    stage.step()
    stage.scaling = 0.3
    assert stage.prediction_error(100) < 1e-12


def test_a_preview_has_the_braking_of_a_cancelled_goal(stage: Stage) -> None:
    number = stage.accept(goal())
    for _ in range(100):
        before = stage.step()
    assert stage.runner.cancel(number, stage.now + 1.0)
    after = stage.step()
    assert after.preview.key != before.preview.key
    assert np.abs(after.command.q - before.command.q - PERIOD * before.command.dq).max() < 1e-4, "no jump"
    assert stage.prediction_error(100) < 1e-12
    assert not stage.runner.busy


@pytest.mark.parametrize("scaling", [1.0, 0.25])
def test_a_cancelled_goal_brakes_from_the_speed_that_it_has(stage: Stage, scaling: float) -> None:
    stage.scaling = scaling
    number = stage.accept(goal())
    for _ in range(round(100 / scaling)):
        stage.step()
    before = [stage.q, stage.step().command.q]
    stage.runner.cancel(number, stage.now)
    speeds = np.diff(np.array([*before, *(stage.step().command.q for _ in range(400))]), axis=0) / PERIOD
    slowing = np.abs(np.diff(speeds, axis=0)) / PERIOD
    assert np.abs(speeds[0]).max() > 0.5 * scaling
    assert slowing.max() < 2.6, "no faster than the parameter reports, but for one step"
    assert (np.abs(speeds[-1]) < 1e-9).all()


def test_a_preempting_goal_continues_without_a_jump(stage: Stage) -> None:
    stage.accept(goal())
    for _ in range(100):
        before = stage.step()
    back = TrajectoryGoal(NAMES, (TrajectoryPoint(1.0, tuple(HOME), (0.0,) * 7),))
    stage.accept(back)
    after = stage.step()
    assert np.abs(after.command.q - before.command.q - PERIOD * before.command.dq).max() < 2e-4
    assert stage.prediction_error(150) < 1e-12


# ------------------------------------------------------------------------------------------ FRI


class Message:
    """A message of the controller at its time."""

    def __init__(self, t: float) -> None:
        self.t, self.period = t, PERIOD
        self.sequence, self.received = round(t / PERIOD), round((100.0 + t) * 1e9)


class Session:
    """An FRI session without a cabinet: messages when they are asked for."""

    def __init__(self, rows: int) -> None:
        values, schema = Params.flat({"begin": -1.0, "q": np.zeros((rows, 7)), "deceleration": 2.0})
        self.params = Params(values, schema, changed=lambda: None)
        self.t = 0.0
        self.start = Message(0.0)

    @property
    def state(self) -> Message:
        return Message(self.t)

    def next(self) -> Message | None:
        return self.state

    def history(self, size: int) -> list[Message]:
        return [Message(self.t)]

    def commanded(self) -> np.ndarray:
        """The current answer of the law."""
        out = Output()
        out.q[:] = HOME
        follow(self.state, out, self.params)  # type: ignore[arg-type]
        return out.q


@pytest.fixture
def session() -> Session:
    return Session(100)


def test_the_law_mirrors_before_there_are_set_points_and_brakes_after_the_last(session: Session) -> None:
    assert (session.commanded() == HOME).all()
    speed = np.linspace(-0.3, 0.4, 7)
    rows = HOME + PERIOD * np.arange(100.0)[:, None] * speed
    session.params.set(begin=0.0, q=rows)
    done = []
    for k in range(200):
        session.t = k * PERIOD
        done.append(session.commanded())
    travel = np.array(done)
    np.testing.assert_allclose(travel[:100], rows)
    braking = np.diff(travel[98:], n=2, axis=0) / PERIOD**2
    assert np.abs(braking).max() < 2.0 + 1e-6
    np.testing.assert_allclose(travel[-1], rows[-1] + speed * 0.4 / 2.0 / 2.0, atol=1e-3)
    assert (travel[-1] == travel[-2]).all(), "at rest"


def test_over_fri_a_goal_is_commanded_at_its_times_however_late_this_process_is(session: Session) -> None:
    """Here it looks every 0.2 s only, and messages are late: the commands are still those of the trajectory."""
    runner = TrajectoryRunner(NAMES, robot("iiwa14"), ExecutionSettings())
    still = MeasuredJoints(100.0, HOME, np.zeros(7))
    start = 100.3
    runner.accept(goal(start=start), now=100.0, state=still)
    overlay = _FriStream(session, PERIOD)  # type: ignore[arg-type]
    reference = Stage()
    reference.accept(goal())
    begin = reference.now
    wanted = reference.step().preview
    done, times = [], []
    for k in range(300):
        session.t = k * PERIOD
        if k % 40 == 0:
            now = overlay.tick()
            assert now is not None and now > 100.0 + session.t
            overlay.command(runner.advance(now, MeasuredJoints(now, HOME, np.zeros(7))))
        done.append(session.commanded())
        times.append(100.0 + session.t + PERIOD - start)  # it is there a period later
    reported = wanted.positions(begin + np.maximum(times, 0.0))
    assert np.abs(np.array(done) - reported).max() < 1e-9


def test_over_fri_a_cancellation_takes_effect_ahead_of_what_is_commanded(session: Session) -> None:
    runner = TrajectoryRunner(NAMES, robot("iiwa14"), ExecutionSettings())
    number = runner.accept(goal(), now=100.0, state=MeasuredJoints(100.0, HOME, np.zeros(7)))
    overlay = _FriStream(session, PERIOD)  # type: ignore[arg-type]
    done = []
    for k in range(250):
        session.t = k * PERIOD
        now = overlay.tick()
        assert now is not None
        if k == 100:
            assert runner.cancel(number, 100.0 + session.t)
        overlay.command(runner.advance(now, MeasuredJoints(now, HOME, np.zeros(7))))
        done.append(session.commanded())
    speeds = np.diff(np.array(done), axis=0) / PERIOD
    slowing = np.diff(speeds[99:], axis=0) / PERIOD
    assert np.abs(speeds[99]).max() > 0.4, "it was under way"
    assert np.abs(slowing).max() < 2.7, "straight from the trajectory into the brake"
    assert np.abs(speeds[-1]).max() < 1e-9


def test_over_fri_a_process_that_was_held_up_compares_the_clocks_by_its_own_message(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        session, "history", lambda size: [Message(session.t + k * PERIOD) for k in range(5, size)]
    )
    overlay = _FriStream(session, PERIOD)  # type: ignore[arg-type]
    assert overlay._between(session.state) == pytest.approx(100.0)  # type: ignore[arg-type]


def test_over_fri_clocks_that_part_before_a_goal_moves_do_not_delay_it(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The controller loses 20 ms while the arm waits for the start: that is corrected at once."""
    runner = TrajectoryRunner(NAMES, robot("iiwa14"), ExecutionSettings())
    start = 101.0
    runner.accept(goal(start=start), now=100.0, state=MeasuredJoints(100.0, HOME, np.zeros(7)))
    overlay = _FriStream(session, PERIOD)  # type: ignore[arg-type]
    reference = Stage()
    reference.accept(goal())
    begin = reference.now
    wanted = reference.step().preview
    lost = 0.02
    monkeypatch.setattr(overlay, "_between", lambda state: 100.0 + (lost if state.t >= 0.1 else 0.0))
    done, times = [], []
    for k in range(300):
        session.t = k * PERIOD
        now = overlay.tick()
        assert now is not None
        overlay.command(runner.advance(now, MeasuredJoints(now, HOME, np.zeros(7))))
        done.append(session.commanded())
        times.append(100.0 + lost + session.t + PERIOD - start)
    reported = wanted.positions(begin + np.maximum(times, 0.0))
    assert np.abs(np.array(done) - reported)[100:].max() < 1e-9


def test_over_fri_clocks_that_part_bend_the_way_of_no_axis(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The controller loses 20 ms at once: the commands catch up gradually, without a step."""
    runner = TrajectoryRunner(NAMES, robot("iiwa14"), ExecutionSettings())
    runner.accept(goal(), now=100.0, state=MeasuredJoints(100.0, HOME, np.zeros(7)))
    overlay = _FriStream(session, PERIOD)  # type: ignore[arg-type]
    lost = 0.0
    monkeypatch.setattr(overlay, "_between", lambda state: 100.0 + lost)
    done = []
    for k in range(200):
        session.t = k * PERIOD
        lost = 0.02 if k >= 60 else 0.0
        now = overlay.tick()
        assert now is not None
        overlay.command(runner.advance(now, MeasuredJoints(now, HOME, np.zeros(7))))
        done.append(session.commanded())
    jerk = np.diff(np.array(done), n=3, axis=0)[40:180] / PERIOD**3
    assert np.abs(jerk).max() < 60.0, "the goal's own, and a little"
    assert overlay._local(session.t) - session.t > 100.0
