"""The interpolator of the simulated controller: from commands to one set-point per tick.

Theory of operation
-------------------
The plant's thread calls `Interpolator.advance` once per tick of 1 ms. A tick takes requests, advances the speed
override, evaluates conditions, begins the next command when none runs, and asks the running command for the set-point
after this tick. Everything else happens in the phase of that command, `RunningMotion.phase`:

    begin ──┬─> timed ──────────────────────────────┬─> settling ──> closed
            ├─> holding <──> (first overlay)         │       ^
            │      └──────> overlaid ──────┐         │       │
            ├─> guided ────────────────────┼─> braking ──────┘
            └─> servoing <──> stopped ─────┘

timed      moves along the path of its plan. The path's own time passes at the speed override; where axes cannot
           follow a change of it, only a part of the change is made (`_step`).
holding    does not move: a hold waits until its time is over, a motion that an FRI client overlays for the client;
           anything else without a path has nothing to do.
overlaid   an FRI client gives the set-points. The motion beneath goes on, seen by the client alone, and ends the
           overlay with it (`_carry`). It has no way back: once the client is silent, the axes brake.
guided     a hand moves the arm while the enabling switch is held.
servoing   follows targets with a `Follower`, on the time of the speed override as a timed motion does.
stopped    a safety stop brakes each axis of a servo motion by itself, since its axes have no path in common. When the
           stop ends, the motion starts again from rest. (A straight servo motion has a path: it stays servoing, and the
           override brings it to rest on its line.)
braking    comes to rest at full motion time, whatever the override is: on the path by a shorter profile, along the
           present direction off it (`RunningMotion.halt`), or by a follower. There is no way back to a motion.
settling   the set-points have ended; it is closed when the measured joints have arrived, or rest.

Why the command is over is no phase. `failure`, `cancelled` and `broken` say it from the moment of the decision; the
phase determines where the set-points come from, until the arm is at rest. A cancelled command usually brakes in that
tick, but not while a safety stop brakes it already: it stays in its phase, and settles when the override rests, or
brakes when the stop ends before that. A failure inside a tick brakes in this same tick (`_break_off`), since one tick
of rest would be a jump.

Limits. A plan keeps the axes' limits at full speed, and so does each follower in the motion's own time. What is added
here is the change of the override, and `_step` is the one place that checks it, for paths and for followers. `_set` is
the last line of defence: a set-point that an axis could not follow ends the motion by an error.

Foreseen ticks. Where the table of a timed motion alone decides about the next set-points (`is_foreseen`), the plant
computes them in C and does not call `advance` until something happens (`is_disturbed`); `catch_up` then takes over
what those ticks have passed. Only phase timed is foreseen, which is why the set of conditions is short.

Threads. `advance`, `trip`, `command` and `catch_up` belong to the thread of the ticks. Any thread may submit or cancel
(`MotionQueue`), `change_mode`, `abort`, and set `is_paused`; those requests wait in queues until the next tick, so that
a phase changes inside a tick only. Listeners are called from the thread of the ticks and must not wait.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from math import inf, nan
from typing import Literal, Protocol, TypeAlias

import numpy as np

from heptarm.errors import Unreachable
from heptarm.planning.jerk_profile import ProfileLimits, TimeLaw, brake
from heptarm.planning.motion import TICK, ServoMotion
from heptarm.planning.path import JointLine, JointPath
from heptarm.planning.plan import Plan
from heptarm.planning.seam import HandGuide, Hold, OperationMode
from heptarm.planning.table import MotionTable
from heptarm.sim.control_laws.active_law import ActiveLaw
from heptarm.sim.control_laws.laws import MeasuredState, Superposition
from heptarm.sim.controller.ahead import SetPointsAhead
from heptarm.sim.controller.command import MotionCommand
from heptarm.sim.controller.condition_monitor import ConditionMonitor, LoadEstimate, WatchedCondition
from heptarm.sim.controller.hand_guiding import GuidedMotion
from heptarm.sim.controller.queue import Cancellation, MotionQueue
from heptarm.sim.controller.safety import SafetyController
from heptarm.sim.controller.servo import (
    AxisStop,
    DirectFollower,
    Follower,
    SmartFollower,
    StraightFollower,
    braking_axes,
    follower,
)
from heptarm.sim.controller.setpoints import SetPoints
from heptarm.sim.controller.speed_override import SpeedOverride
from heptarm.values.checks import Array
from heptarm.values.mode.mode import Mode as ControlMode
from heptarm.values.robot import RobotModel

#: Where the set-points of a command come from; see the theory of operation above.
Phase: TypeAlias = Literal[
    "timed", "holding", "overlaid", "guided", "servoing", "stopped", "braking", "settling"
]


class RunningMotion:
    """The command that is being executed.

    Args:
        command: what was commanded.
        planned: its plan.
        serial: its number among all accepted commands.
        watches: its conditions.

    Attributes:
        phase: where its set-points come from.
        has_braked: it has come, or comes, to rest before the end of its plan.
        cancelled: somebody has ended it, or a condition.
        broken: a condition has.
        failure: text of the error that has; "" none.
        path: phases timed and braking, and beneath an overlay; None: there is none, or a follower brakes.
        carried: set-point of the motion beneath an overlay, shape (7,) [rad]; None: there was none.
        follower: phases servoing, stopped and braking.
        stop: phase stopped.
        guided: phase guided.
    """

    __slots__ = (
        "broken",
        "cancelled",
        "carried",
        "command",
        "failure",
        "follower",
        "guided",
        "has_braked",
        "part",
        "path",
        "phase",
        "place",
        "plan",
        "profile",
        "serial",
        "settling",
        "started",
        "step",
        "still",
        "stop",
        "table",
        "time",
        "watches",
    )

    def __init__(
        self, command: MotionCommand, planned: Plan, serial: int, watches: tuple[WatchedCondition, ...]
    ) -> None:
        self.command = command
        self.plan = planned
        self.serial = serial
        self.watches = watches
        self.path: JointPath | None = planned.path
        self.profile: TimeLaw | None = None if planned.timing is None else planned.timing.profile
        self.table = planned.table
        self.step = self.place = 0.0
        self.failure = ""
        self.part = 0
        self.time = 0.0
        waits = self.path is None or self.profile is None or command.is_overlaid
        self.phase: Phase = "holding" if waits else "timed"
        self.carried: Array | None = None
        self.has_braked = False
        self.cancelled = False
        self.settling = 0
        self.still = 0
        self.started = False
        self.follower: Follower | None = None
        self.stop: AxisStop | None = None
        self.guided: GuidedMotion | None = None
        self.broken = False

    def serve(self, follower: Follower) -> None:
        """Follow targets."""
        self.follower, self.phase = follower, "servoing"

    def guide(self, guided: GuidedMotion) -> None:
        """Follow a hand."""
        self.guided, self.phase = guided, "guided"

    def settle(self) -> None:
        """The set-points have ended."""
        self.phase = "settling"

    def give_up(self) -> None:
        """The set-points have ended where the arm is, with closed brakes."""
        self.path = self.follower = self.stop = self.guided = None
        self.phase, self.has_braked = "settling", True

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest on the path, as fast as its limits allow.

        Args:
            scale: speed as a fraction of full speed; the stop itself runs at full speed.
            rate: change of that fraction [1/s].
        """
        if self.phase == "settling":
            return
        if self.follower is not None:
            self.follower.brake(scale=scale, rate=rate)
        elif self.phase == "holding":
            self.settle()
            return
        else:
            assert self.plan.timing is not None
            self.profile = self.plan.timing.stop(self.time, scale, rate)
            self.time = 0.0
        self.phase, self.has_braked = "braking", True

    def brake_by(self, follower: Follower) -> None:
        """Come to rest off the path, by a follower that brakes."""
        self.follower, self.stop, self.guided = follower, None, None
        self.phase, self.has_braked = "braking", True

    def halt(self, here: Array, speed: Array, hardest: tuple[float, float]) -> Array:
        """Come to rest off the path: all axes together, in the direction of the present velocity.

        Args:
            here: present set-point, shape (7,) [rad].
            speed: its velocity, shape (7,) [rad/s].
            hardest: acceleration [rad/s²] and jerk [rad/s³] of the fastest axis.

        Returns:
            Where it comes to rest, shape (7,) [rad].
        """
        full = float(np.abs(speed).max())
        self.give_up()
        if full < 1e-9:
            return here
        self.path, self.phase = JointLine(here.copy(), here + speed), "braking"
        limits = ProfileLimits(2.0, hardest[0] / full, hardest[1] / full)
        self.profile, self.time = brake((0.0, 1.0, 0.0), limits), 0.0
        rest: Array = here + speed * self.profile.at(self.profile.duration)[0]
        return rest


#: A motion is done when every measured joint is within this distance of its command [rad] and this slow [rad/s] ...
SETTLED = 5e-5
SETTLED_SPEED = 1e-3
#: ... or has been this slow for this many ticks, since a load deflects it; or at the latest after this many ticks.
STILL_TICKS = 60
SETTLE_TICKS = 500

#: To look up a member of an enumeration takes half a microsecond.
_T1 = OperationMode.T1
#: Highest speed of the tool frame in T1 [m/s], slightly below the standard's 250 mm/s.
REDUCED_SPEED = 0.249
#: A change of the override that an axis cannot follow is halved so often.
_HALVINGS = 10
#: The fraction of an axis' acceleration that such a change may use; the rest is for rounding.
_GRIP = 1.0 - 1e-9
#: Jerk of a fast stop relative to that of a motion.
FAST_JERK = 20.0


class ServoTarget(Protocol):
    """A target of a servo motion: see `heptarm.sim.plant.shared_state.NewestTarget`."""

    @property
    def order(self) -> int:
        """Id of the servo motion that it is for."""

    @property
    def q(self) -> Array:
        """Joint positions [rad], or x y z [m] and quaternion of the tool frame, shape (7,)."""

    @property
    def dq(self) -> Array | None:
        """Velocity at the target, shape (7,) [rad/s]; None: rest."""


class ControllerInputs(Protocol):
    """What the controller reads in each tick."""

    @property
    def override(self) -> float:
        """Factor on every programmed speed, 0 to 1."""

    @property
    def signals(self) -> Array:
        """Values of the IO image, shape (n,)."""

    def target(self) -> ServoTarget | None:
        """The newest servo target; None: no new one."""


class ForeseenTicks(Protocol):
    """Ticks that needed no more than the table of the running motion."""

    @property
    def points(self) -> Array:
        """Set-points of the last, this and the next tick, shape (3, 7) [rad]."""

    @property
    def where(self) -> tuple[float, float]:
        """Time [s] and path parameter of the motion."""


class Interpolator:
    """Computes the set-points of a plant.

    Args:
        robot: the robot.
        inputs: override, servo targets and IO image.
        sensed: measured state; the arrays of its positions and velocities stay the same.
        load: external load of the arm.
        control: the control law in force.
        safety: stop requests and operation mode.

    Attributes:
        queue: waiting commands.
        condition_monitor: evaluates the conditions.
        run: the command that is being executed; None: nothing runs.
        is_paused: come to rest on the path, keeping all commands.
        action: command of an FRI overlay for the next tick.
        passed: has computed the ticks since the last `advance`, which were foreseen; None: there was none.
    """

    def __init__(
        self,
        robot: RobotModel,
        inputs: ControllerInputs,
        sensed: MeasuredState,
        load: LoadEstimate,
        control: ActiveLaw,
        safety: SafetyController,
    ) -> None:
        self._robot, self._inputs, self._load = robot, inputs, load
        self._control, self._safety = control, safety
        self._q, self._dq = sensed.q, sensed.dq
        self._command = SetPoints(robot, self._q)
        self._ahead = SetPointsAhead(self._command)
        self.queue = MotionQueue(robot, self._rest)
        self.condition_monitor = ConditionMonitor(robot, inputs.signals)
        self._speed_override = SpeedOverride(robot)
        self._changes: deque[tuple[int, ControlMode]] = deque()  # of the control mode of a command
        # commands to end by an error; 0: whichever runs
        self._aborts: deque[tuple[int, str]] = deque()
        self.run: RunningMotion | None = None
        self.is_paused = False
        self.action: Superposition | None = None
        self.passed: ForeseenTicks | None = None

    @property
    def order(self) -> int:
        """Id of the running command, 0 if none."""
        return 0 if self.run is None else self.run.command.id

    @property
    def is_overlaid(self) -> bool:
        """Whether the last set-point was an FRI overlay's."""
        return self.run is not None and self.run.phase == "overlaid"

    @property
    def interpolated(self) -> Array:
        """Set-point of the next tick without an overlay, shape (7,) [rad]; of a hold: its start."""
        run = self.run
        return self.command.after if run is None or run.carried is None else run.carried

    @property
    def rests(self) -> bool:
        """Whether the set-points rest."""
        return self.command.rests

    @property
    def is_quiet(self) -> bool:
        """Whether nothing runs, nothing waits for the next tick, and no condition is observed."""
        return (
            self.run is None
            and self.queue.is_quiet
            and not (self._aborts or self._changes or self.condition_monitor.is_busy)
        )

    def _rest(self) -> Array:
        return self._command.after.copy()

    def change_mode(self, order_id: int, mode: ControlMode) -> None:
        """Change the parameters of the running command's control mode, from any thread; see `Plant.change_mode`."""
        self._changes.append((order_id, mode))

    def abort(self, order_id: int, text: str) -> None:
        """End a running command (0: whichever runs) by an error, from any thread."""
        self._aborts.append((order_id, text))

    def trip(self, text: str) -> None:
        """The brakes close at once: the running command ends by an error where the arm is."""
        self.command.stay(self._q)
        run = self.run
        if run is not None:
            run.failure = run.failure or text
            run.give_up()

    def advance(self) -> tuple[float, float]:
        """Shift the set-points and compute the next one; returns progress and remaining time."""
        self.catch_up()
        if cancellations := self.queue.cancelled():
            self._cancel(cancellations)
        while self._aborts:
            order_id, text = self._aborts.popleft()
            if self.run is not None and order_id in (0, self.order) and not self.run.failure:
                self.run.failure = text
                if self.run.phase != "overlaid" and not self.run.has_braked:
                    self._fail(self.run, text)
        while self._changes:
            order_id, mode = self._changes.popleft()
            if order_id == self.order:
                self._control.retune(mode)
        self._advance_override()
        if self.condition_monitor.is_busy or (self.run is not None and self.run.watches):
            self._check_conditions()
        run = self.run
        if run is None:
            run = None if self._safety.latched else self._next()
            if run is None and self._control.stiffen():
                self._command.stay(self._q)
        self._command.shift()
        if run is None:
            return 0.0, nan
        if not run.started:
            run.started = True
            if run.command.listener is not None:
                run.command.listener.started()
        if self._control.violation:
            self._stop_at_limit(run, self._control.violation)
        return self._follow(run)

    @property
    def is_disturbed(self) -> bool:
        """Whether something has happened since the last tick that the next one has to look at."""
        return bool(
            self._aborts
            or self._changes
            or self.queue.is_interrupted
            or self.condition_monitor.is_busy
            or self.is_paused
            or self._safety.latched
            or self._safety.manual * self._inputs.override != self._speed_override.factor
        )

    @property
    def is_foreseen(self) -> bool:
        """Whether the table of the running motion alone decides about the next set-points, unless it `is_disturbed`.

        Such ticks need no `advance`, until the table ends or the next part of the motion begins: see `passed`.
        """
        run = self.run
        return (
            run is not None
            and run.phase == "timed"
            and run.table is not None
            and run.started
            and not (run.cancelled or run.watches)
            and self._safety.mode is not _T1
            and not self._control.violation
            and self._speed_override.rests_at(self._goal)
            and not self.is_disturbed
        )

    @property
    def step(self) -> float:
        """By how much the time of a motion grows in a tick [s]."""
        return TICK * self._speed_override.factor

    @property
    def command(self) -> SetPoints:
        """The set-points; for the thread of the ticks."""
        self.catch_up()
        return self._command

    def catch_up(self) -> None:
        """Go on behind the ticks that `passed` has computed."""
        passed, run = self.passed, self.run
        if passed is None or run is None:
            return
        self.passed = None
        command = self._command
        command.before, command.now, command.after = passed.points
        run.time, run.place = passed.where

    def _next(self) -> RunningMotion | None:
        while (accepted := self.queue.take()) is not None:
            command = accepted.command
            if self._control.take(command.mode, tcp=command.tcp, axes=command.axes):
                self._command.stay(self._q)
            planned = self.queue.planned(accepted, self._command.after)
            if planned is None:
                continue
            watches = self.condition_monitor.begin(planned, command.watches)
            self.run = run = RunningMotion(command, planned, accepted.serial, watches)
            if isinstance(command.motion, ServoMotion):
                run.serve(follower(self._robot, command.motion, self._command.after, tcp=command.tcp))
            if isinstance(command.motion, HandGuide):
                run.guide(self._guided(command.motion, command.tcp))
            return run
        return None

    def _check_conditions(self) -> None:
        """Evaluate the conditions; a break condition stops the running motion on its path."""
        run = self.run
        watches: Sequence[WatchedCondition] = () if run is None or run.has_braked else run.watches
        if run is not None and run.phase == "settling":  # only a trigger may be at the very end
            watches = [watch for watch in watches if not watch.breaks]
        elapsed, part = (0.0, 0) if run is None else (run.time, run.part)
        breaks = self.condition_monitor.check(
            self._q, self._load.torque, self._load.wrench, watches=watches, elapsed=elapsed, part=part
        )
        if breaks and run is not None and not run.cancelled and not run.failure:
            run.broken = True
            self.queue.diverge()
            self._brake(run)

    def _advance_override(self) -> None:
        """Advance the speed override by one tick: overrides, pauses, stops, operation mode."""
        safety, goal = self._safety, self._goal
        if safety.mode is _T1 and self.run is not None:
            tcp = self.run.command.tcp[:3]
            self._speed_override.advance(
                goal, self._command, halts=safety.latched, ceiling=REDUCED_SPEED, tcp=tcp
            )
        else:
            self._speed_override.advance(goal, self._command, halts=safety.latched)

    @property
    def _goal(self) -> float:
        """Speed that override, smartPAD, pauses and stops ask for, 0 to 1."""
        safety = self._safety
        held = self.is_paused or safety.latched
        return 0.0 if held else safety.manual * min(1.0, max(0.0, self._inputs.override))

    def _follow(self, run: RunningMotion) -> tuple[float, float]:
        """Set the next set-point according to the phase; returns progress and remaining time."""
        if run.cancelled and run.phase in ("timed", "holding", "servoing"):  # a safety stop brakes it
            if self._speed_override.rests:
                run.settle()
            elif not self._safety.latched:  # the stop ended before the motion was at rest
                self._brake_on_path(run)
        match run.phase:
            case "timed":
                return self._follow_path(run)
            case "holding" | "overlaid":
                return self._hold(run)
            case "guided":
                return self._follow_hand(run)
            case "servoing" | "stopped":
                return self._follow_targets(run)
            case "braking":
                return self._come_to_rest(run)
            case "settling":
                return self._settle(run)

    # ------------------------------------------------------------------------------------------------ along a path

    def _follow_path(self, run: RunningMotion) -> tuple[float, float]:
        """Move along the path, on the time of the speed override."""
        assert run.path is not None and run.profile is not None
        path, profile, here = run.path, run.profile, self._command.after
        step = self._step(lambda step: path.at(_clipped(profile.at(run.time + step)[0]), here))
        if run.table is not None and self._follow_ahead(run, run.table, step):
            return run.plan.progress(run.place, run.part), run.plan.duration - run.time
        return self._follow_profile(run, step)

    def _follow_profile(self, run: RunningMotion, step: float) -> tuple[float, float]:
        """Move along the path by so much of the profile's time [s]."""
        path, profile, planned = run.path, run.profile, run.plan
        assert path is not None and profile is not None
        run.time += step
        s = _clipped(profile.at(run.time)[0])
        if run.time >= profile.duration:
            run.settle()
        self._reach(run, s)
        # at the very end take the planned joints: the path itself may end a rounding error beside them
        if s == 1.0 and path is planned.path:
            self._command.after = planned.end
        else:
            self._set_on(run, path, s)
        # a set-point that no axis could follow has replaced the profile
        left = nan if run.profile is None else run.profile.duration - run.time
        return (nan if run.failure else planned.progress(s, run.part)), left

    def _step(self, at: Callable[[float], Array]) -> float:
        """By how much the motion's time grows in this tick [s]: no axis leaves its acceleration limit for the override.

        The change of the override adds to the acceleration of the motion: as much of it is made as the axes can follow,
        and the rest in later ticks. Where the motion itself needs more than an axis' limit, the change adds nothing.

        Args:
            at: the next set-point if the motion's time grew by so much [s], shape (7,) [rad].
        """
        override = self._speed_override
        whole, last = override.factor, override.last_factor
        if whole == last:
            return TICK * whole
        straight = 2.0 * self._command.after - self._command.before
        room = _GRIP * self._robot.ddq_max * TICK**2

        def needed(part: float) -> float:
            """Of the axis that needs most, relative to its acceleration, for a part of the change."""
            there = at(TICK * (last + part * (whole - last)))
            return float((np.abs(there - straight) / room).max())

        try:
            if needed(1.0) <= 1.0:
                return TICK * whole
            allowed = max(1.0, needed(0.0))
            low, high = 0.0, 1.0
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if needed(middle) <= allowed else (low, middle)
        except Unreachable:  # reported where the set-point is made
            return TICK * whole
        override.change_by(low)
        return TICK * override.factor

    def _follow_ahead(self, run: RunningMotion, table: MotionTable, step: float) -> bool:
        """Take the next set-point from those that are computed ahead; False: there is none.

        Args:
            run: the motion.
            table: of the motion.
            step: by which its time grows in this tick [s].
        """
        command, ahead = self._command, self._ahead
        time = ahead.take(table, run.time, step, command.after)
        if time < 0.0:
            if step != run.step or step <= 0.0:  # the speed changes, or the motion pauses
                run.step = step
                ahead.drop()
                return False
            if not ahead.are_over(table):
                ahead.compute(table, run.time, step, command.after)
                time = ahead.take(table, run.time, step, command.after)
            if time < 0.0:  # the last ticks are computed one by one
                run.table = None
                return False
        run.time, run.place, command.after = time, ahead.place, ahead.last
        self._reach(run, ahead.place)
        return True

    def _reach(self, run: RunningMotion, s: float) -> None:
        """Report the parts that have begun at s."""
        marks, listener = run.plan.marks, run.command.part_listener
        while run.part < len(marks) and s >= marks[run.part]:
            run.part += 1
            if listener is not None:
                listener.reached(run.part)

    def _set_on(self, run: RunningMotion, path: JointPath, s: float) -> None:
        """Set the next set-point from a path; one that an axis could not follow ends the motion."""
        try:
            there = path.at(s, self._command.after)
        except Unreachable as error:
            self._break_off(run, f"the path is not reachable: {error.text}")
            return
        self._set(run, there)

    def _set(self, run: RunningMotion, there: Array) -> None:
        """Set the next set-point; one that an axis could not follow ends the motion."""
        axis = self._command.leap(there)
        if axis is not None and not run.failure:
            self._break_off(run, f"Command Velocity violates limit A{axis + 1} (singularity)")
            return
        self._command.after = there

    # ------------------------------------------------------------------------------------------------ without a path

    def _hold(self, run: RunningMotion) -> tuple[float, float]:
        """Wait for the end of a hold, or for the FRI client that overlays a motion, or take its set-points."""
        is_hold = isinstance(run.plan.motion, Hold)
        ends = run.cancelled or run.failure or run.time >= run.plan.duration
        if self.action is not None and (is_hold or run.command.is_overlaid) and not ends:
            run.phase = "overlaid"
            progress = self._carry(run)
            self._command.after = (
                self._held(run) if self.action.is_missing else self._overlaid(run, self.action)
            )
            return progress
        if run.phase == "overlaid":
            if not self._control.is_stiff:  # the spring that torques have wound would throw the arm
                self._take_over()
            self._halt(run)
            return self._follow(run)
        if run.command.is_overlaid and not is_hold:
            return 0.0, run.plan.duration
        run.time += self.step
        if run.cancelled or run.time >= run.plan.duration or not is_hold:
            run.settle()
            self._reach(run, 1.0)
        return min(1.0, run.time / run.plan.duration), run.plan.duration - run.time

    def _carry(self, run: RunningMotion) -> tuple[float, float]:
        """Let the motion beneath an overlay go on; returns its progress and remaining time."""
        run.time += self.step
        path, profile = run.path, run.profile
        if path is None or profile is None:
            run.carried = run.plan.end
            return 0.0, nan
        s = _clipped(profile.at(run.time)[0])
        self._reach(run, s)
        try:
            here = self._command.after if run.carried is None else run.carried
            run.carried = run.plan.end if s == 1.0 else path.at(s, here)
        except Unreachable as error:
            run.failure = f"the path is not reachable: {error.text}"
        return run.plan.progress(s, run.part), run.plan.duration - run.time

    def _overlaid(self, run: RunningMotion, action: Superposition) -> Array:
        """The set-point of an overlay, under the control mode of its hold."""
        if run.follower is not None:
            run.follower, command = None, run.command
            self._control.take(command.mode, tcp=command.tcp, axes=command.axes)
        return action.q

    def _held(self, run: RunningMotion) -> Array:
        """The set-point of an overlay whose load is missing: the spring that it has wound would throw the arm."""
        if run.follower is None:
            self._take_over()
            run.follower = self._braking_axes(FAST_JERK)
        return run.follower.advance(TICK)

    # ------------------------------------------------------------------------------------------------ to the end

    def _come_to_rest(self, run: RunningMotion) -> tuple[float, float]:
        """Brake at full motion time."""
        if run.follower is None:
            return self._follow_profile(run, TICK)
        return self._follow_further(run, run.follower, TICK)

    def _settle(self, run: RunningMotion) -> tuple[float, float]:
        """Wait until the measured joints have arrived, then close the command."""
        if self._control.stays and not run.cancelled and not run.failure:
            return 1.0, 0.0
        run.settling += 1
        run.still = run.still + 1 if float(np.abs(self._dq).max()) <= SETTLED_SPEED else 0
        at_rest = run.still > 0 and (
            not self._control.is_stiff
            or run.still > STILL_TICKS
            or float(np.abs(self._q - self._command.after).max()) <= SETTLED
        )
        if at_rest or run.settling >= SETTLE_TICKS:
            cause = "condition" if run.broken else "cancelled" if run.cancelled else "done"
            self.run = None
            self.queue.close(run.command, "error" if run.failure else cause, run.failure)
        return (nan if run.cancelled or run.failure else 1.0), 0.0

    def _fail(self, run: RunningMotion, text: str) -> None:
        """End the motion by an error: every axis brakes by itself, off the path."""
        run.failure = text
        self._halt(run)

    def _break_off(self, run: RunningMotion, text: str) -> None:
        """Let the motion fail in a tick without a set-point: it brakes at once, since a tick of rest would jump."""
        self._fail(run, text)
        if run.follower is not None:
            self._command.after = run.follower.advance(TICK)
        elif run.path is not None and run.profile is not None:
            run.time += TICK
            self._command.after = run.path.at(run.profile.at(run.time)[0], self._command.after)

    def _halt(self, run: RunningMotion, *, jerk: float = 1.0) -> None:
        """Come to rest off the path: all axes together, in the direction of the present velocity.

        Where an axis would get beyond its range for the sake of a faster one, each brakes as hard as it may; so do the
        axes of an overlay or of a servo motion in joint space, which have no path in common. Those of an overlay do so
        as soon as the guard of the client expects: a jerk as gentle as that of a motion would take several degrees
        more.
        """
        here, speed = self._command.after, self._command.speed
        is_apart = run.phase == "overlaid" or isinstance(run.follower, SmartFollower | DirectFollower)
        if run.phase == "overlaid":
            jerk = FAST_JERK
        if run.phase == "guided":
            self._control.stiffen()
        hardest = float(self._robot.ddq_max.min()), jerk * float(self._robot.dddq_max.min())
        if is_apart or self._command.beyond(run.halt(here, speed, hardest)) is not None:
            run.brake_by(self._braking_axes(jerk))

    def _braking_axes(self, jerk: float) -> SmartFollower:
        return braking_axes(self._robot, self._command.after, self._command.speed, jerk=jerk)

    def _cancel(self, cancellations: Sequence[Cancellation]) -> None:
        """Execute the cancellations of a tick."""
        for cancellation in cancellations:
            run = self.run
            if run is not None and cancellation.affects(run.serial, run.command):
                (self._brake_fast if cancellation.fast else self._brake)(run)
        self.queue.drop(cancellations)

    def _brake(self, run: RunningMotion) -> None:
        if run.cancelled or run.failure:
            return
        run.cancelled = True
        # a stop in force brings a motion to rest sooner, but it does not act on hand guiding
        if run.phase == "guided" or not (self._safety.latched or run.phase == "stopped"):
            self._brake_on_path(run)

    def _brake_on_path(self, run: RunningMotion) -> None:
        if run.guided is not None:
            self._let_go(run, run.guided)
        elif run.phase != "overlaid":  # else the next tick brakes from the overlay's speed
            run.brake(scale=self._speed_override.scale, rate=self._speed_override.rate)

    def _brake_fast(self, run: RunningMotion) -> None:
        if run.failure or run.phase in ("settling", "guided"):
            self._brake(run)
            return
        run.cancelled = True
        if run.phase != "overlaid":  # else the next tick brakes from the overlay's speed
            self._halt(run, jerk=FAST_JERK)

    def _guided(self, guide: HandGuide, tcp: tuple[float, ...]) -> GuidedMotion:
        ceiling = REDUCED_SPEED if self._safety.mode is OperationMode.T1 else inf
        law = self._control.guide(guide, self._q, tcp=tcp[:3], ceiling=ceiling)
        return GuidedMotion(law, self._robot)

    def _follow_hand(self, run: RunningMotion) -> tuple[float, float]:
        """Follow the hand while the enabling switch is held and nothing stops the arm; end when it is released."""
        safety, guided = self._safety, run.guided
        assert guided is not None
        if guided.has_begun and not safety.guides:
            self._let_go(run, guided)
            return self._follow(run)
        if safety.guides and not (safety.latched or self.is_paused or guided.law.is_frozen):
            guided.has_begun, guided.rest = True, None
            self._control.follow_hand(guided.law)
            self._command.after = self._q + self._dq * TICK
        elif guided.has_begun:
            self._set(run, self._stopped(guided).advance(TICK))
        return nan, nan

    def _let_go(self, run: RunningMotion, guided: GuidedMotion) -> None:
        """Come to rest, then end."""
        if guided.has_begun:
            run.brake_by(self._stopped(guided))
        else:
            run.give_up()

    def _stopped(self, guided: GuidedMotion) -> SmartFollower:
        """The trajectory to rest after the switch was released."""
        self._control.stiffen()
        return guided.halt(self._q.copy(), self._dq)

    # ------------------------------------------------------------------------------------------------ towards targets

    def _follow_targets(self, run: RunningMotion) -> tuple[float, float]:
        """Move the set-point towards the newest target, unless a safety stop brakes the axes."""
        target, follower = self._inputs.target(), run.follower
        assert follower is not None
        if target is not None and target.order == run.command.id and not run.cancelled:
            follower.aim(target.q, target.dq)
        if not isinstance(follower, StraightFollower) and self._stops_axes(run, follower):
            return nan, follower.remaining
        return self._follow_further(run, follower, self._step(follower.ahead))

    def _follow_further(self, run: RunningMotion, follower: Follower, step: float) -> tuple[float, float]:
        """Move the set-point by so much of the motion's time [s]; it ends at rest, or some time after its target."""
        motion = run.command.motion
        try:
            there = follower.advance(step)
        except Unreachable as error:
            self._break_off(run, f"the path is not reachable: {error.text}")
            return nan, nan
        if run.phase == "braking":
            is_over = follower.is_still
        else:
            is_over = isinstance(motion, ServoMotion) and follower.resting > motion.timing.goal_timeout
        if is_over:
            run.settle()
        axis = None if run.failure else self._command.beyond(there)
        if axis is not None:
            self._break_off(run, f"Command Position violates limit A{axis + 1}")
        else:
            self._set(run, there)
        return nan, follower.remaining

    def _stops_axes(self, run: RunningMotion, follower: SmartFollower | DirectFollower) -> bool:
        """Whether a safety stop brakes the axes of a servo motion; moves the set-point if it does."""
        if run.stop is None:
            if not self._safety.latched:
                return False
            run.stop = AxisStop(self._robot, self._command.after, self._command.speed, jerk=FAST_JERK)
            run.phase = "stopped"
            self._speed_override.rest()
        elif run.stop.is_over and (run.cancelled or not self._safety.latched):
            run.stop, run.phase = None, "servoing"
            follower.restart(self._command.after)
            if run.cancelled:
                run.settle()
            return run.cancelled
        self._set(run, run.stop.advance())
        return True

    def _stop_at_limit(self, run: RunningMotion, text: str) -> None:
        """A limit of the control mode is exceeded: switch to position control and brake from the measured velocity."""
        self._take_over()
        run.settling = 0
        self._fail(run, text)

    def _take_over(self) -> None:
        """Switch to position control where the arm is, as fast as it is."""
        self._control.stiffen()
        self._command.continue_from(self._q, self._dq)


def _clipped(s: float) -> float:
    """A path parameter between 0 and 1."""
    return min(max(s, 0.0), 1.0)
