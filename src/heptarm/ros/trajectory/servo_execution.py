"""Execution `servo`: streams interpolated targets of a trajectory to a servo motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

from heptarm.arm.arm import Arm
from heptarm.arm.motion.servo import JointServo
from heptarm.arm.watchdog import TARGETS
from heptarm.io.clock import Clock
from heptarm.ros.trajectory.execution import GoalListener
from heptarm.ros.trajectory.runner import ControlStep, ExecutionSettings
from heptarm.ros.trajectory.streamed_execution import CommandStream, StreamedExecution
from heptarm.values.checks import within
from heptarm.values.mode.mode import Mode


@dataclass(frozen=True, slots=True)
class ServoOptions:
    """Options of the execution `servo`.

    Attributes:
        rate: targets per second [Hz].
        watchdog: the cabinet brakes the arm if no target arrives for this time [s].
        engine: servo engine of the cabinet, see `Arm.servo`: "direct" follows a trajectory closely, because it plans
            nothing itself; "smart" limits the jerk, and lags where the trajectory bends.
        horizon: time constant of the engine "direct" [s], which compensates for it by targets this far ahead on the
            tangent; a shorter one follows no closer, but the arm brakes sooner where it is fast.
        speed: speed limit, a fraction of each axis' maximum in (0, 1].
        acceleration: likewise.
        linger: how long the servo motion stays open after a goal [s]; the next goal starts in it without delay.
        mode: control mode; None: the arm's.
    """

    rate: float = 100.0
    watchdog: float = TARGETS.time(period=1.0 / rate)
    engine: Literal["smart", "direct"] = "direct"
    horizon: float = 0.1
    speed: float = 1.0
    acceleration: float = 1.0
    linger: float = 0.5
    mode: Mode | None = None

    def __post_init__(self) -> None:
        within(self.linger, "linger", 0.0, 60.0, unit="s")
        within(self.horizon, "horizon", 0.001, 1.0, unit="s")


class ServoExecution(StreamedExecution):
    """Executes goals as a servo motion of joint positions; for the other arguments see `StreamedExecution`."""

    def __init__(
        self,
        arm: Arm,
        names: Sequence[str],
        listener: GoalListener,
        *,
        options: ServoOptions | None = None,
        settings: ExecutionSettings | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._options = options or ServoOptions()
        super().__init__(arm, names, listener, linger=self._options.linger, settings=settings, clock=clock)

    @contextmanager
    def _motion(self) -> Iterator[CommandStream]:
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
            yield _ServoStream(servo, options, self._clock)


class _ServoStream:
    """A servo motion as a command stream."""

    def __init__(self, servo: JointServo, options: ServoOptions, clock: Clock) -> None:
        self._servo, self._options, self._clock = servo, options, clock

    @property
    def end_reason(self) -> str:
        result = self._servo.result
        return "" if result is None else f"{result.cause.value} {result.text}"

    def tick(self) -> float | None:
        return None if self._servo.tick() is None else self._clock.nanos() * 1e-9

    def command(self, step: ControlStep) -> None:
        target = step.command
        if self._options.engine == "direct":
            # the engine is a low-pass filter with this time constant; its inverse removes the lag
            self._servo.set(target.q + self._options.horizon * target.dq)
        else:
            self._servo.set(target.q, target.dq)
