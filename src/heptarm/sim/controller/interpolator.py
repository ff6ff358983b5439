"""The interpolator of the simulated controller: from commands to one set-point per tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import inf, nan
from typing import Protocol

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


class RunningMotion:
    """The command that is being executed.

    Args:
        command: what was commanded.
        planned: its plan.
        serial: its number among all accepted commands.
        watches: its conditions.
    """

    __slots__ = (
        "braking",
        "broken",
        "cancelled",
        "command",
        "ended",
        "failure",
        "follower",
        "guided",
        "part",
        "path",
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
        self.braking = False
        self.cancelled = False
        self.ended = False
        self.settling = 0
        self.still = 0
        self.started = False
        self.follower: Follower | None = None
        self.stop: AxisStop | None = None
        self.guided: GuidedMotion | None = None
        self.broken = False

    def brake(self, *, scale: float, rate: float) -> None:
        """Come to rest on the path, as fast as its limits allow.

        Args:
            scale: speed as a fraction of full speed; the stop itself runs at full speed.
            rate: change of that fraction [1/s].
        """
        if self.follower is not None:
            self.follower.brake(scale=scale, rate=rate)
            self.braking = True
            return
        if self.ended or self.profile is None or self.path is None:
            self.ended = self.ended or self.path is None
            return
        assert self.plan.timing is not None
        self.profile = self.plan.timing.stop(self.time, scale, rate)
        self.time, self.braking = 0.0, True

    def halt(self, here: Array, speed: Array, hardest: tuple[float, float]) -> None:
        """Come to rest off the path: every axis brakes by itself, in the direction of the present velocity.

        Args:
            here: present set-point, shape (7,) [rad].
            speed: its velocity, shape (7,) [rad/s].
            hardest: acceleration [rad/s²] and jerk [rad/s³] of the fastest axis.
        """
        self.braking, self.follower, self.stop, self.guided = True, None, None, None
        full = float(np.abs(speed).max())
        self.ended = full < 1e-9
        if self.ended:
            self.path = None
            return
        self.path = JointLine(here.copy(), here + speed)
        limits = ProfileLimits(2.0, hardest[0] / full, hardest[1] / full)
        self.profile, self.time = brake((0.0, 1.0, 0.0), limits), 0.0


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
        is_overlaid: whether the last set-point was an overlay's.
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
        self.is_overlaid = False
        self.passed: ForeseenTicks | None = None

    @property
    def order(self) -> int:
        """Id of the running command, 0 if none."""
        return 0 if self.run is None else self.run.command.id

    @property
    def interpolated(self) -> Array:
        """Set-point of the next tick without an overlay, shape (7,) [rad]; of a hold: its start."""
        return self.run.plan.end if self.is_overlaid and self.run is not None else self.command.after

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
        self.is_overlaid = False
        run = self.run
        if run is not None:
            run.failure = run.failure or text
            run.braking = run.ended = True
            run.path = run.follower = run.stop = run.guided = None

    def advance(self) -> tuple[float, float]:
        """Shift the set-points and compute the next one; returns progress and remaining time."""
        self.catch_up()
        while (cancellation := self.queue.cancelled()) is not None:
            self._cancel(cancellation)
        while self._aborts:
            order_id, text = self._aborts.popleft()
            if self.run is not None and order_id in (0, self.order) and not self.run.failure:
                self.run.failure = text
                if not self.is_overlaid and not self.run.braking:
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
        return not (
            run is None
            or run.table is None
            or not run.started
            or run.ended
            or run.braking
            or run.cancelled
            or run.failure
            or run.watches
            or self.is_overlaid
            or self._safety.mode is _T1
            or self._control.violation
            or not self._speed_override.rests_at(self._goal)
            or self.is_disturbed
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
                run.follower = follower(self._robot, command.motion, self._command.after, tcp=command.tcp)
            if isinstance(command.motion, HandGuide):
                run.guided = self._guided(command.motion, command.tcp)
            return run
        return None

    def _check_conditions(self) -> None:
        """Evaluate the conditions; a break condition stops the running motion on its path."""
        run = self.run
        watches: Sequence[WatchedCondition] = () if run is None or run.braking else run.watches
        if run is not None and run.ended:  # nothing is left to break, but a trigger may be at the very end
            watches = [one for one in watches if not one.breaks]
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
        planned = run.plan
        if run.cancelled and run.stop is None and not (run.ended or run.braking or self.is_overlaid):
            if self._speed_override.rests:
                run.ended = True
            elif not self._safety.latched:  # the stop ended before the motion was at rest
                self._brake_on_path(run)
        if run.ended:
            return self._settle(run)
        if run.guided is not None:
            self._follow_hand(run, run.guided)
            if run.guided is not None:
                return nan, nan
        if run.follower is not None:
            return self._follow_targets(run, run.follower)
        if (
            self.action is not None
            and isinstance(planned.motion, Hold)
            and not (run.cancelled or run.failure)
        ):
            self.is_overlaid = True
            self._command.after = self.action.q
            return 0.0, nan
        if self.is_overlaid:
            self._halt(run)
            if run.follower is not None:
                return self._follow_targets(run, run.follower)
        step = TICK if run.braking else self._step(run)
        if run.table is not None and not run.braking and self._follow_ahead(run, run.table, step):
            s = run.place
            return (nan if run.failure else planned.progress(s, run.part)), planned.duration - run.time
        run.time += step
        if run.path is None or run.profile is None:
            if run.cancelled or run.time >= planned.duration or not isinstance(planned.motion, Hold):
                run.ended = True
                self._reach(run, 1.0)
            return min(1.0, run.time / planned.duration), planned.duration - run.time
        s = run.profile.at(run.time)[0]
        if run.time >= run.profile.duration:
            run.ended = True
        s = min(max(s, 0.0), 1.0)
        self._reach(run, s)
        # at the very end take the planned joints: the path itself may end a rounding error beside them
        if s == 1.0 and run.path is planned.path:
            self._command.after = planned.end
        else:
            self._follow_path(run, s)
        return (nan if run.failure else planned.progress(s, run.part)), run.profile.duration - run.time

    def _step(self, run: RunningMotion) -> float:
        """By how much the motion's time grows in this tick [s]: no axis leaves its acceleration limit for the override.

        The override changes along the path, whose curvature adds to the acceleration: as much of the change is made as
        the axes can follow.
        """
        override, path, profile = self._speed_override, run.path, run.profile
        step, last = TICK * override.factor, TICK * override.last_factor
        if step == last or path is None or profile is None:
            return step
        command = self._command
        straight = 2.0 * command.after - command.before
        room = self._robot.ddq_max * TICK**2

        def is_within(step: float) -> bool:
            s = min(max(profile.at(run.time + step)[0], 0.0), 1.0)
            return bool((np.abs(path.at(s, command.after) - straight) <= room).all())

        try:
            if is_within(step) or not is_within(last):
                return step
            for _ in range(_HALVINGS):
                middle = 0.5 * (step + last)
                step, last = (step, middle) if is_within(middle) else (middle, last)
        except Unreachable:  # reported where the set-point is made
            return step
        override.keep(last / TICK)
        return last

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

    def _follow_path(self, run: RunningMotion, s: float) -> None:
        """Set the next set-point from the path; one that an axis could not follow ends the motion."""
        assert run.path is not None
        try:
            there = run.path.at(s, self._command.after)
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

    def _settle(self, run: RunningMotion) -> tuple[float, float]:
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

        The axes of an overlay or of a servo motion in joint space have no path in common: each brakes as hard as it
        may, or it would get beyond its range for the sake of a faster one. Those of an overlay do so as soon as the
        guard of the client expects. A jerk as gentle as that of a motion would take several degrees more.
        """
        if self.is_overlaid or isinstance(run.follower, SmartFollower | DirectFollower):
            if self.is_overlaid:
                self.is_overlaid, jerk = False, FAST_JERK
            run.follower = braking_axes(self._robot, self._command.after, self._command.speed, jerk=jerk)
            run.braking, run.stop = True, None
            return
        if run.guided is not None:
            self._control.stiffen()
        hardest = float(self._robot.ddq_max.min()), jerk * float(self._robot.dddq_max.min())
        run.halt(self._command.after, self._command.speed, hardest)

    def _cancel(self, cancellation: Cancellation) -> None:
        """Execute a cancellation."""
        run = self.run
        if run is not None and cancellation.affects(run.serial, run.command):
            (self._brake_fast if cancellation.fast else self._brake)(run)
        self.queue.drop(cancellation)

    def _brake(self, run: RunningMotion) -> None:
        if run.cancelled or run.failure:
            return
        run.cancelled = True
        # a stop in force brings a motion to rest sooner, but it does not act on hand guiding
        if run.guided is not None or not (self._safety.latched or run.stop is not None):
            self._brake_on_path(run)

    def _brake_on_path(self, run: RunningMotion) -> None:
        if run.guided is not None:
            self._let_go(run, run.guided)
            return
        if (
            run.follower is not None or not self.is_overlaid
        ):  # else the next tick brakes from the overlay's speed
            run.brake(scale=self._speed_override.scale, rate=self._speed_override.rate)

    def _brake_fast(self, run: RunningMotion) -> None:
        if run.failure or run.ended or run.guided is not None:
            self._brake(run)
            return
        run.cancelled = True
        if not self.is_overlaid:  # else the next tick brakes from the overlay's speed
            self._halt(run, jerk=FAST_JERK)

    def _guided(self, guide: HandGuide, tcp: tuple[float, ...]) -> GuidedMotion:
        ceiling = REDUCED_SPEED if self._safety.mode is OperationMode.T1 else inf
        law = self._control.guide(guide, self._q, tcp=tcp[:3], ceiling=ceiling)
        return GuidedMotion(law, self._robot)

    def _follow_hand(self, run: RunningMotion, guided: GuidedMotion) -> None:
        """Follow the hand while the enabling switch is held and nothing stops the arm; end when it is released."""
        safety = self._safety
        if guided.has_begun and not safety.guides:
            self._let_go(run, guided)
        elif safety.guides and not (safety.latched or self.is_paused or guided.law.is_frozen):
            guided.has_begun, guided.rest = True, None
            self._control.follow_hand(guided.law)
            self._command.after = self._q + self._dq * TICK
        elif guided.has_begun:
            self._set(run, self._stopped(guided).advance(TICK))

    def _let_go(self, run: RunningMotion, guided: GuidedMotion) -> None:
        """Come to rest, then end."""
        if guided.has_begun:
            run.follower = self._stopped(guided)
        else:
            run.ended = True
        run.braking, run.guided = True, None

    def _stopped(self, guided: GuidedMotion) -> SmartFollower:
        """The trajectory to rest after the switch was released."""
        self._control.stiffen()
        return guided.halt(self._q.copy(), self._dq)

    def _follow_targets(self, run: RunningMotion, follower: Follower) -> tuple[float, float]:
        """Move the set-point towards the newest target."""
        target, motion = self._inputs.target(), run.command.motion
        if target is not None and target.order == run.command.id and not run.cancelled:
            follower.aim(target.q, target.dq)
        if not isinstance(follower, StraightFollower) and self._stops_axes(run, follower):
            return nan, follower.remaining
        try:
            there = follower.advance(TICK if run.braking else TICK * self._speed_override.factor)
        except Unreachable as error:
            self._break_off(run, f"the path is not reachable: {error.text}")
            return nan, nan
        if run.braking:
            run.ended = follower.is_still
        elif isinstance(motion, ServoMotion):
            run.ended = follower.resting > motion.timing.goal_timeout
        axis = None if run.failure else self._command.beyond(there)
        if axis is not None:
            self._break_off(run, f"Command Position violates limit A{axis + 1}")
        else:
            self._set(run, there)
        return nan, follower.remaining

    def _stops_axes(self, run: RunningMotion, follower: SmartFollower | DirectFollower) -> bool:
        """Whether a safety stop brakes the axes of a servo motion; moves the set-point if it does."""
        if run.stop is None:
            if run.braking or not self._safety.latched:
                return False
            run.stop = AxisStop(self._robot, self._command.after, self._command.speed, jerk=FAST_JERK)
            self._speed_override.rest()
        elif run.stop.is_over and (run.cancelled or not self._safety.latched):
            run.stop, run.ended = None, run.cancelled
            follower.restart(self._command.after)
            return run.ended
        self._set(run, run.stop.advance())
        return True

    def _stop_at_limit(self, run: RunningMotion, text: str) -> None:
        """A limit of the control mode is exceeded: switch to position control and brake from the measured velocity."""
        self._control.stiffen()
        self._command.continue_from(self._q, self._dq)
        run.settling = 0
        self._fail(run, text)
