"""Ways to execute a trajectory on an arm, in a thread of their own; here `servo`, an interpolated stream of targets."""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Literal, Protocol

from heptarm.arm.arm import Arm
from heptarm.arm.servo import JointServo
from heptarm.bridge.goal import End, Goal, GoalRefused
from heptarm.bridge.runner import Feedback, Measured, Runner, Settings, Step
from heptarm.errors import HeptarmError
from heptarm.io.clock import Clock, RealClock
from heptarm.values.arrays import within
from heptarm.values.mode import Mode
from heptarm.values.state import State

_log = logging.getLogger("heptarm.bridge")

#: How long to wait for the thread at the end [s].
_PATIENCE = 10.0


@dataclass(frozen=True, slots=True)
class ServoOptions:
    """How the way `servo` streams.

    Attributes:
        rate: targets per second [Hz].
        watchdog: within this time after a target the next one has to come, or the arm brakes [s].
        engine: who smooths the targets, see `Arm.servo`: "direct" follows a trajectory closely, for it makes no plans
            of its own; "smart" keeps a limit on the jerk, and lags where the trajectory bends.
        horizon: the cabinet approaches a target within this time, so a target of "direct" lies so far ahead on the
            tangent [s]; less follows no closer, but the arm brakes sooner at fast places.
        speed: ceiling, a fraction of each axis' maximum in (0, 1].
        acceleration: likewise.
        linger: how long the servo motion stays open after a goal [s]; the next goal begins at once in it.
        mode: control mode; None: the arm's.
    """

    rate: float = 100.0
    watchdog: float = 0.2
    engine: Literal["smart", "direct"] = "direct"
    horizon: float = 0.1
    speed: float = 1.0
    acceleration: float = 1.0
    linger: float = 0.5
    mode: Mode | None = None

    def __post_init__(self) -> None:
        within(self.linger, "linger", 0.0, 60.0, unit="s")
        within(self.horizon, "horizon", 0.001, 1.0, unit="s")


class Listener(Protocol):
    """Hears of goals, from the thread of the execution; it must not block."""

    def on_feedback(self, feedback: Feedback) -> None:
        """A goal went on."""
        ...

    def on_end(self, end: End) -> None:
        """A goal ended."""
        ...


def measured(state: State) -> Measured:
    """What a runner wants to know of a state of an arm.

    Raises:
        StaleState: the state has no joints.
    """
    scaling = 1.0 if state.motion is None else state.motion.override
    if state.status is not None and state.status.paused:
        scaling = 0.0
    return Measured(state.sampled * 1e-9, state.q, state.dq, scaling)


class Follower(Protocol):
    """A motion that follows commands, tick by tick."""

    @property
    def why(self) -> str:
        """Why it has ended."""
        ...

    def tick(self) -> float | None:
        """Wait for the next tick; the time for which to command now [s], None: the motion has ended."""
        ...

    def follow(self, step: Step) -> None:
        """Do what the runner wants."""
        ...


class Execution(ABC):
    """Executes goals in a motion that opens with a goal and closes a moment after the last one.

    In between the arm is free for others.

    Args:
        arm: in control.
        names: of its joints, seven.
        listener: hears of goals.
        linger: how long the motion stays open after a goal [s].
        settings: how to run goals.
        clock: the arm's.
    """

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: Listener,
        *,
        linger: float = 0.5,
        settings: Settings | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._arm = arm
        self._listener = listener
        self._linger = linger
        self._runner = Runner(names, arm.robot, settings)
        self._clock = clock or RealClock()
        self._changed = threading.Condition()
        self._closing = False
        self._dropped = False
        self._is_open = False
        self._thread = threading.Thread(target=self._run, name="heptarm-execution")
        self._thread.start()

    @property
    def settings(self) -> Settings:
        """How goals are run; exchange it, and the next goal has it."""
        return self._runner.settings

    @settings.setter
    def settings(self, value: Settings) -> None:
        with self._changed:
            self._runner.settings = value

    @property
    def busy(self) -> bool:
        """Whether a goal is under way or the arm brakes after one."""
        return self._runner.busy

    @property
    def goal(self) -> int:
        """Number of the goal under way; 0: none."""
        return self._runner.goal

    @property
    def now(self) -> float:
        """The time on the clock that goals start by [s]."""
        return self._clock.nanos() * 1e-9

    def accept(self, goal: Goal) -> int:
        """Take a goal; one under way ends as preempted.

        Returns:
            The goal's number.

        Raises:
            GoalRefused: it makes no sense, or the arm cannot follow now.
        """
        try:
            state = measured(self._arm.state)
        except HeptarmError as error:
            raise GoalRefused(f"nothing is known of the arm: {error}") from error
        with self._changed:
            if self._closing:
                raise GoalRefused("the execution is closed")
            number = self._runner.accept(goal, now=self.now, state=state)
            if self._runner.warning:
                _log.warning("goal %d: all default tolerances count: %s", number, self._runner.warning)
            self._changed.notify_all()
            return number

    def cancel(self, number: int) -> bool:
        """End a goal early; the arm brakes. False: it is not under way."""
        with self._changed:
            cancelled = self._runner.cancel(number, self.now)
            self._changed.notify_all()
            return cancelled

    def abort(self, text: str) -> None:
        """End the goal under way, if there is one, because of something outside; the arm brakes."""
        with self._changed:
            self._runner.abort(text, now=self.now)
            self._changed.notify_all()

    def drop(self, text: str) -> None:
        """Likewise, but nothing more is commanded: a stop of the safety controller holds the arm already."""
        with self._changed:
            self._runner.abort(text)
            self._dropped = True
            self._changed.notify_all()

    def wait_idle(self, timeout: float) -> bool:
        """Wait until nothing runs and the servo motion is closed; False: not within `timeout` [s]."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._runner.busy and not self._is_open, timeout)

    def close(self) -> None:
        """End the goal under way and leave the arm at rest."""
        self.abort("the driver closes")
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._thread.join(_PATIENCE)

    # ------------------------------------------------------------------------------------ thread

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closing or self._runner.busy)
                if self._closing and not self._runner.busy:
                    ends = self._runner.ends()
                    break
            try:
                self._stream()
            except HeptarmError as error:
                self._lose(str(error))
            except Exception as error:
                _log.exception("executing a goal")
                self._lose(f"{type(error).__name__}: {error}")
        self._tell(None, ends)

    @abstractmethod
    def _motion(self) -> AbstractContextManager[Follower]:
        """A motion that follows commands."""

    def _stream(self) -> None:
        """One motion: from the first goal to some time after the last one."""
        self._dropped = False
        with self._motion() as follower:
            self._is_open = True
            last = None
            while (now := follower.tick()) is not None:
                state = measured(self._arm.state)
                with self._changed:
                    step = self._runner.advance(now, state)
                    busy = self._runner.busy
                follower.follow(step)
                self._tell(step.feedback, step.ends)
                last = now if busy or last is None else last
                if not busy and (self._closing or self._dropped or now - last >= self._linger):
                    break
        with self._changed:
            if now is None:
                self._runner.abort(f"the motion ended: {follower.why}")
            self._runner.forget()
            self._is_open = False
            ends = self._runner.ends()
            self._changed.notify_all()
        self._tell(None, ends)

    def _lose(self, text: str) -> None:
        """The arm follows no more."""
        with self._changed:
            self._runner.abort(text)
            self._is_open = False
            ends = self._runner.ends()
            self._changed.notify_all()
        self._tell(None, ends)

    def _tell(self, feedback: Feedback | None, ends: Sequence[End]) -> None:
        try:
            if feedback is not None:
                self._listener.on_feedback(feedback)
            for end in ends:
                self._listener.on_end(end)
        except Exception:
            _log.exception("telling of a goal")


class ServoExecution(Execution):
    """Executes goals as a servo motion of joint positions; `options` say how to stream, else see `Execution`."""

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: Listener,
        *,
        options: ServoOptions | None = None,
        settings: Settings | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._options = options or ServoOptions()
        super().__init__(arm, names, listener, linger=self._options.linger, settings=settings, clock=clock)

    @contextmanager
    def _motion(self) -> Iterator[Follower]:
        options = self._options
        with self._arm.servo(
            "joint",
            rate=options.rate,
            watchdog=options.watchdog,
            engine=options.engine,
            speed=options.speed,
            acceleration=options.acceleration,
            mode=options.mode,
            min_trajectory_time=options.horizon if options.engine == "direct" else None,
        ) as servo:
            yield _Servo(servo, options, self._clock)


class _Servo:
    """A servo motion as a follower."""

    def __init__(self, servo: JointServo, options: ServoOptions, clock: Clock) -> None:
        self._servo, self._options, self._clock = servo, options, clock

    @property
    def why(self) -> str:
        result = self._servo.result
        return "" if result is None else f"{result.cause.value} {result.text}"

    def tick(self) -> float | None:
        return None if self._servo.tick() is None else self._clock.nanos() * 1e-9

    def follow(self, step: Step) -> None:
        command = step.command
        if self._options.engine == "direct":
            # it approaches a target as a low-pass filter of this time constant does; its inverse leaves no lag
            self._servo.set(command.q + self._options.horizon * command.dq)
        else:
            self._servo.set(command.q, command.dq)
