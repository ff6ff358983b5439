"""The way `servo` to execute a trajectory: an interpolated stream of targets."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

from heptarm.arm.arm import Arm
from heptarm.arm.servo import JointServo
from heptarm.bridge.execution import Listener
from heptarm.bridge.following import Follower, Following
from heptarm.bridge.runner import Settings, Step
from heptarm.io.clock import Clock
from heptarm.values.arrays import within
from heptarm.values.mode import Mode


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


class ServoExecution(Following):
    """Executes goals as a servo motion of joint positions; `options` say how to stream, else see `Following`."""

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
