"""Leading the arm by hand, recording the way, and doing it again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from heptarm.arm.connection import Connection
from heptarm.arm.feed import States
from heptarm.arm.handle import MotionHandle
from heptarm.arm.servo import JointServo
from heptarm.errors import CommandRejected, LimitError, MotionAborted, ShapeError, StaleState
from heptarm.values.arrays import Array, Value, within
from heptarm.values.condition import Condition
from heptarm.values.mode import Mode
from heptarm.values.motion import TOOL, Motion, hand_guide, hold, ptp
from heptarm.values.result import Cause, Result
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.values.trajectory import Trajectory
from heptarm.values.yielding import yielding

#: How long the arm is taught at most [s], where nothing else is said.
PATIENCE = 300.0
#: How long the arm may take to come to the end of a trajectory after its last target [s].
_SETTLE = 2.0
#: It is there when no joint is farther off than this [rad].
_THERE = 5e-3
#: Places of a trajectory that a spline is compared with.
_DENSE = 2001
#: Within this time the next target has to come, where nothing else is said [s].
_WATCHDOG = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Replay(Value):
    """How a replay went.

    Attributes:
        result: how its motion ended.
        deviation: largest distance of any axis from the way that was taught, whatever the time [rad].
        lag: median time by which the arm was behind [s], of the trajectory's time; NaN: not known, since the cabinet's
            spline has a time of its own.
    """

    result: Result
    deviation: float
    lag: float = float("nan")


class Teaching:
    """The part of an arm that is led by hand, and remembers."""

    _connection: Connection
    move: Callable[..., Result]
    start: Callable[..., MotionHandle]
    servo: Callable[..., JointServo]
    states: Callable[..., States]
    wait_for_rest: Callable[..., State]
    wait_until: Callable[..., State]
    speed: float

    def guide_precisely(
        self,
        free: str,
        *,
        frame: str = TOOL,
        seconds: float = 60.0,
        until: Condition | None = None,
    ) -> Result:
        """Let the arm be led by hand along some directions only, and hold it stiffly in all others.

        It needs no hand guiding device; the arm gives way to any push from the beginning, so somebody should stand
        there. It is a hold under `heptarm.modes.yielding`, which has more to choose.

        Args:
            free: the directions: "z" a line, "xy" a plane, "a" turning about z, "b" about y, "c" about x.
            frame: whose axes: "tool" (the moved frame's own at the start), "base", or a frame's name.
            seconds: how long [s].
            until: condition that ends it earlier, such as `io.user_button`.
        """
        return self.move(hold(seconds), mode=yielding(free, frame=frame), until=until)

    def teach(
        self,
        motion: Motion | None = None,
        *,
        mode: Mode | None = None,
        until: Condition | None = None,
        timeout: float = PATIENCE,
    ) -> Trajectory:
        """Record the way while somebody leads the arm.

        Args:
            motion: what the arm does meanwhile; None: `hand_guide()`, which lasts while the switch of the hand guiding
                device is held. Without such a device: `hold(30.0)` with `mode=yielding("xyzabc")`.
            mode: its control mode.
            until: condition that ends it.
            timeout: it ends after this time at the latest [s], with what was recorded.

        Returns:
            Positions at every state that was pushed, from the start to the end. See `Trajectory.trimmed` and `thinned`.

        Raises:
            CommandRejected: as `start` does; or it ended before two states had come.
            MotionAborted: it was ended by a stop or an error.
        """
        seconds = within(timeout, "timeout", 0.0, 1e6, above=True, unit="s")
        link = self._connection
        if link.options.rate <= 0 or "joints" not in link.options.groups:
            raise StaleState("no joints are pushed", hint='arm.subscribe(rate=100, groups=(..., "joints"))')
        handle = self.start(hand_guide() if motion is None else motion, mode=mode, until=until, when="reject")
        recorded: list[State] = []
        try:
            with link.stopping_on_interrupt():
                for state in self.states(duration=seconds):
                    if handle.done:
                        break
                    recorded.append(state)
        finally:
            handle.cancel()
        handle.wait(timeout=_SETTLE + link.options.timeout)
        return trajectory_of(recorded, self._connection.robot.name)

    def replay(
        self,
        trajectory: Trajectory,
        *,
        by: Literal["servo", "spline"] = "servo",
        pace: float = 1.0,
        approach: float = 0.2,
        rate: float = 100.0,
        watchdog: float = _WATCHDOG,
        mode: Mode | None = None,
        until: Condition | None = None,
        on_progress: Callable[[float], None] | None = None,
    ) -> Replay:
        """Move to the start of a trajectory and do it again.

        Args:
            trajectory: what was taught; best trimmed and thinned.
            by: "servo": in the time in which it was taught, by a stream of targets; "spline": as one smooth motion at
                the cabinet's own pace, which needs no stream and stops on its path.
            pace: by servo: so many times as fast; by spline: fraction of each axis' maximum, (0, 1].
            approach: speed of the motion to its start, a fraction of each axis' maximum in (0, 1].
            rate: targets per second [Hz].
            watchdog: by servo: within this time after a target the next one has to come [s].
            mode: control mode; None: that of `using`, otherwise position.
            until: condition that ends it.
            on_progress: told how much of it is done, [0, 1], again and again once the start is reached.

        Returns:
            How it ended and how near the arm stayed to what was taught.

        Raises:
            CommandRejected: it was taught on another arm; ModeConflict: something runs.
            LimitError: a position beyond the joints' limits, or faster than `arm.speed` allows.
            MotionAborted: ended under way.
        """
        _check(trajectory, self._connection.robot)
        if by not in ("servo", "spline"):
            raise ShapeError(f"by is {by!r}; allowed are 'servo', 'spline'", parameter="by", value=by)
        if by == "spline":
            within(pace, "pace", 0.0, 1.0, above=True)
        elif within(pace, "pace", 0.0, 100.0, above=True):
            self._check_speed(trajectory, pace)
        if float(np.abs(self.wait_for_rest().q - trajectory.q[0]).max()) > 1e-4:
            self.move(ptp(trajectory.q[0]), speed=approach)
        tell = on_progress or _nobody
        if by == "spline":
            return self._by_spline(trajectory, pace, mode, until, tell)
        return self._by_servo(trajectory, pace, rate, watchdog, mode, until, tell)

    def _check_speed(self, trajectory: Trajectory, pace: float) -> None:
        allowed = self._connection.robot.dq_max * self.speed
        share = trajectory.fastest * pace / allowed
        if (share > 1.0).any():
            axis = int(share.argmax())
            most = pace / float(share[axis])
            raise LimitError(
                f"at pace {pace:g} A{axis + 1} would turn at {np.degrees(trajectory.fastest[axis] * pace):.0f} deg/s; "
                f"allowed are {np.degrees(allowed[axis]):.0f}",
                code=2,
                parameter="pace",
                value=pace,
                allowed=f"(0, {most:.3g}]",
                hint=f"replay it at pace {most:.2g}, or by spline",
            )

    def _by_spline(
        self,
        trajectory: Trajectory,
        pace: float,
        mode: Mode | None,
        until: Condition | None,
        tell: Callable[[float], None],
    ) -> Replay:
        handle = self.start(trajectory.spline(), mode=mode, speed=pace, until=until, when="reject")
        seen: list[Array] = []
        try:
            for state in self.states():
                seen.append(state.q)
                tell(handle.progress)
                if handle.done:
                    break
        finally:
            handle.cancel()
        deviation = max((_beside(trajectory, q)[0] for q in seen), default=0.0)
        return Replay(handle.wait(), deviation)

    def _by_servo(
        self,
        trajectory: Trajectory,
        pace: float,
        rate: float,
        watchdog: float,
        mode: Mode | None,
        until: Condition | None,
        tell: Callable[[float], None],
    ) -> Replay:
        per_second = pace * self._connection.pace
        seen: list[tuple[float, Array]] = []
        due = 0
        with self.servo(
            "joint", rate=rate, watchdog=watchdog, speed=1.0, acceleration=1.0, mode=mode, until=until
        ) as sv:
            while sv.tick():
                t = sv.t * per_second
                sv.set(*trajectory.at(t + sv.period * per_second))
                state = self._connection.newest()
                if state is None:
                    continue
                seen.append((t, state.q))
                tell(min(1.0, t / trajectory.duration))
                if t < trajectory.duration:
                    continue
                due = due or state.stamp + round(_SETTLE * 1e9)  # by the cabinet's clock, which the arm follows
                if float(np.abs(state.q - trajectory.q[-1]).max()) < _THERE or state.stamp > due:
                    break
        result = sv.result
        if result is None:
            raise MotionAborted("the servo motion has not ended")
        ended = replace(result, cause=Cause.FINISHED) if result.cause is Cause.CANCELLED else result
        beside = [(t, *_beside(trajectory, q)) for t, q in seen]
        lags = [t - there for t, _, there in beside if t < trajectory.duration]
        deviation = max((off for _, off, _ in beside), default=0.0)
        return Replay(ended, deviation, float(np.median(lags)) if lags else float("nan"))


def _nobody(progress: float) -> None:
    """Nobody asks how much is done."""


def _beside(trajectory: Trajectory, q: Array) -> tuple[float, float]:
    """How far a position is off the way that was taught [rad], and the time of the nearest place on it [s]."""
    times = np.linspace(0.0, trajectory.duration, _DENSE)
    off = np.abs(trajectory.positions(times) - q).max(axis=1)
    nearest = int(off.argmin())
    return float(off[nearest]), float(times[nearest])


def _check(trajectory: Trajectory, robot: RobotModel) -> None:
    if not isinstance(trajectory, Trajectory):
        raise ShapeError(
            f"{trajectory!r} is no trajectory",
            parameter="trajectory",
            hint="Trajectory.load(...), or arm.teach()",
        )
    if trajectory.robot and trajectory.robot != robot.name:
        raise CommandRejected(
            f"it was taught on an {trajectory.robot}, this is an {robot.name}",
            parameter="trajectory",
            value=trajectory.robot,
            allowed=robot.name,
            hint="teach it on this arm, or give it no robot: Trajectory.of(times, q)",
        )
    for index, extreme in enumerate((trajectory.q.min(axis=0), trajectory.q.max(axis=0))):
        robot.check(extreme, f"trajectory, {('lowest', 'highest')[index]} q")


def trajectory_of(recorded: Sequence[State], name: str) -> Trajectory:
    """Positions of the states that carry new ones.

    Args:
        recorded: states in the order of their coming.
        name: model of the robot.

    Raises:
        CommandRejected: fewer than two of them do.
    """
    rows: dict[int, Array] = {}
    for state in recorded:
        if state.joints is not None:
            rows.setdefault(state.joints.stamp, state.joints.q)
    if len(rows) < 2:
        raise CommandRejected(
            f"only {len(rows)} positions were recorded",
            parameter="motion",
            hint="the motion ended at once; look why",
        )
    stamps = sorted(rows)
    times = np.array([(stamp - stamps[0]) * 1e-9 for stamp in stamps])
    return Trajectory.of(times, [rows[stamp] for stamp in stamps], robot=name)
