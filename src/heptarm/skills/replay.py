"""Replaying a taught trajectory, as a stream of targets or as one spline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isnan
from typing import Literal

import numpy as np

from heptarm.arm.verbs import ArmVerbs
from heptarm.arm.watchdog import REPLAY
from heptarm.errors import CommandRejected, LimitError, MotionAborted, ShapeError, StaleState
from heptarm.skills.taught_path import TaughtPath
from heptarm.values.checks import Array, Value, callback, instance, within, word
from heptarm.values.condition.condition import Condition
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.ptp import ptp
from heptarm.values.motion.spline import JointSpline
from heptarm.values.motion.trajectory import Trajectory
from heptarm.values.result import Cause, Result
from heptarm.values.robot import RobotModel, known_robot
from heptarm.values.text import degrees, fixed, lines

#: Longest time that the arm may need to settle at the end of a trajectory after its last target [s].
_SETTLE = 2.0
#: The arm has settled when no joint deviates more than this [rad] or moves faster than this [rad/s].
_SETTLED, _STILL = 5e-3, 0.02
#: The arm is at the start of the trajectory when no joint deviates more than this [rad].
_AT_START = 1e-4
#: A target of a stream is reached so long after the next one comes, so that the arm does not brake for a late one [s].
_OVERLAP = 0.005
#: Longest trajectory to a target [s]; see `min_trajectory_time` of `Arm.servo`.
_LONGEST = 1.0
#: Of a spline: the relative difference in duration that is none, and how many plans may be made for it.
_SAME_TIME, _PLANS = 0.005, 10


@dataclass(frozen=True, slots=True, eq=False)
class Replay(Value):
    """Result of a replay.

    Attributes:
        result: how its motion ended.
        deviation: largest distance of any axis from the taught path, whatever the time [rad].
        lag: median delay of the arm [s], in the time of the trajectory, up to 2 s; NaN for a spline, which has its own
            timing, and where nothing moves.
    """

    result: Result
    deviation: float
    lag: float = float("nan")

    def __str__(self) -> str:
        """A few lines: how it ended, and how near it came."""
        rows = {
            "cause": self.result.cause.value,
            "duration": f"{self.result.duration:.2f} s",
            "deviation": f"{degrees(self.deviation)} at most from the taught path",
            "lag": "" if isnan(self.lag) else f"{fixed(self.lag * 1e3, 0)} ms, median",
        }
        return lines("Replay", rows)


def replay(
    arm: ArmVerbs,
    trajectory: Trajectory,
    *,
    by: Literal["servo", "spline"] = "servo",
    speed_scaling: float = 1.0,
    approach: float = 0.2,
    rate: float = 100.0,
    watchdog: float | None = None,
    mode: Mode | None = None,
    until: Condition | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> Replay:
    """Move to the start of a trajectory and follow it.

    Args:
        arm: in control.
        trajectory: the taught trajectory; best trimmed and thinned.
        by: "servo": with the taught timing, as a stream of targets; "spline": as one smooth motion of the taught
            duration with the cabinet's timing between its ends, which needs no stream and stops on its path.
        speed_scaling: factor on the taught speed: 0.5 takes twice the taught time. By spline a shorter time than the
            limits of the joints and `arm.speed` allow becomes the shortest one that they allow.
        approach: speed of the motion to its start, a fraction of each axis' maximum in (0, 1].
        rate: targets per second [Hz].
        watchdog: by servo: longest gap between two targets; a longer one stops the arm [s]; None: five periods, at
            least 0.3 s.
        mode: control mode; None: that of `using`, otherwise position.
        until: break condition that ends it.
        on_progress: called with the completed fraction, [0, 1], repeatedly once the start is reached.

    Returns:
        How it ended, and how closely the arm followed the taught path.

    Raises:
        CommandRejected: it was taught on another model; ModeConflict: a motion runs.
        LimitError: a position beyond the joints' limits, or a speed above `arm.speed`.
        MotionAborted: ended early.
    """
    instance(trajectory, Trajectory, "trajectory")
    _check(trajectory, arm.robot)
    word(by, "by", ("servo", "spline"))
    within(approach, "approach", 0.0, 1.0, above=True)
    if on_progress is not None:
        callback(on_progress, "on_progress")
    arm.servo(rate=rate, watchdog=watchdog, mode=mode, until=until)  # raises before anything moves
    within(speed_scaling, "speed_scaling", 0.0, 100.0, above=True)
    if by == "servo":
        _check_speed(trajectory, speed_scaling, arm.robot.dq_max * arm.speed)
        period = 1.0 / within(rate, "rate", 0.0, 1000.0, above=True, unit="Hz")
        watchdog = REPLAY.time(watchdog, period=period)
    if float(np.abs(arm.wait_for_rest().q - trajectory.q[0]).max()) > _AT_START:
        arm.move(ptp(trajectory.q[0]), speed=approach)
    run = _Run(arm, trajectory, speed_scaling, mode, until, on_progress)
    return run.by_spline() if by == "spline" else run.by_servo(rate, watchdog)


@dataclass(frozen=True, slots=True)
class _Run:
    """A replay that starts at the first position of its trajectory; see `replay` for the attributes."""

    arm: ArmVerbs
    trajectory: Trajectory
    speed_scaling: float
    mode: Mode | None
    until: Condition | None
    on_progress: Callable[[float], None] | None

    def by_spline(self) -> Replay:
        """Follow it as one spline."""
        spline = self.trajectory.spline()
        handle = self.arm.start(
            spline,
            mode=self.mode,
            speed=self._speed_of(spline),
            until=self.until,
            when="reject",
        )
        seen: list[Array] = []
        try:
            for state in handle.states():
                seen.append(state.q)
                self._report(handle.progress)
        finally:
            handle.cancel()
        result = handle.wait()
        self._report(handle.progress)  # the states may have ended before it was known how the motion did
        return Replay(result, TaughtPath(self.trajectory).deviation(seen))

    def _speed_of(self, spline: JointSpline) -> float:
        """The speed, a fraction of each axis' maximum, at which a spline takes the wanted time; 1: it takes longer."""
        wanted, speed = self.trajectory.duration / self.speed_scaling, 1.0
        for _ in range(_PLANS):
            duration = self.arm.plan(spline, speed=speed).duration
            if abs(duration / wanted - 1.0) < _SAME_TIME or (speed == 1.0 and duration > wanted):
                break
            speed = min(1.0, speed * duration / wanted)  # but for its ramps the duration goes with 1 / speed
        return speed

    def by_servo(self, rate: float, watchdog: float | None) -> Replay:
        """Follow it by a stream of targets."""
        trajectory, per_second = self.trajectory, self.speed_scaling * self.arm.real_time_factor
        ahead = min(1.0 / rate + _OVERLAP, _LONGEST)
        seen: list[tuple[float, Array]] = []
        due = 0
        with self.arm.servo(
            "joint",
            rate=rate,
            watchdog=watchdog,
            speed=1.0,
            acceleration=1.0,
            mode=self.mode,
            until=self.until,
            min_trajectory_time=ahead,
        ) as servo:
            while servo.tick():
                t = servo.t * per_second
                q, dq = trajectory.at(t + ahead * per_second)  # where it will be when the arm gets there
                servo.set(q, self.speed_scaling * dq)
                try:
                    state = self.arm.state
                except StaleState:
                    continue  # the stream goes on without feedback
                seen.append((t - state.age * per_second, state.q))
                self._report(min(1.0, t / trajectory.duration))
                if t < trajectory.duration:
                    continue
                # by the cabinet's clock, which the arm follows
                due = due or state.stamp + round(_SETTLE * 1e9)
                distance = float(np.abs(state.q - trajectory.q[-1]).max())
                if (distance < _SETTLED and float(np.abs(state.dq).max()) < _STILL) or state.stamp > due:
                    break
        result = servo.result
        if result is None:
            raise MotionAborted("the servo motion has not ended")
        ended = replace(result, cause=Cause.FINISHED) if result.cause is Cause.CANCELLED else result
        path = TaughtPath(trajectory)
        moving = [(t, q) for t, q in seen if t < trajectory.duration]
        lag = path.lag([t for t, _ in moving], [q for _, q in moving])
        return Replay(ended, path.deviation([q for _, q in seen]), lag)

    def _report(self, progress: float) -> None:
        if self.on_progress is not None:
            self.on_progress(progress)


def _check_speed(trajectory: Trajectory, speed_scaling: float, allowed: Array) -> None:
    """Refuse a speed scaling at which an axis exceeds the allowed speeds, shape (7,) [rad/s]."""
    fraction = trajectory.fastest * speed_scaling / allowed
    if (fraction > 1.0).any():
        axis = int(fraction.argmax())
        most = speed_scaling / float(fraction[axis])
        raise LimitError(
            f"speed_scaling must be in (0, {most:.3g}], got {speed_scaling:g}: A{axis + 1} would turn at "
            f"{np.degrees(trajectory.fastest[axis] * speed_scaling):.0f} deg/s, allowed are "
            f"{np.degrees(allowed[axis]):.0f} deg/s",
            code=2,
            parameter="speed_scaling",
            value=speed_scaling,
            allowed=f"(0, {most:.3g}]",
            hint=f"give speed_scaling={most:.2g}, or replay it by spline",
        )


def _check(trajectory: Trajectory, robot: RobotModel) -> None:
    if not isinstance(trajectory, Trajectory):
        raise ShapeError(
            f"trajectory must be a Trajectory, got {trajectory!r}",
            parameter="trajectory",
            hint="Trajectory.load(...), or arm.teach()",
        )
    taught_on = known_robot(trajectory.robot)  # joint positions are the same whatever the flange
    if trajectory.robot and (taught_on is None or taught_on.base_name != robot.base_name):
        raise CommandRejected(
            f"trajectory must be taught on an {robot.name}, got one of an {trajectory.robot}",
            parameter="trajectory",
            value=trajectory.robot,
            allowed=robot.name,
            hint="teach it on this arm, or remove the robot: Trajectory.of(times, q)",
        )
    for index, extreme in enumerate((trajectory.q.min(axis=0), trajectory.q.max(axis=0))):
        robot.check(extreme, f"trajectory, {('lowest', 'highest')[index]} q")
