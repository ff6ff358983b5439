"""The interpolator of a simulated controller: turns orders into set-points, one a tick.

It takes orders from its queue, runs their time at the pace that overrides, pauses and stops allow, leads the set-points
along their paths or after servo targets, and brakes on the path or off it where something ends a motion early.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import inf, nan

import numpy as np

from heptarm.errors import Unreachable
from heptarm.values.arrays import Array
from heptarm.values.guiding import HandGuide
from heptarm.values.mode import Mode as ControlMode
from heptarm.values.robot import RobotModel
from heptarm.virtual import ring
from heptarm.virtual.condition import Lookout, Watching
from heptarm.virtual.control import Control
from heptarm.virtual.fri.overlay import Superposition
from heptarm.virtual.guiding import Guidance
from heptarm.virtual.law import Sensed
from heptarm.virtual.load import Load
from heptarm.virtual.order import Order
from heptarm.virtual.pace import Pace
from heptarm.virtual.queue import Cancellation, Queue
from heptarm.virtual.run import Run
from heptarm.virtual.safety import Mode, Safety
from heptarm.virtual.servo import Follower, SmartFollower, follower
from heptarm.virtual.setpoints import SetPoints
from heptarm.virtual.tick import TICK

#: A motion is done when every measured joint is this near to its command [rad] and this slow [rad/s] ...
SETTLED = 5e-5
SETTLED_SPEED = 1e-3
#: ... or after this many ticks.
SETTLE_TICKS = 500

#: Highest speed of the moved frame in T1 [m/s], a trifle less than the standard's 250 mm/s.
REDUCED_SPEED = 0.249
#: A fast stop may jerk so many times more than a motion.
FAST_JERK = 20.0


class Interpolator:
    """Leads the set-points of a plant.

    Args:
        robot: the robot.
        shared: ring with the override, the servo targets and the signals.
        sensed: what the plant measures; the arrays of its positions and speeds stay the same.
        load: external load of the arm.
        control: the control law in force.
        safety: what safety demands.

    Attributes:
        queue: orders that wait.
        lookout: looks at the conditions.
        command: the set-points.
        run: the order under way; None: nothing runs.
        is_paused: come to rest on the path, keeping all orders.
        action: what an FRI overlay wants of the next tick.
        is_overlaid: whether the last set-point was an overlay's.
    """

    def __init__(
        self, robot: RobotModel, shared: ring.Ring, sensed: Sensed, load: Load, control: Control, safety: Safety
    ) -> None:
        self._robot, self._ring, self._load = robot, shared, load
        self._control, self._safety = control, safety
        self._q, self._dq = sensed.q, sensed.dq
        self.command = SetPoints(robot, self._q)
        self.queue = Queue(robot, self._rest)
        self.lookout = Lookout(robot, shared.signals)
        self._pace = Pace(robot)
        self._changes: deque[tuple[int, ControlMode]] = deque()  # of the control mode of an order
        # orders that somebody else ends by an error; 0: whichever runs
        self._aborts: deque[tuple[int, str]] = deque()
        self.run: Run | None = None
        self.is_paused = False
        self.action: Superposition | None = None
        self.is_overlaid = False

    @property
    def order(self) -> int:
        """Id of the running order, 0 if none."""
        return 0 if self.run is None else self.run.plan.order.id

    @property
    def interpolated(self) -> Array:
        """Set-point of the next tick without an overlay, shape (7,) [rad]: where a held arm was when the hold began."""
        return self.run.plan.end if self.is_overlaid and self.run is not None else self.command.after

    @property
    def rests(self) -> bool:
        """Whether the set-points rest."""
        return self.command.rests

    def _rest(self) -> Array:
        return self.command.after.copy()

    def change_mode(self, order_id: int, mode: ControlMode) -> None:
        """Change the parameters of a running order's control mode, from any thread; see `Plant.change_mode`."""
        self._changes.append((order_id, mode))

    def abort(self, order_id: int, text: str) -> None:
        """End a running order (0: whichever runs) by an error, from any thread."""
        self._aborts.append((order_id, text))

    # ------------------------------------------------------------------------------ the tick

    def advance(self) -> tuple[float, float]:
        """Shift the set-points and compute the next one; returns progress and remaining time."""
        while (wish := self.queue.cancelled()) is not None:
            self._cancel(wish)
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
        self._keep_pace()
        if self.lookout.is_busy or (self.run is not None and self.run.watches):
            self._look()
        run = self.run
        if run is None:
            run = None if self._safety.latched else self._next()
            if run is None and self._control.stiffen():
                self.command.stay(self._q)
        self.command.shift()
        if run is None:
            return 0.0, nan
        if not run.started:
            run.started = True
            if run.plan.order.listener is not None:
                run.plan.order.listener.started()
        if self._control.violation:
            self._catch(run, self._control.violation)
        return self._follow(run)

    def _next(self) -> Run | None:
        while (accepted := self.queue.take()) is not None:
            order = accepted.order
            if self._control.take(order):
                self.command.stay(self._q)
            planned = self.queue.planned(accepted, self.command.after)
            if planned is None:
                continue
            self.run = run = Run(planned, accepted.serial, self.lookout.begin(planned))
            if order.is_servo:
                run.follower = follower(self._robot, order, self.command.after)
            if order.guide is not None:
                run.guidance = self._guidance(order, order.guide)
            return run
        return None

    def _look(self) -> None:
        """Look at the conditions; one that breaks the running motion brakes it on its path."""
        run = self.run
        watches: Sequence[Watching] = () if run is None or run.braking else run.watches
        if run is not None and run.ended:  # nothing is left to break, but a trigger may sit at the very end
            watches = [one for one in watches if not one.breaks]
        elapsed, part = (0.0, 0) if run is None else (run.time, run.part)
        breaks = self.lookout.look(
            self._q, self._load.torque, self._load.wrench, watches=watches, elapsed=elapsed, part=part
        )
        if breaks and run is not None and not run.cancelled and not run.failure:
            run.broken = True
            self.queue.diverge()
            self._brake(run)

    def _keep_pace(self) -> None:
        """How fast time runs in this tick, by overrides, pauses, stops and the operation mode."""
        safety = self._safety
        held = self.is_paused or safety.latched
        goal = 0.0 if held else safety.manual * min(1.0, max(0.0, float(self._ring.reals[ring.OVERRIDE])))
        if safety.mode is Mode.T1 and self.run is not None:
            tcp = self.run.plan.order.tcp[:3]
            self._pace.advance(goal, self.command, halts=safety.latched, ceiling=REDUCED_SPEED, tcp=tcp)
        else:
            self._pace.advance(goal, self.command, halts=safety.latched)

    def _follow(self, run: Run) -> tuple[float, float]:
        planned = run.plan
        if run.cancelled and not (run.ended or run.braking or self.is_overlaid):
            if self._pace.rests:
                run.ended = True
            elif not self._safety.latched:  # the stop is over before it was one
                self._brake_on_path(run)
        if run.ended:
            return self._settle(run)
        if run.guidance is not None:
            self._give_way(run, run.guidance)
            if run.guidance is not None:
                return nan, nan
        if run.follower is not None:
            return self._serve(run, run.follower)
        if self.action is not None and planned.order.kind == "hold" and not (run.cancelled or run.failure):
            self.is_overlaid = True
            self.command.after = self.action.q
            return 0.0, nan
        if self.is_overlaid:
            self.is_overlaid = False
            self._halt(run)
        run.time += TICK if run.braking else TICK * self._pace.factor
        if run.path is None or run.profile is None:
            if run.cancelled or run.time >= planned.duration or planned.order.kind != "hold":
                run.ended = True
                self._reach(run, 1.0)
            return min(1.0, run.time / planned.duration), planned.duration - run.time
        s = run.profile.at(run.time)[0]
        if run.time >= run.profile.duration:
            run.ended = True
        s = min(max(s, 0.0), 1.0)
        self._reach(run, s)
        # at the very end take the planned joints: the path's samples may end a rounding error beside them
        if s == 1.0 and run.path is planned.path:
            self.command.after = planned.end
        else:
            self._lead(run, s)
        return (nan if run.failure else planned.progress(s, run.part)), run.profile.duration - run.time

    def _reach(self, run: Run, s: float) -> None:
        """Tell of the parts that have begun at s."""
        marks, listener = run.plan.marks, run.plan.order.part_listener
        while run.part < len(marks) and s >= marks[run.part]:
            run.part += 1
            if listener is not None:
                listener.reached(run.part)

    def _lead(self, run: Run, s: float) -> None:
        """Set the next set-point; one that no axis could follow ends the motion."""
        assert run.path is not None
        try:
            there = run.path.at(s, self.command.after)
        except Unreachable as error:
            self._fail(run, f"the path is not reachable: {error.text}")
            return
        self._go(run, there)

    def _go(self, run: Run, there: Array) -> None:
        """Take a set-point unless an axis could not follow it."""
        axis = self.command.leap(there)
        if axis is not None and not run.failure:
            self._fail(run, f"Command Velocity violates limit A{axis + 1} (singularity)")
            return
        self.command.after = there

    def _settle(self, run: Run) -> tuple[float, float]:
        if self._control.stays and not run.cancelled and not run.failure:
            return 1.0, 0.0
        run.settling += 1
        at_rest = not self._control.is_stiff or float(np.abs(self._q - self.command.after).max()) <= SETTLED
        at_rest = at_rest and float(np.abs(self._dq).max()) <= SETTLED_SPEED
        if at_rest or run.settling >= SETTLE_TICKS:
            cause = "condition" if run.broken else "cancelled" if run.cancelled else "done"
            self.run = None
            self.queue.close(run.plan.order, "error" if run.failure else cause, run.failure)
        return (nan if run.cancelled or run.failure else 1.0), 0.0

    # ------------------------------------------------------------------------------ braking

    def _fail(self, run: Run, text: str) -> None:
        """Brake every axis by itself, off the path: straight on from where the last set-points led."""
        run.failure = text
        self._halt(run)

    def _halt(self, run: Run, *, jerk: float = 1.0) -> None:
        """Brake every axis by itself, straight on from where the last set-points led."""
        if run.guidance is not None:
            self._control.stiffen()
        hardest = float(self._robot.ddq_max.min()), jerk * float(self._robot.dddq_max.min())
        run.halt(self.command.after, self.command.speed, hardest)

    def _cancel(self, wish: Cancellation) -> None:
        """Carry out a cancellation."""
        run = self.run
        if run is not None and wish.concerns(run.serial, run.plan.order):
            (self._brake_fast if wish.fast else self._brake)(run)
        self.queue.drop(wish)

    def _brake(self, run: Run) -> None:
        if run.cancelled or run.failure:
            return
        run.cancelled = True
        # a stop in force brings a motion to rest sooner, but its pace is not that of a hand
        if run.guidance is not None or not self._safety.latched:
            self._brake_on_path(run)

    def _brake_on_path(self, run: Run) -> None:
        if run.guidance is not None:
            self._let_go(run, run.guidance)
            return
        if run.follower is not None or not self.is_overlaid:  # else the next tick brakes from the overlay's speed
            run.brake(scale=self._pace.scale, rate=self._pace.rate)

    def _brake_fast(self, run: Run) -> None:
        if run.failure or run.ended or run.guidance is not None:
            self._brake(run)
            return
        run.cancelled = True
        if not self.is_overlaid:  # else the next tick brakes from the overlay's speed
            self._halt(run, jerk=FAST_JERK)

    # ------------------------------------------------------------------------------ hand guiding

    def _guidance(self, order: Order, guide: HandGuide) -> Guidance:
        ceiling = REDUCED_SPEED if self._safety.mode is Mode.T1 else inf
        law = self._control.guide(guide, self._q, tcp=order.tcp[:3], ceiling=ceiling)
        return Guidance(law, self._robot)

    def _give_way(self, run: Run, guidance: Guidance) -> None:
        """Give way while the switch is held and nothing else stops the arm; end when it has been let go."""
        safety = self._safety
        if guidance.has_begun and not safety.guides:
            self._let_go(run, guidance)
        elif safety.guides and not (safety.latched or self.is_paused or guidance.law.is_frozen):
            guidance.has_begun, guidance.rest = True, None
            self._control.lead(guidance.law)
            self.command.after = self._q + self._dq * TICK
        elif guidance.has_begun:
            self._go(run, self._stopped(guidance).advance(TICK))

    def _let_go(self, run: Run, guidance: Guidance) -> None:
        """Come to rest, and end."""
        if guidance.has_begun:
            run.follower = self._stopped(guidance)
        else:
            run.ended = True
        run.braking, run.guidance = True, None

    def _stopped(self, guidance: Guidance) -> SmartFollower:
        """What brings an arm to rest that nobody leads any more."""
        self._control.stiffen()
        return guidance.halt(self._q.copy(), self._dq)

    # ------------------------------------------------------------------------------ servo motions and yielding

    def _serve(self, run: Run, follower: Follower) -> tuple[float, float]:
        """Lead the set-point to the newest target."""
        target = self._ring.target()
        order = run.plan.order
        if target is not None and target.order == order.id and not run.cancelled:
            follower.aim(target.q, target.dq)
        try:
            there = follower.advance(TICK if run.braking else TICK * self._pace.factor)
        except Unreachable as error:
            self._fail(run, f"the path is not reachable: {error.text}")
            return nan, nan
        run.ended = follower.is_still if run.braking else follower.resting > order.goal_timeout
        axis = self.command.beyond(there)
        if axis is not None:
            self._fail(run, f"Command Position violates limit A{axis + 1}")
        else:
            self._go(run, there)
        return nan, follower.remaining

    def _catch(self, run: Run, text: str) -> None:
        """A limit of the control mode is exceeded: become stiff and brake from the measured speed."""
        self._control.stiffen()
        self.command.go_on(self._q, self._dq)
        run.settling = 0
        self._fail(run, text)
