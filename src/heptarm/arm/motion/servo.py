"""Servo motions: the settings with which one is opened, and the stream of targets that the arm follows."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import partial
from math import nan
from operator import le
from typing import Any, Final, Literal, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.chunks import (
    MOST_ACTIONS,
    ActionPath,
    ActionStream,
    TakenChunk,
    action_times,
    actions,
)
from heptarm.arm.motion.clear import ClearTargets
from heptarm.arm.motion.handle import Block, BreakRule, MotionHandle
from heptarm.arm.translate.modes import mode_message
from heptarm.arm.watchdog import FIRST_TARGET, TARGETS
from heptarm.errors import (
    CollisionForeseen,
    CommandRejected,
    LocalProtocolError,
    ShapeError,
    Timeout,
    Unreachable,
    inside,
)
from heptarm.model.boundary import TOLERANCE, Boundary
from heptarm.model.inverse_kinematics import solve
from heptarm.model.kinematics import forward
from heptarm.model.velocity import (
    ELBOWS,
    FREE,
    Elbow,
    ElbowTask,
    Slowdown,
    blockage,
    resolved_pose,
)
from heptarm.record.journal import CORRECTION
from heptarm.values.checks import Array, array, instance, shown, within, word
from heptarm.values.clearance import ClearanceModel
from heptarm.values.condition.condition import Condition, check_condition
from heptarm.values.frames import TOOL, check_name
from heptarm.values.mode.mode import MODES, Mode
from heptarm.values.notebook import as_html
from heptarm.values.pose import Pose, check_pose
from heptarm.values.result import Cause, Result
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.values.text import fixed, lines
from heptarm.wire import messages as wire

_log = logging.getLogger("heptarm.arm")

_Method = TypeVar("_Method", bound=Callable[..., Any])

#: Kinds of servo motions: of targets, and of velocities.
KINDS = ("joint", "pose", "lin", "velocity", "twist")
VELOCITIES = ("velocity", "twist")
REDUNDANT = ("twist", "pose")
ENGINES = {"smart": wire.ServoEngine.SMART, "direct": wire.ServoEngine.DIRECT}
#: The protocol's defaults and ranges; `schema/protocol.toml` is their one place.
_DEFAULT, _RANGES = wire.ServoOpen(), wire.ServoTiming.RANGES
#: Added to the period for the default of min_trajectory_time, so that the next target comes before its end [s].
_OVERLAP = 0.005
#: Default of the silence after which a stream of velocities comes to rest [s].
_SILENCE = 0.2
#: Of a stream of velocities: the cabinet's own limit of the acceleration, relative to that of the stream, so that the
#: arm follows the ramps of the stream; and how many periods the arm keeps a velocity after its target.
_CABINET_ACCELERATION, _KEPT_PERIODS = 2.0, 3.0
#: Limits along and about each axis of the base for straight lines, of the whole velocity for twists: default, largest
#: value, unit.
_LINE_LIMITS = {
    "speed_mps": (0.25, 10.0, "m/s"),
    "acceleration_mps2": (1.0, 100.0, "m/s²"),
    "speed_radps": (0.5, 20.0, "rad/s"),
    "acceleration_radps2": (2.0, 200.0, "rad/s²"),
}


class ServoKeywords(TypedDict, total=False):
    """Keywords of `Arm.servo`, for type checkers; see `ServoRequest`."""

    rate: float
    watchdog: float | None
    engine: Literal["smart", "direct"]
    mode: Mode | None
    speed: float | None
    acceleration: float | None
    speed_mps: float | None
    acceleration_mps2: float | None
    speed_radps: float | None
    acceleration_radps2: float | None
    min_trajectory_time: float | None
    goal_timeout: float
    speed_timeout: float | None
    moving: str
    frame: str | Pose | None
    timeout: float | None
    elbow: Elbow | None
    posture: npt.ArrayLike | None
    keep_clear_of: ClearanceModel | None
    until: Condition | None


@dataclass(frozen=True, slots=True)
class ServoRequest:
    """A checked request for a servo motion: its keywords, as `documented` lists them in `Arm.servo`.

    Attributes:
        kind: what the targets are: "joint", "pose" or "lin"; or velocities: "velocity" or "twist".
        rate: ticks of the loop per second [Hz]; 100. A stream of velocities sends so many targets itself.
        watchdog: longest gap between two targets; a longer one stops the arm [s], 0.005 to 2; None: five
            periods, at least 0.2 s.
        engine: of joints and poses: "smart" plans a limited trajectory to each target; "direct" moves straight
            to it, for targets that are close and smooth.
        mode: control mode; None: that of `using`, otherwise position. Its parameters can change while the arm
            follows.
        speed: of joints, poses and velocities: ceiling, a fraction of each axis' maximum in (0, 1]; None: 0.2.
            The lower one of this and `arm.speed` applies.
        acceleration: likewise, of the acceleration and the jerk.
        speed_mps: of "lin": largest speed along each axis of the base [m/s], up to 10; None: 0.25. `arm.speed`
            scales it, since the joints' own limits are not checked. Of "twist": largest speed, not scaled.
        acceleration_mps2: likewise [m/s²], up to 100; None: 1. Not scaled.
        speed_radps: largest angular velocity about each axis of the base, of "twist" about any axis [rad/s], up to
            20; None: 0.5. Scaled for "lin".
        acceleration_radps2: likewise [rad/s²], up to 200; None: 2. Not scaled.
        min_trajectory_time: shortest trajectory to a target [s]; None: a period and 5 ms.
        goal_timeout: time at its target without another one after which the cabinet's servo motion ends [s];
            300. The next target begins a new one.
        speed_timeout: of joints with the engine "smart": how long the arm keeps the velocity of a target after
            passing it, before it brakes [s], 0.001 to 10; None: 0.1.
        moving: motion frame: "tool" (of the attached tool, or the flange), "flange" or the name of a frame. A twist
            is the velocity of its origin.
        frame: of "twist": its axes: "tool", "flange", "base", a name, or a pose in the base; None: "tool".
        timeout: of velocities: silence after which the velocity becomes zero [s], 0.01 to 10; None: 0.2.
        elbow: of "twist" and "pose": what the redundant joint does: "keep": the arm angle stays that of the start, the
            default; "center": the joints stay away from their limits. Where a limit or a singularity would slow the
            arm down, the elbow moves first.
        posture: instead of `elbow`: the joints stay as near as they can to these positions, shape (7,) [rad].
        keep_clear_of: model of bodies to keep clear of, such as a `heptarm.CollisionModel`, which has the shapes of the
            attached tool and workpiece as well: velocities brake before them, targets that are nearer than its margin
            are refused; None: none. It is no safety function: it knows only its own model of the scene.
        until: break condition; the cabinet's application checks it up to 250 times a second, as fast as its
            robot answers. See `move`.

    Raises:
        ShapeError: no such kind or engine.
        LimitError: a value outside its range.
        CommandRejected: a limit that this kind of servo motion does not obey.
    """

    kind: str
    _: KW_ONLY
    rate: float = 100.0
    watchdog: float | None = None
    engine: str = "smart"
    mode: Mode | None = None
    speed: float | None = None
    acceleration: float | None = None
    speed_mps: float | None = None
    acceleration_mps2: float | None = None
    speed_radps: float | None = None
    acceleration_radps2: float | None = None
    min_trajectory_time: float | None = None
    goal_timeout: float = _DEFAULT.timing.goal_timeout
    speed_timeout: float | None = None
    moving: str = TOOL
    frame: str | Pose | None = None
    timeout: float | None = None
    elbow: Elbow | None = None
    posture: npt.ArrayLike | None = None
    keep_clear_of: ClearanceModel | None = None
    until: Condition | None = None

    def __post_init__(self) -> None:
        word(self.engine, "engine", ENGINES)
        check_name(self.moving, "moving")
        word(self.kind, "kind", KINDS)
        if self.frame is not None and not isinstance(self.frame, Pose):
            check_name(self.frame, "frame")
        if self.timeout is not None:
            within(self.timeout, "timeout", 0.01, 10.0, unit="s")
        if self.keep_clear_of is not None and not callable(getattr(self.keep_clear_of, "clearances", None)):
            raise ShapeError(
                f"keep_clear_of must have a method clearances, got {shown(self.keep_clear_of)}",
                parameter="keep_clear_of",
                value=self.keep_clear_of,
                hint='for example heptarm.CollisionModel("iiwa14", scene="table")',
            )
        if self.until is not None:
            check_condition(self.until)
        if self.elbow is not None:
            word(self.elbow, "elbow", ELBOWS)
        self._refuse_foreign_limits()
        within(self.rate, "rate", 0.0, 1000.0, above=True, unit="Hz")
        TARGETS.time(self.watchdog, period=self.period)

    @property
    def period(self) -> float:
        """Time between two ticks [s]."""
        return 1.0 / self.rate

    @property
    def watchdog_time(self) -> float:
        """Longest gap between two targets [s]."""
        return TARGETS.time(self.watchdog, period=self.period)

    def message(self, ceiling: float) -> wire.ServoOpen:
        """The message that opens the servo motion, without its break condition.

        Args:
            ceiling: of the speed, a fraction in (0, 1].

        Raises:
            LimitError: a value outside its range.
        """
        shortest = self.min_trajectory_time
        if shortest is None:
            shortest = float(np.clip(self.period + _OVERLAP, *_RANGES["min_trajectory_time"]))
        given = {
            "min_trajectory_time": shortest,
            "goal_timeout": self.goal_timeout,
            "speed_timeout": self._kept if self.speed_timeout is None else self.speed_timeout,
        }
        message = wire.ServoOpen(
            frame="" if self.moving == TOOL else self.moving,
            mode=mode_message(self.mode),
            timing=wire.ServoTiming(
                **{name: within(value, name, *_RANGES[name], unit="s") for name, value in given.items()}
            ),
            watchdog=FIRST_TARGET.default,
        )
        if self.kind == "lin":
            return replace(
                message,
                engine=wire.ServoEngine.LIN,
                velocity=1.0,
                acceleration=1.0,
                linear=self._line_limits(ceiling),
            )
        velocity, acceleration = self.joint_fractions(ceiling)
        if self.kind in VELOCITIES:
            acceleration = min(1.0, _CABINET_ACCELERATION * acceleration)
        return replace(message, engine=ENGINES[self.engine], velocity=velocity, acceleration=acceleration)

    def joint_fractions(self, ceiling: float) -> tuple[float, float]:
        """Largest speed and acceleration, fractions of each axis' maximum; arguments and errors as `message`."""
        velocity = _DEFAULT.velocity if self.speed is None else self.speed
        acceleration = _DEFAULT.acceleration if self.acceleration is None else self.acceleration
        return (
            min(ceiling, within(velocity, "speed", 0.0, 1.0, above=True)),
            within(acceleration, "acceleration", 0.0, 1.0, above=True),
        )

    @property
    def silence(self) -> float:
        """Silence after which a stream of velocities comes to rest [s]."""
        return _SILENCE if self.timeout is None else self.timeout

    def elbow_task(self, robot: RobotModel) -> Callable[[Array], ElbowTask]:
        """What the elbow does, for the joint positions at the start of the stream.

        Raises:
            ShapeError: the posture has not seven numbers.
            LimitError: one of them is outside the limits of its joint.
        """
        posture = None
        if self.posture is not None:
            posture = array(self.posture, 7, "posture")
            robot.check(posture, "posture")
        return partial(ElbowTask, robot, elbow=self.elbow or "keep", posture=posture)

    @property
    def _kept(self) -> float:
        """How long the arm keeps the velocity of a target after passing it [s]."""
        default = _DEFAULT.timing.speed_timeout
        return max(default, _KEPT_PERIODS * self.period) if self.kind in VELOCITIES else default

    def line_limits(self) -> tuple[float, float, float, float]:
        """Largest speed, acceleration, angular velocity and acceleration [m/s, m/s², rad/s, rad/s²].

        Raises:
            LimitError: one is outside its range.
        """
        speed, acceleration, turn, spin = (
            within(
                default if getattr(self, name) is None else getattr(self, name),
                name,
                0.0,
                most,
                above=True,
                unit=unit,
            )
            for name, (default, most, unit) in _LINE_LIMITS.items()
        )
        return speed, acceleration, turn, spin

    def _line_limits(self, ceiling: float) -> wire.CartesianDynamics:
        chosen = self.line_limits()
        return wire.CartesianDynamics(
            velocity=ceiling * chosen[0],
            acceleration=chosen[1],
            orientation_velocity=ceiling * chosen[2],
            orientation_acceleration=chosen[3],
        )

    def _refuse_foreign_limits(self) -> None:
        """Refuse settings that this kind of servo motion does not obey."""
        hint = f'the limits of arm.servo("lin") are {", ".join(_LINE_LIMITS)}'
        if self.kind == "lin":
            for name in ("speed", "acceleration"):
                if getattr(self, name) is not None:
                    raise CommandRejected(
                        f"{name} is a fraction of the axes' maxima, which a straight servo motion does not obey",
                        parameter=name,
                        hint=hint,
                    )
            if self.engine != "smart":
                raise CommandRejected(
                    f'engine applies to arm.servo("joint") and arm.servo("pose") only, got {self.engine!r}',
                    parameter="engine",
                    hint=hint,
                )
        elif self.kind != "twist":
            for name in _LINE_LIMITS:
                if getattr(self, name) is not None:
                    raise CommandRejected(
                        f'{name} applies to arm.servo("lin") and arm.servo("twist") only; '
                        f"a {self.kind} servo has speed and acceleration",
                        parameter=name,
                        hint=hint,
                    )
        if self.kind in VELOCITIES and self.engine != "smart":
            raise CommandRejected(
                f'engine applies to arm.servo("joint") and arm.servo("pose") only, got {self.engine!r}',
                parameter="engine",
                hint="leave it out",
            )
        if self.kind not in VELOCITIES and self.timeout is not None:
            raise CommandRejected(
                'timeout applies to arm.servo("velocity") and arm.servo("twist") only',
                parameter="timeout",
                hint="leave it out",
            )
        if self.frame is not None and self.kind != "twist":
            raise CommandRejected(
                'frame applies to arm.servo("twist") only', parameter="frame", hint="leave it out"
            )
        for name in ("elbow", "posture"):
            if getattr(self, name) is not None and self.kind not in REDUNDANT:
                raise CommandRejected(
                    f'{name} applies to arm.servo("twist") and arm.servo("pose") only',
                    parameter=name,
                    hint="leave it out",
                )
        if self.elbow is not None and self.posture is not None:
            raise CommandRejected(
                f"posture takes the place of elbow, got both: elbow={self.elbow!r}",
                parameter="posture",
                hint="leave one of them out",
            )
        if self.speed_timeout is not None and (self.kind, self.engine) != ("joint", "smart"):
            raise CommandRejected(
                'speed_timeout applies only to arm.servo("joint") with the engine "smart", '
                "whose targets have a velocity",
                parameter="speed_timeout",
                hint="leave it out",
            )


def documented(method: _Method) -> _Method:
    """Decorator: list the keywords of a servo motion in the docstring of a method after "as follows."."""
    listed = (ServoRequest.__doc__ or "").partition("        rate:")[1:]
    lines = "".join(listed).partition("\n\n")[0].splitlines()
    text = "\n".join(f"    {line}" for line in lines)
    method.__doc__ = (method.__doc__ or "").replace("as follows.", f"as follows.\n{text}", 1)
    return method


#: Longest wait for the start, and for rest at the end [s].
_PATIENCE = 5.0
#: Calls of `set` whose cost is kept for the statistics.
_COSTS = 4096
_DOUBLES = np.dtype(np.float64)
#: Of a target to rest at.
_STILL = (0.0,) * 7
#: Of a straight servo motion: time between two looks for what slows it down, the time that one takes at most [ns], and
#: that in which it would be at its target, where nothing slows it down any more [s].
_LOOK, _LOOK_TIME, _ARRIVED = 50_000_000, 3_000_000, 0.01
#: A point that is moved by less is not moved [m].
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class ServoStats:
    """Statistics of a stream of targets.

    Attributes:
        sent: targets sent.
        rate: targets per second since the first one [Hz].
        late_ticks: ticks more than half a period late.
        set_median: median duration of a call of `set` [s].
        set_p99: its 99th percentile [s].
        received: targets that the cabinet received, by its last report, as are all that follow.
        applied: how many of them the arm followed; newer ones overtook the others.
        refused: how many the cabinet refused.
        late: gaps longer than the watchdog.
        age_median: median age of the targets when they were applied [s]; NaN: not reported yet.
        age_p99: its 99th percentile [s].
        text: why the last refused target was refused.
        slowdown: of a stream of velocities: why it is slower than commanded now, and by which factor. Of targets: why
            the newest one was held, by the factor 0.
        slowdowns: for each reason so far, the smallest factor.
        held: targets that were not sent because bodies of `keep_clear_of` are near them; the last good one was.
        clamped: targets that were sent changed: clipped to the limits of the joints, or moved into `arm.workspace`.
    """

    sent: int
    rate: float
    late_ticks: int
    set_median: float
    set_p99: float
    received: int = 0
    applied: int = 0
    refused: int = 0
    late: int = 0
    age_median: float = nan
    age_p99: float = nan
    text: str = ""
    slowdown: Slowdown = FREE
    slowdowns: tuple[Slowdown, ...] = ()
    held: int = 0
    clamped: int = 0

    def __str__(self) -> str:
        """A few aligned lines with units."""
        rows = {
            "sent": f"{self.sent} targets at {self.rate:.1f} Hz, {self.late_ticks} ticks late",
            "set": f"{fixed(self.set_median * 1e6, 0)} us median, {fixed(self.set_p99 * 1e6, 0)} us p99",
            "cabinet": f"{self.received} received, {self.applied} applied, {self.refused} refused, {self.late} gaps",
            "age": f"{fixed(self.age_median * 1e3, 2)} ms median, {fixed(self.age_p99 * 1e3, 2)} ms p99 when applied",
            "refused": self.text,
            "held": f"{self.held} targets at the last good one" if self.held else "",
            "clamped": f"{self.clamped} targets, to the limits of the joints or the workspace"
            if self.clamped
            else "",
            "slowed": "; ".join(map(str, self.slowdowns)),
        }
        return lines("Servo", rows)

    def _repr_html_(self) -> str:
        """The same as a table for a notebook."""
        return as_html(str(self))


@dataclass(frozen=True, slots=True, eq=False)
class StreamTerms:
    """What all kinds of streams are made of.

    Attributes:
        message: that opens the motion.
        request: of which the message was made.
        ceiling: of the speed, a fraction in (0, 1].
        period: time between two ticks [s].
        watchdog: longest gap between two targets; a longer one stops the arm [s].
        boundary: of the workspace; None: there is none.
        clear: model of bodies to keep clear of; None: none.
        until: conditions that end the motion, in the order of the message.
        breaks: conditions of the arm itself, and what follows when one of them ends the motion.
    """

    message: wire.ServoOpen
    request: ServoRequest
    ceiling: float
    period: float
    watchdog: float
    boundary: Boundary | None = None
    clear: ClearanceModel | None = None
    until: tuple[Condition, ...] = ()
    breaks: tuple[BreakRule, ...] = ()

    def changed(self, settings: dict[str, Any]) -> StreamTerms:
        """The same stream with other settings of its request; errors as `ServoRequest` and its `message`."""
        request = replace(self.request, **settings)
        message = replace(request.message(self.ceiling), until=self.message.until)
        return replace(self, request=request, message=message)


class Servo(Block):
    """A stream of targets; made by `Arm.servo`, used in a `with` block. Its subclasses define what a target is.

    Leaving the block ends the motion at rest. An error that ended it earlier, such as a missed watchdog, is raised
    there.

    Attributes:
        period: time between two ticks [s].
        watchdog: longest gap between two targets; a longer one stops the arm [s].
    """

    what = "servo motion"
    period: Final[float]
    watchdog: Final[float]

    def __init__(self, connection: Connection, terms: StreamTerms) -> None:
        self.period = terms.period
        self.watchdog = terms.watchdog
        self._connection = connection
        self._link = connection.link
        self._clock = connection.clock
        self._terms = terms
        self._message = terms.message
        self._boundary = terms.boundary
        self._clear: ClearTargets | None = None
        self._handle: MotionHandle | None = None
        self._number = 0
        self._active = self._closed = False
        self._start: State | None = None
        self._result: Result | None = None
        self._began = self._due = self._last = 0
        self._first_sent = self._last_sent = 0
        self._sent = self._late_ticks = self._clamped = 0
        self._costs: deque[int] = deque(maxlen=_COSTS)

    # ------------------------------------------------------------------------------------ life

    def __enter__(self) -> Servo:
        """Begin the servo motion at the arm's position and wait until it runs.

        Raises:
            CommandRejected: refused; ModeConflict if another motion runs.
            MotionAborted: the cabinet could not start it.
        """
        if self._handle is not None:
            raise LocalProtocolError("a servo is used once", hint="make another one with arm.servo(...)")
        self._connection.check_may_wait("the with block of arm.servo()")
        self._open(self._wait_for_start)
        self._began = self._due = self._last = self._clock.nanos()
        return self

    def _open(self, prepare: Callable[[], None] = lambda: None) -> None:
        """Begin the motion, wait until it runs, and prepare for targets; raises what keeps it from that."""
        handle = self._handle = MotionHandle.send(
            self._connection, self._message, until=self._terms.until, breaks=self._terms.breaks
        )
        try:
            if not handle.wait_started(_PATIENCE):
                raise Timeout(
                    f"the servo motion did not begin within {_PATIENCE:g} s",
                    hint="check in arm.state.safety whether the robot is ready to move, or paused",
                )
            if handle.done:
                self._result = handle.wait()  # raises the error that ended it
            prepare()
        except BaseException:  # there will be no targets
            handle.cancel()
            raise
        self._number, self._active = handle.id, True
        self._connection.enter_block(handle, "arm.servo()")
        handle.add_done_callback(self._on_end)

    def _wait_for_start(self) -> None:
        """Wait until the state at the start is known."""
        newest = self._connection.newest()
        before = 0 if newest is None or newest.joints is None else newest.joints.stamp
        self._start = self._connection.wait_for(
            lambda state: state.joints is not None and state.joints.stamp > before, _PATIENCE
        )
        self._clear = self._check_of_targets()

    def _check_of_targets(self) -> ClearTargets | None:
        """What refuses targets near bodies; None: nothing."""
        clear = self._terms.clear
        return None if clear is None else ClearTargets(clear, self.start.q)

    def close(self) -> None:
        """End the motion at rest; raises the error that ended it early. Calling it again has no effect."""
        handle = self._handle
        if handle is None or self._closed:
            return
        self._active = False
        self._connection.leave_block(handle)  # first: the link may fail in what follows
        if not handle.done:
            self._connection.cancel(handle)
        try:
            self._result = handle.wait(timeout=_PATIENCE)
        finally:
            self._closed = handle.done  # what was interrupted is tried again at the end of the block

    def __repr__(self) -> str:
        """Short form."""
        state = "not begun" if self._handle is None else "active" if self._active else "ended"
        return f"<{type(self).__name__}, {state}, {self._sent} targets sent>"

    def _on_end(self, handle: MotionHandle) -> None:
        if handle is self._handle:  # not one that ended for a change of the limits
            self._active = False

    @property
    def active(self) -> bool:
        """Whether the arm follows the targets."""
        return self._active

    @property
    def start(self) -> State:
        """The robot's state when the motion began: build targets on it, so that nothing jumps."""
        if self._start is None:
            raise LocalProtocolError(
                "the servo motion has not begun", hint="use it in a with block: with arm.servo(...) as servo"
            )
        return self._start

    @property
    def result(self) -> Result | None:
        """How it ended, after the block."""
        return self._result

    @property
    def t(self) -> float:
        """Time since the motion began [s]."""
        return (self._clock.nanos() - self._began) * 1e-9

    # ---------------------------------------------------------------------------------- the loop

    def tick(self) -> float | None:
        """Wait for the next period.

        Returns:
            Time since the last tick [s]; None when the motion has ended (the end of the block raises why).
        """
        if not self._active:
            return None
        clock = self._clock
        self._due += round(self.period * 1e9)
        now = clock.nanos()
        if now < self._due:
            self._look_ahead(now)
            clock.sleep_until(self._due)
            now = clock.nanos()
        late = (now - self._due) * 1e-9
        if late > 0.5 * self.period:
            self._late_ticks += 1
            if late > self.period:
                self._due = now  # missed periods are not made up for in a burst
        passed = (now - self._last) * 1e-9
        self._last = now
        return passed if self._active else None

    def _look_ahead(self, now: int) -> None:
        """Use the time until the next tick, on the clock of this machine [ns]."""

    def _send(self, began: int, kind: type[wire.OneWay], target: list[float]) -> None:
        if not self._active:
            _ = self.start  # raises unless it has begun
            return
        numbers = (self._number, self.watchdog, *target)
        self._link.send_target(kind, numbers, now=began, watchdog=self.watchdog)
        self._sent += 1
        self._last_sent = now = self._clock.nanos()
        self._costs.append(now - began)
        if self._sent == 1:
            self._first_sent = now

    def change(
        self,
        mode: Mode | None = None,
        *,
        speed: float | None = None,
        acceleration: float | None = None,
        speed_mps: float | None = None,
        acceleration_mps2: float | None = None,
        speed_radps: float | None = None,
        acceleration_radps2: float | None = None,
    ) -> None:
        """Change the parameters of the control mode, or limits, of the running servo motion; None keeps them.

        The mode changes while the arm follows. Sunrise takes other limits only at the start of a servo motion: the arm
        brakes, and a servo motion with the new limits takes its place, which follows the next target. What the cabinet
        counts for `stats` begins again.

        Args:
            mode: of the same kind as the one with which the servo motion began.
            speed: these are the limits of `Arm.servo`.
            acceleration: likewise.
            speed_mps: likewise.
            acceleration_mps2: likewise.
            speed_radps: likewise.
            acceleration_radps2: likewise.

        Raises:
            ModeConflict: another kind of mode than the one with which the servo motion began.
            LimitError: a value outside its range; nothing has changed.
            CommandRejected: nothing is to change, or a limit that this kind of servo motion does not obey.
            MotionAborted: the motion could not begin again; it has ended.
        """
        limits = {
            "speed": speed,
            "acceleration": acceleration,
            "speed_mps": speed_mps,
            "acceleration_mps2": acceleration_mps2,
            "speed_radps": speed_radps,
            "acceleration_radps2": acceleration_radps2,
        }
        settings: dict[str, Any] = {name: value for name, value in limits.items() if value is not None}
        if mode is None and not settings:
            raise CommandRejected(
                "change must have something to change, got nothing",
                parameter="mode",
                hint="give a mode or a limit, for example change(speed=0.5)",
            )
        if settings:
            self._check_may_change(next(iter(settings)))
            self._connection.check_may_wait("change() of the limits of a servo motion")
        message = None if mode is None else mode_message(instance(mode, MODES, "mode"))
        terms = self._terms.changed(settings if mode is None else settings | {"mode": mode})
        _ = self.start  # raises unless it has begun
        if message is not None:
            self._connection.request(wire.ServoSettings(servo=self._number, mode=message))
        self._terms, self._message = terms, terms.message
        if settings:
            self._prepare_again()
            self._begin_again()

    def _prepare_again(self) -> None:
        """Forget what depends on the limits before."""

    def _check_may_change(self, limit: str) -> None:
        """Refuse a change of the limits of a stream that cannot begin again; `limit` is the name of one."""
        if self._message.engine is wire.ServoEngine.DIRECT:
            raise CommandRejected(
                'the engine "direct" follows targets that go on from where the arm is; it cannot brake in between',
                parameter=limit,
                hint='use engine="smart", or leave the with block and begin another one',
            )

    def _begin_again(self) -> None:
        """End the motion at rest and begin one with the present limits; no effect if it has ended by itself."""
        handle = self._handle
        assert handle is not None
        if not handle.done:
            self._active = False
            self._connection.cancel(handle)
        result = handle.wait(timeout=_PATIENCE)  # raises the error that ended it
        if result.cause is Cause.CANCELLED:
            self._connection.leave_block(handle)
            self._open()

    @property
    def refused(self) -> int:
        """Targets so far that the arm was not sent to: refused by the cabinet, by its last report, or held here."""
        stats = self.stats
        return stats.refused + stats.held

    @property
    def stats(self) -> ServoStats:
        """Statistics so far; also after the block."""
        seconds = (self._last_sent - self._first_sent) * 1e-9
        median, p99 = np.percentile(self._costs, [50, 99]) * 1e-9 if self._costs else (nan, nan)
        rate = (self._sent - 1) / seconds if self._sent > 1 and seconds > 0 else nan
        stats = ServoStats(
            self._sent, rate, self._late_ticks, float(median), float(p99), clamped=self._clamped
        )
        if self._clear is not None:
            clear = self._clear
            stats = replace(stats, slowdown=clear.slowdown, slowdowns=clear.slowdowns, held=clear.held)
        report = None if self._handle is None else self._connection.events.servo_status(self._handle.id)
        if report is None:
            return stats
        return replace(
            stats,
            received=report.targets,
            applied=report.applied,
            refused=report.refused,
            late=report.late,
            age_median=report.age_median,
            age_p99=report.age_p99,
            text=report.text,
        )


class TargetServo(Servo):
    """A stream of targets that the joints follow, one by one or in chunks; its subclasses define what a target is."""

    def __init__(self, connection: Connection, terms: StreamTerms) -> None:
        super().__init__(connection, terms)
        self._low, self._high = connection.robot.q_min.tolist(), connection.robot.q_max.tolist()
        self._newest: Array | None = None
        self._newest_speed: Sequence[float] = _STILL
        self._actions: ActionStream | None = None
        self._is_corrected = False

    def close(self) -> None:
        """End the motion at rest; raises the error that ended it early. Calling it again has no effect."""
        if self._closed:
            return
        if self._actions is not None:
            self._actions.close()
        self._correct(is_on=False)
        super().close()
        if self._actions is not None:
            self._actions.raise_failure()

    def _prepare_again(self) -> None:
        if self._actions is not None:
            self._actions.close()
            self._actions = None

    def correct(self, q: npt.ArrayLike, dq: npt.ArrayLike | None = None) -> Array:
        """Send a person's target while a policy's chunks wait: `set`, and recordings flag the time as corrected.

        The correction ends with the next `follow`, `hold` or `set`.

        Args:
            q: joint positions, shape (7,) [rad]; clipped as by `JointServo.set`.
            dq: velocity at the target, shape (7,) [rad/s]; None: come to rest there.

        Returns:
            The positions sent, shape (7,) [rad].

        Raises:
            ShapeError: not seven numbers.
            LimitError: one is not finite; OutsideWorkspace if `arm.workspace` refuses the target.
            CollisionForeseen: bodies of `keep_clear_of` are too near; the last good target was sent again.
            CommandRejected: a velocity for the engine "direct", or a straight servo motion.
        """
        self._refuse_lines()
        if self._actions is not None:
            self._actions.leave()
        self._correct(is_on=True)
        return self._joint_target(q, dq)

    @property
    def target(self) -> tuple[Array, Array]:
        """The newest target: joint positions and their velocity, shape (7,) each [rad, rad/s]."""
        return (self._here() if self._newest is None else self._newest), np.array(self._newest_speed)

    def _here(self) -> Array:
        """Joint positions from which the first target goes on, shape (7,) [rad]."""
        return self.start.q  # raises unless it has begun

    def _joint_target(self, q: npt.ArrayLike, dq: npt.ArrayLike | None) -> Array:
        """Send joint positions and their velocity; see `JointServo.set`."""
        began = self._clock.nanos()
        if dq is not None and self._message.engine is wire.ServoEngine.DIRECT:
            raise CommandRejected(
                'the engine "direct" takes no velocity: the following targets define it',
                parameter="dq",
                hint='leave dq out, or use engine="smart"',
            )
        clamped = self._clamped
        sent, target = self._clip(q)
        if self._boundary is not None:
            sent = self._inside_joints(sent, self._boundary)
            if sent.tolist() != target:
                self._clamped = clamped + 1
                dq = None if dq is None else np.zeros(7)  # it comes to rest at the wall
            target = sent.tolist()
        velocity = [] if dq is None else array(dq, 7, "dq").tolist()
        if self._clear is not None and self._active:
            try:
                self._clear.check(sent, parameter="q")
            except CollisionForeseen:
                self._newest = self._clear.q
                self._send(began, wire.ServoJoints, self._newest.tolist())
                raise
        self._newest, self._newest_speed = sent, velocity or _STILL
        self._send(began, wire.ServoJoints if dq is None else wire.ServoJointsVelocity, target + velocity)
        return sent

    def _clip(self, q: npt.ArrayLike) -> tuple[Array, list[float]]:
        """Clip joint positions to the limits; returns them as an array and as a list."""
        # with cold caches the number of different functions counts more than the number of calls
        if not (type(q) is np.ndarray and q.dtype is _DOUBLES and q.shape == (7,)):
            q = array(q, 7, "q")
        sent = q.copy()
        target = sent.tolist()
        if not (all(map(le, self._low, target)) and all(map(le, target, self._high))):  # nor is NaN
            sent = array(sent, 7, "q").clip(self._low, self._high)
            target = sent.tolist()
            self._clamped += 1
        return sent, target

    def _inside_joints(self, q: Array, boundary: Boundary) -> Array:
        """The target inside the workspace.

        Raises:
            OutsideWorkspace: it is outside, and such targets are refused.
        """
        last = self._here() if self._newest is None else self._newest
        if boundary.refuses and boundary.excess(q) > max(boundary.excess(last), TOLERANCE):
            raise boundary.refusal(q, "the target", parameter="q")
        return boundary.clamped(q, last)

    def hold(self) -> None:
        """Brake and rest until the next `follow`, `set` or `correct`; a thread keeps sending meanwhile.

        A program may then take its time, as for the first chunk of a policy, and the watchdog does not stop the arm.

        Raises:
            CommandRejected: a straight servo motion.
        """
        newest, speed = self.target  # raises unless it has begun
        self._action_stream(newest).brake(newest, speed * self._connection.real_time_factor)
        self._correct(is_on=False)

    def _follow_actions(self, q: Array, times: Array) -> TakenChunk:
        """Follow joint positions, shape (n, 7) [rad], at times of `t` [s]; see `JointServo.follow`."""
        newest, speed = self.target  # raises unless it has begun
        last = newest, speed * self._connection.real_time_factor
        taken = self._action_stream(newest).take(times, q, last=last)
        self._correct(is_on=False)
        return taken

    def _action_stream(self, here: Array) -> ActionStream:
        """The thread that follows actions; made where the arm is, shape (7,) [rad]."""
        self._refuse_lines()
        if self._actions is None:
            robot, rate = self._connection.robot, self._connection.real_time_factor
            acceleration = self._message.acceleration
            path = ActionPath(
                here,
                speed=self._message.velocity * rate * robot.dq_max,
                acceleration=acceleration * rate**2 * robot.ddq_max,
                jerk=acceleration * rate**3 * robot.dddq_max,
            )
            is_direct = self._message.engine is wire.ServoEngine.DIRECT
            self._actions = ActionStream(
                path,
                lambda q, dq: self._joint_target(q, None if is_direct else dq / rate),
                time=lambda: self.t,
                clock=self._clock,
                period=self.period,
                ahead=self._message.timing.min_trajectory_time,
            )
        return self._actions

    def _refuse_lines(self) -> None:
        """Refuse joint positions for a straight servo motion."""
        if self._message.engine is wire.ServoEngine.LIN:
            raise CommandRejected(
                'arm.servo("lin") takes poses by set alone',
                parameter="chunk",
                hint='use arm.servo("pose"), whose poses are followed by the joints',
            )

    def _leave_chunks(self) -> None:
        """Stop following chunks: the program sets targets itself, and corrects nothing."""
        if self._actions is not None:
            self._actions.leave()
        if self._is_corrected:
            self._correct(is_on=False)

    def _correct(self, *, is_on: bool) -> None:
        """Note in the journal where a person's correction begins and ends."""
        if is_on != self._is_corrected:
            self._is_corrected = is_on
            self._connection.journal.add(CORRECTION, "begins" if is_on else "ends")


class JointServo(TargetServo):
    """A stream of joint positions."""

    def __enter__(self) -> JointServo:
        """Begin; see `Servo.__enter__`."""
        super().__enter__()
        return self

    def set(self, q: npt.ArrayLike, dq: npt.ArrayLike | None = None) -> Array:
        """Send a target; the newest one wins. After the end of the motion it has no effect.

        Args:
            q: joint positions, shape (7,) [rad]; clipped to the limits of the joints, and to `arm.workspace`.
            dq: velocity at the target, shape (7,) [rad/s]; None: come to rest there. With the engine "smart" only.

        Returns:
            The positions sent, shape (7,) [rad].

        Raises:
            ShapeError: not seven numbers.
            LimitError: one is not finite; OutsideWorkspace if `arm.workspace` refuses the target.
            CollisionForeseen: bodies of `keep_clear_of` are too near; the last good target was sent again, to rest at.
            CommandRejected: a velocity for the engine "direct", which takes none.
        """
        if self._actions is not None or self._is_corrected:
            self._leave_chunks()
        return self._joint_target(q, dq)

    def follow(self, chunk: npt.ArrayLike, *, at: npt.ArrayLike, rate: float | None = None) -> TakenChunk:
        """Follow actions with time stamps, as a policy predicts them; a thread sends the targets.

        The chunk replaces what is left of the last one, however late it comes: actions whose time has passed are left
        out, and the path changes to the new actions without a stop, within the limits of the joints. Between two
        actions it is a cubic spline. Actions that the joints cannot follow are smoothed as little as possible. Behind
        the last action the arm brakes and rests. `set` and `correct` take over, and the next chunk begins there.

        Args:
            chunk: joint positions, shape (n, 7) [rad].
            at: time of the first action on the clock of `t`, or of each, shape (n,) [s].
            rate: actions per second, where `at` is one time [Hz]; None: that of the servo motion.

        Returns:
            From when on it is followed, how many actions were late, how long the change takes.

        Raises:
            ShapeError: other shapes.
            LimitError: a number that is not finite, times that do not ascend; all actions are late; or not even the
                smoothed actions are within `speed` and `acceleration`. The last chunk goes on then.
            CollisionForeseen: bodies of `keep_clear_of` were too near for a target of the last chunk, or
                OutsideWorkspace: `arm.workspace` refused it. The arm rests before it.
        """
        q = actions(chunk)
        times = action_times(at, len(q), rate=1.0 / self.period if rate is None else rate)
        return self._follow_actions(q, times)


class PoseServo(TargetServo):
    """A stream of poses of the motion frame in the base, followed by the joints."""

    def __init__(
        self,
        connection: Connection,
        terms: StreamTerms,
        *,
        moving: Pose,
        elbow: Callable[[Array], ElbowTask],
    ) -> None:
        super().__init__(connection, terms)
        self._to_flange = moving.inverse()  # moving: pose of the motion frame in the flange frame
        self._elbow_from = elbow
        self._elbow: ElbowTask | None = None
        self._q = np.zeros(7)  # joint positions of the last good target
        self._pose = Pose.at()  # and its pose
        self._held = 0
        self._slowdown = FREE
        self._slowdowns: dict[str, Slowdown] = {}

    def __enter__(self) -> PoseServo:
        """Begin; see `Servo.__enter__`."""
        super().__enter__()
        self._q = self.start.q
        self._pose = Pose.from_matrix(forward(self._connection.robot, self._q)) @ self._to_flange.inverse()
        self._elbow = self._elbow_from(self._q)
        return self

    def set(self, pose: Pose) -> Pose:
        """Send a target; the newest one wins. After the end of the motion it has no effect.

        The joint positions are those nearest to the last target, with the elbow as `elbow` or `posture` states. A
        pose that they cannot reach is not sent: the arm is held at the last good target, and `stats` has the reason.

        Returns:
            The pose sent: shifted into `arm.workspace`, if there is one, or the last good one.

        Raises:
            ShapeError: not a Pose.
            OutsideWorkspace: `arm.workspace` refuses the target.
            CollisionForeseen: bodies of `keep_clear_of` are too near; the last good target was sent again.
        """
        began = self._clock.nanos()
        check_pose(pose)
        if self._actions is not None or self._is_corrected:
            self._leave_chunks()
            if self._newest is not None:  # chunks or corrections were followed until now
                self._q, self._newest, self._newest_speed = self._newest, None, _STILL
        if not self._active:
            _ = self.start  # raises unless it has begun
            return pose
        try:
            self._take(pose)
        finally:
            self._follow(began)
        return self._pose

    def follow(self, chunk: Sequence[Pose], *, at: npt.ArrayLike, rate: float | None = None) -> TakenChunk:
        """Follow poses with time stamps, as a policy predicts them; see `JointServo.follow`.

        The joints follow a smooth path through the solutions of the poses, with the elbow as `elbow` or `posture`
        states; between the poses the motion frame is on no exact line.

        Args:
            chunk: poses of the motion frame in the base.
            at: time of the first one on the clock of `t`, or of each, shape (n,) [s].
            rate: poses per second, where `at` is one time [Hz]; None: that of the servo motion.

        Raises:
            ShapeError: not poses, or another number of times.
            Unreachable: a pose has no joint positions; its index is in the text. The last chunk goes on.
            LimitError: as `JointServo.follow`.
        """
        if isinstance(chunk, Pose) or not 1 <= len(chunk) <= MOST_ACTIONS:
            raise ShapeError(
                f"chunk must have 1 to {MOST_ACTIONS} poses, got {shown(chunk)}",
                parameter="chunk",
                value=chunk,
            )
        for index, pose in enumerate(chunk):
            check_pose(pose, f"chunk[{index}]")
        times = action_times(at, len(chunk), rate=1.0 / self.period if rate is None else rate)
        self._refuse_lines()
        rows, kept = [], self._q
        self._q = self.target[0]
        try:
            for index, pose in enumerate(chunk):
                with inside(f"chunk[{index}]"):
                    self._q = self._joints(pose)
                rows.append(self._q)
        finally:
            self._q = kept
        return self._follow_actions(np.array(rows), times)

    def _here(self) -> Array:
        _ = self.start  # raises unless it has begun
        return self._q

    def _follow(self, began: int) -> None:
        """Send the last good target."""
        self._send(began, wire.ServoJoints, self._q.tolist())

    def _take(self, pose: Pose) -> None:
        """Make a target the last good one, if it is good.

        Raises:
            OutsideWorkspace: the workspace refuses it.
            CollisionForeseen: bodies are too near.
        """
        boundary, clamped = self._boundary, self._clamped
        if boundary is not None:
            pose = self._inside(pose, boundary)
        try:
            q = self._joints(pose)
        except Unreachable as error:
            self._held += 1
            reason = self._reason(pose) or f"out of reach: {error.text}"
            if not self._slowdowns:  # the first one; the others are counted
                _log.warning("servo motion: a target is not sent, the arm is held: %s", reason)
            self._slowdown = self._slowdowns[reason] = Slowdown(reason, 0.0)
            return
        if (
            boundary is not None
            and boundary.workspace.joints is not None
            and ((q < boundary.q_min - TOLERANCE) | (q > boundary.q_max + TOLERANCE)).any()
        ):
            if boundary.refuses:
                raise boundary.refusal(q, "the target", parameter="pose")
            self._clamped = clamped + 1
            return
        if self._clear is not None:
            self._clear.check(q, parameter="pose")
        self._q, self._pose, self._slowdown = q, pose, FREE

    def _joints(self, pose: Pose) -> Array:
        """Joint positions of a target, near to the last good one.

        Raises:
            Unreachable: there are none.
        """
        assert self._elbow is not None
        robot = self._connection.robot
        reach = self._message.velocity * float(robot.dq_max.min()) * self.period
        return resolved_pose(robot, pose @ self._to_flange, self._q, elbow=self._elbow, reach=reach)

    def _reason(self, pose: Pose) -> str:
        """What keeps the arm from going on to a pose from the last good target; empty: nothing near."""
        here, there = self._pose @ self._to_flange, pose @ self._to_flange
        twist = here.displacement(there) / self.period
        found = blockage(self._connection.robot, self._q, twist)
        if found.reason.startswith(
            "speed"
        ):  # it is far: what would stop the arm if it went there more slowly?
            found = blockage(self._connection.robot, self._q, 0.99 * found.factor * twist)
        return found.reason

    @property
    def stats(self) -> ServoStats:
        """Statistics so far; also after the block."""
        stats = super().stats
        slowdown = self._slowdown if stats.slowdown is FREE else stats.slowdown
        return replace(
            stats,
            slowdown=slowdown,
            slowdowns=(*stats.slowdowns, *self._slowdowns.values()),
            held=stats.held + self._held,
        )

    def _inside(self, pose: Pose, boundary: Boundary) -> Pose:
        """The target inside the box of the workspace.

        Raises:
            OutsideWorkspace: it is outside, and such targets are refused.
        """
        flange = pose @ self._to_flange
        tool = (flange @ boundary.tip).xyz
        inside = boundary.clamped_point(tool)
        if boundary.refuses and boundary.outside(tool) > TOLERANCE:
            raise boundary.refusal_of_point(tool, "the target", parameter="pose")
        if float(np.abs(inside - tool).max()) <= _ROUNDING:
            return pose
        self._clamped += 1
        return Pose.of(pose.xyz + inside - tool, pose.quat)


class LineServo(PoseServo):
    """A stream of poses of the motion frame in the base, followed on straight lines."""

    def __init__(
        self,
        connection: Connection,
        terms: StreamTerms,
        *,
        moving: Pose,
        elbow: Callable[[Array], ElbowTask],
    ) -> None:
        super().__init__(connection, terms, moving=moving, elbow=elbow)
        self._looked = 0

    def __enter__(self) -> LineServo:
        """Begin; see `Servo.__enter__`."""
        super().__enter__()
        return self

    def set(self, pose: Pose) -> Pose:
        """Send a target; the newest one wins. After the end of the motion it has no effect.

        A3 keeps its angle. Where the line meets a limit of a joint, a singularity or the end of the reach, the
        arm comes to rest on it, and `stats` has the reason; the cabinet refuses a pose that is out of reach altogether.

        Returns:
            The pose sent: shifted into `arm.workspace`, if there is one.

        Raises:
            ShapeError: not a Pose.
            OutsideWorkspace: `arm.workspace` refuses the target.
            CollisionForeseen: bodies of `keep_clear_of` are too near; the last good target was sent again.
        """
        return super().set(pose)

    def _follow(self, began: int) -> None:
        pose = self._pose
        self._send(began, wire.ServoPose, pose.xyz.tolist() + pose.quat.tolist())

    def _joints(self, pose: Pose) -> Array:
        """Joint positions of a target, if somebody asks for them; the cabinet refuses a pose that has none."""
        joints = self._boundary is not None and self._boundary.workspace.joints is not None
        if self._clear is None and not joints:
            return self._q
        try:
            return solve(self._connection.robot, pose @ self._to_flange, near=self._q.tolist())
        except Unreachable:
            return self._q

    @property
    def stats(self) -> ServoStats:
        """Statistics so far; also after the block."""
        self._look(self._clock.nanos())
        return super().stats

    def _look_ahead(self, now: int) -> None:
        if now - self._looked > _LOOK and self._due - now > _LOOK_TIME:
            self._look(now)

    def _look(self, now: int) -> None:
        """Find out what slows the arm down on its line."""
        self._looked = now
        limits, newest = self._message.linear, self._connection.newest()
        joints = None if newest is None else newest.groups.joints
        if not self._sent or not self._active or joints is None or limits is None:
            return
        robot = self._connection.robot
        left = Pose.from_matrix(forward(robot, joints.q_cmd)).displacement(self._pose @ self._to_flange)
        distance, turn = float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))
        seconds = max(distance / limits.velocity, turn / limits.orientation_velocity)
        self._slowdown = FREE
        if seconds > _ARRIVED:
            why = blockage(robot, joints.q_cmd, left / seconds)
            self._slowdown = why
            known = self._slowdowns.get(why.reason, FREE)
            if why.factor < known.factor:
                self._slowdowns[why.reason] = why
