"""The plant: a simulated LBR with its motion controller, one millisecond a tick.

MuJoCo steps the dynamics; planned motions and servo motions give the set-points, a control law the torques. The
plant needs neither JVM nor clock: whoever calls `tick` owns its time.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, nan

import mujoco
import numpy as np

from heptarm.errors import Unreachable
from heptarm.model.kinematics import flange
from heptarm.values.arrays import Array
from heptarm.values.links import Body
from heptarm.values.mode import Mode as ControlMode
from heptarm.values.robot import RobotModel, robot
from heptarm.virtual import ring
from heptarm.virtual.condition import Lookout, Watching
from heptarm.virtual.control import Control
from heptarm.virtual.fri.overlay import Superposition
from heptarm.virtual.law import PositionLaw, Sensed
from heptarm.virtual.load import Load
from heptarm.virtual.order import Order, PlanError
from heptarm.virtual.pace import Pace
from heptarm.virtual.path import JointLine, JointPath
from heptarm.virtual.payload import Payload
from heptarm.virtual.planner import Plan
from heptarm.virtual.posture import posture
from heptarm.virtual.profile import Limits, TimeLaw, brake
from heptarm.virtual.route import plan
from heptarm.virtual.safety import Demand, Mode, Safety
from heptarm.virtual.servo import Follower, follower
from heptarm.virtual.signals import Signals
from heptarm.virtual.world import Box, compiled

TICK_NS = 1_000_000
TICK = 1e-3

#: A motion is done when every measured joint is this near to its command [rad] and this slow [rad/s] ...
SETTLED = 5e-5
SETTLED_SPEED = 1e-3
#: ... or after this many ticks.
SETTLE_TICKS = 500

#: Highest speed of the moved frame in T1 [m/s], a trifle less than the standard's 250 mm/s.
REDUCED_SPEED = 0.249
#: A fast stop may jerk so many times more than a motion.
FAST_JERK = 20.0
#: After a stop on the path the brakes close when no axis is faster than this [rad/s], or after so many ticks.
BRAKE_SPEED = 0.02
BRAKE_TICKS = 400

#: Set-points this far behind a limit are rounding errors [rad].
ON_LIMIT = 1e-9
#: A set-point that asks for more than this many times an axis' speed is not followed.
OVERSPEED = 1.2

_DEMANDS = {
    Demand.EMERGENCY_STOP: ring.EMERGENCY_STOP,
    Demand.EXTERNAL_EMERGENCY_STOP: ring.EXTERNAL_STOP,
    Demand.OPERATOR_SAFETY: ring.SAFEGUARD_OPEN,
    Demand.PROTECTIVE_STOP: ring.PROTECTIVE_STOP,
    Demand.DRIVE_ERROR: ring.DRIVE_ERROR,
}

HOME = (0.0, 0.0, 0.0, -np.pi / 2, 0.0, np.pi / 2, 0.0)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of the plant after a tick; arrays of shape (7,) unless said otherwise.

    Attributes:
        time: plant time [s].
        q: measured positions [rad].
        q_cmd: commanded positions [rad].
        dq: velocities [rad/s].
        tau: torques at the sensors [Nm].
        tau_ext: external load acting on the joints [Nm].
        tau_cmd: commanded torques [Nm].
        wrench: external force and torque acting on the flange, base axes, shape (6,) [N, Nm].
        order: id of the running order, 0 if none.
        progress: of the running order, 0 to 1.
    """

    time: float
    q: Array
    q_cmd: Array
    dq: Array
    tau: Array
    tau_ext: Array
    tau_cmd: Array
    wrench: Array
    order: int
    progress: float


class _Run:
    """An order under way."""

    __slots__ = (
        "braking",
        "broken",
        "cancelled",
        "ended",
        "failure",
        "follower",
        "part",
        "path",
        "plan",
        "profile",
        "serial",
        "settling",
        "started",
        "time",
        "watches",
    )

    def __init__(self, planned: Plan, serial: int) -> None:
        self.plan = planned
        self.serial = serial
        self.path: JointPath | None = planned.path
        self.profile: TimeLaw | None = planned.profile
        self.failure = ""
        self.part = 0
        self.time = 0.0
        self.braking = False
        self.cancelled = False
        self.ended = False
        self.settling = 0
        self.started = False
        self.follower: Follower | None = None
        self.broken = False
        self.watches: tuple[Watching, ...] = ()


class Plant:
    """A simulated robot.

    Args:
        model: "iiwa7" or "iiwa14".
        q: joint positions at the start, shape (7,) [rad].
        boxes: what stands around it.
    """

    def __init__(
        self, model: str = "iiwa14", *, q: tuple[float, ...] = HOME, boxes: Sequence[Box] = ()
    ) -> None:
        self.robot: RobotModel = robot(model)
        self.model = compiled(model, boxes)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:7] = q
        mujoco.mj_forward(self.model, self.data)
        self.ring = ring.Ring()
        self.tick_count = 0
        self.on_wake: Callable[[int], None] | None = None
        self._views()
        self._load = Load(self.model, self.data)
        self._payload = Payload(self.model, self.data, self._mass)
        self._payloads: deque[tuple[Callable[[Body], None], Body]] = (
            deque()
        )  # to be told or hung in the next tick
        self._command = [self._q.copy() for _ in range(3)]  # set-points of the last, this and the next tick
        self._control = Control(self.robot, self.model, self.data)
        self.lookout = Lookout(self.robot, self.ring.signals)
        self.signals = Signals(self.ring.signals)
        self._sensed = Sensed(
            self._q, self._dq, self._mass[:7, :7], self._bias, self._passive, self._q, self._q, self._q
        )
        self.safety = Safety()
        self.on_safety: Callable[[int, int], None] | None = None  # called with flags and mode that have changed
        self._flags = 0
        self._pace = Pace(self.robot)
        self._paused = False
        self._brakes: PositionLaw | None = None  # closed
        self._braked = self._sensed
        self._halted = 0  # ticks for which a stop on the path has been in force
        self._planning = threading.Lock()  # one caller plans at a time; the tick never waits for it
        self._lock = threading.Lock()  # held for a few instructions only
        self._serial = 0  # of the newest accepted order
        self._inbox: deque[tuple[int, Order, Plan | None]] = deque()
        # newest order at that time, which one, whether fast
        self._cancels: deque[tuple[int, int | None, bool]] = deque()
        self._changes: deque[tuple[int, ControlMode]] = deque()  # of the control mode of an order
        # orders that somebody else ends by an error; 0: whichever runs
        self._aborts: deque[tuple[int, str]] = deque()
        self._action: Superposition | None = None  # what an FRI overlay wants of the next tick
        self._overlaid = False  # whether the last set-point was an overlay's
        self._run: _Run | None = None
        self._tail: Array | None = None  # where the last accepted order ends; None: not known
        self._open = 0  # accepted orders that have not ended
        self._cancel_count = 0
        self._write(0, 0.0, nan)

    def _views(self) -> None:
        d = self.data
        self._q, self._dq, self._acc = d.qpos[:7], d.qvel[:7], d.qacc[:7]
        self._bias, self._passive = d.qfrc_bias[:7], d.qfrc_passive[:7]
        self._ctrl = d.ctrl[:7]
        self._armature = self.model.dof_armature[:7].copy()
        self._limit, self._least = self.robot.tau_max, -self.robot.tau_max
        self._leap = OVERSPEED * self.robot.dq_max * TICK
        self._lowest, self._highest = self.robot.q_min - ON_LIMIT, self.robot.q_max + ON_LIMIT
        self._mass = np.zeros((self.model.nv, self.model.nv))
        self._tau = np.zeros(7)
        self._tau_cmd = np.zeros(7)

    # ------------------------------------------------------------------------------ orders, from any thread

    @property
    def time_ns(self) -> int:
        """Plant time [ns]."""
        return self.tick_count * TICK_NS

    @property
    def override(self) -> float:
        """Factor on every programmed speed, 0 to 1; Java writes it straight into the ring."""
        return float(self.ring.reals[ring.OVERRIDE])

    @override.setter
    def override(self, value: float) -> None:
        self.ring.reals[ring.OVERRIDE] = value

    @property
    def idle(self) -> bool:
        """No order is running or waiting."""
        return self._open == 0

    def submit(self, order: Order) -> None:
        """Plan an order from the end of what is queued and append it.

        While the arm brakes, the place it will come to rest at is not known; then the order is planned when
        its turn comes, and a planning error reaches its listener.

        Raises:
            PlanError: it cannot be planned; nothing has changed.
        """
        with self._planning:
            with self._lock:
                start = self._command[2].copy() if self._open == 0 else self._tail
                cancels = self._cancel_count
            planned = None if start is None else plan(self.robot, order, start)
            with self._lock:
                if cancels != self._cancel_count:
                    planned = None  # where the arm comes to rest is not known any more
                self._tail = None if planned is None else planned.end
                self._open += 1
                self._serial += 1
                self._inbox.append((self._serial, order, planned))

    def cancel(self, order_id: int | None = None) -> None:
        """Cancel an order (None: all): the running one brakes on its path, waiting ones are dropped."""
        self._cancel(order_id, fast=False)

    def stop(self) -> None:
        """Cancel everything."""
        self.cancel(None)

    def stop_fast(self) -> None:
        """Cancel everything; what runs leaves its path, since every axis brakes as hard as it may."""
        self._cancel(None, fast=True)

    def _cancel(self, order_id: int | None, *, fast: bool) -> None:
        with self._lock:
            self._tail = None
            self._cancel_count += 1
            self._cancels.append((self._serial, order_id, fast))

    def pause(self) -> None:
        """Come to rest on the path, keeping all orders."""
        self._paused = True

    def resume(self) -> None:
        """Go on after a pause, or after a stop that nobody demands any more."""
        self._paused = False
        self.safety.resume()

    def acknowledge(self) -> None:
        """Acknowledge errors whose cause has gone."""
        self.safety.withdraw(Demand.DRIVE_ERROR)

    def trip(self, text: str) -> None:
        """An error of the drives: what runs fails, every axis brakes by itself, and the drives stay off."""
        self.safety.demand(Demand.DRIVE_ERROR)
        self.abort(0, text)

    def apply_wrench(
        self,
        force: Array | tuple[float, ...],
        torque: Array | tuple[float, ...] = (0, 0, 0),
        *,
        duration: float = inf,
    ) -> None:
        """Push the flange with a force [N] and a torque [Nm], base axes, for a time [s]; zeros end it."""
        wrench = np.concatenate([np.asarray(force, dtype=np.float64), np.asarray(torque, dtype=np.float64)])
        self._load.push(wrench, self.tick_count * TICK + duration)

    def carries(self, load: Body) -> None:
        """Tell the controller what hangs on the flange; it does hang there unless `hang` says otherwise."""
        self._payloads.append((self._payload.declare, load))

    def hang(self, load: Body) -> None:
        """Hang something on the flange without telling the controller; declarations change nothing there any more."""
        self._payloads.append((self._payload.hang, load))

    def _take_loads(self) -> None:
        payload, sensed = self._payload, self._sensed
        while self._payloads:
            take, load = self._payloads.popleft()
            take(load)
        sensed.mass, sensed.bias, self._load.is_misjudged = payload.mass, payload.bias, payload.differs

    def change_mode(self, order_id: int, mode: ControlMode) -> None:
        """Change the parameters of a running order's control mode; of another order or kind it does nothing."""
        self._changes.append((order_id, mode))

    def abort(self, order_id: int, text: str) -> None:
        """End a running order (0: whichever runs) by an error; every axis brakes by itself."""
        self._aborts.append((order_id, text))

    # ------------------------------------------------------------------------------ overlays, from the tick's thread

    @property
    def interpolated(self) -> Array:
        """Set-point of the next tick without an overlay, shape (7,) [rad]: where a held arm was when the hold began."""
        return self._run.plan.end if self._overlaid and self._run is not None else self._command[2]

    def overlay(self, action: Superposition | None) -> None:
        """Lay an action on the running hold in the next tick; None after one: brake, and end the hold."""
        self._action = action

    # ------------------------------------------------------------------------------ the tick

    def step(self, ticks: int = 1) -> None:
        """Run a number of ticks."""
        for _ in range(ticks):
            self.tick()

    def tick(self) -> None:
        """One millisecond: set-point, control law, dynamics, state."""
        m, d = self.model, self.data
        if self._payloads:
            self._take_loads()
        progress, remaining = self._advance()
        mujoco.mj_step1(m, d)
        self._load.apply(self.tick_count * TICK)
        mujoco.mj_fullM(m, d, self._mass)
        if self._payload.differs:
            self._payload.believe()
        sensed = self._sensed
        sensed.before, sensed.now, sensed.after = self._command
        sensed.is_overlaid = self._overlaid
        torque = self._control.torque(sensed) if self._brakes is None else self._brakes.torque(self._braked)
        if self._overlaid and self._action is not None:
            self._control.superpose(torque, self._action)
        np.minimum(torque, self._limit, out=torque)
        np.maximum(torque, self._least, out=torque)
        self._ctrl[:] = torque
        mujoco.mj_step2(m, d)
        self._tau_cmd = torque if self._brakes is None else np.zeros(7)
        # the sensors sit behind the gear: rotor inertia and gear friction are not in them
        self._tau = torque - self._armature * self._acc + self._passive
        self._load.measure(sensed.mass @ self._acc + sensed.bias - self._passive - torque)
        self.tick_count += 1
        self._write(self._run_id(), progress, remaining)

    def _advance(self) -> tuple[float, float]:
        """Shift the set-points and compute the next one; returns progress and remaining time."""
        command = self._command
        while self._cancels:
            self._cancel_now(*self._cancels.popleft())
        while self._aborts:
            order_id, text = self._aborts.popleft()
            if self._run is not None and order_id in (0, self._run_id()) and not self._run.failure:
                self._run.failure = text
                if not self._overlaid and not self._run.braking:
                    self._fail(self._run, text)
        while self._changes:
            order_id, mode = self._changes.popleft()
            if order_id == self._run_id():
                self._control.retune(mode)
        self._keep_pace()
        if self.lookout.is_busy or (self._run is not None and self._run.watches):
            self._look()
        run = self._run
        if run is None:
            run = None if self.safety.latched else self._next()
            if run is None and self._control.stiffen():
                self._stay()
            command = self._command
        command[0], command[1] = command[1], command[2]
        if run is None:
            return 0.0, nan
        if not run.started:
            run.started = True
            if run.plan.order.listener is not None:
                run.plan.order.listener.started()
        if self._control.violation:
            self._catch(run, self._control.violation)
        return self._follow(run)

    def _look(self) -> None:
        """Look at the conditions; one that breaks the running motion brakes it on its path."""
        run = self._run
        watches = () if run is None or run.braking or run.ended else run.watches
        elapsed = 0.0 if run is None else run.time
        breaks = self.lookout.look(
            self._q, self._load.torque, self._load.wrench, watches=watches, elapsed=elapsed
        )
        if breaks and run is not None and not run.cancelled and not run.failure:
            run.broken = True
            with self._lock:
                self._tail = None
            self._brake(run)

    def _keep_pace(self) -> None:
        """How fast time runs in this tick, by overrides, pauses, stops and the operation mode."""
        safety = self.safety
        held = self._paused or safety.latched
        goal = 0.0 if held else safety.manual * min(1.0, max(0.0, float(self.ring.reals[ring.OVERRIDE])))
        if safety.mode is Mode.T1 and self._run is not None:
            tcp = self._run.plan.order.tcp[:3]
            self._pace.advance(goal, self._command, halts=safety.latched, ceiling=REDUCED_SPEED, tcp=tcp)
        else:
            self._pace.advance(goal, self._command, halts=safety.latched)
        if safety.latched or self._brakes is not None:
            self._brake_or_open()

    def _brake_or_open(self) -> None:
        """Close the brakes when a stop has brought the arm to rest; open them when execution may go on."""
        if not self.safety.latched:
            self._brakes, self._halted = None, 0
            return
        self._halted = self._halted + 1 if self._stands else 0
        if self._brakes is not None or not self._halted:
            return
        if self._halted > BRAKE_TICKS or float(np.abs(self._dq).max()) < BRAKE_SPEED:
            here = self._q.copy()
            self._braked = replace(self._sensed, before=here, now=here, after=here, is_overlaid=False)
            self._brakes = PositionLaw()

    @property
    def _stands(self) -> bool:
        """Whether the set-points rest."""
        return bool((self._command[2] == self._command[1]).all())

    def _follow(self, run: _Run) -> tuple[float, float]:
        planned = run.plan
        if run.cancelled and not (run.ended or run.braking or self._overlaid):
            if self._pace.rests:
                run.ended = True
            elif not self.safety.latched:  # the stop is over before it was one
                self._brake_on_path(run)
        if run.ended:
            return self._settle(run)
        if run.follower is not None:
            return self._serve(run, run.follower)
        if self._action is not None and planned.order.kind == "hold" and not (run.cancelled or run.failure):
            self._overlaid = True
            self._command[2] = self._action.q
            return 0.0, nan
        if self._overlaid:
            self._overlaid = False
            self._halt(run)
        run.time += TICK if run.braking else TICK * self._pace.factor
        if run.path is None or run.profile is None:
            if run.cancelled or run.time >= planned.duration or planned.order.kind != "hold":
                run.ended = True
            return min(1.0, run.time / planned.duration), planned.duration - run.time
        s = run.profile.at(run.time)[0]
        if run.time >= run.profile.duration:
            run.ended = True
        s = min(max(s, 0.0), 1.0)
        while run.part < len(planned.marks) and s >= planned.marks[run.part]:
            run.part += 1
            if planned.order.part_listener is not None:
                planned.order.part_listener.reached(run.part)
        # at the very end take the planned joints: the path's samples may end a rounding error beside them
        if s == 1.0 and run.path is planned.path:
            self._command[2] = planned.end
        else:
            self._lead(run, s)
        return (nan if run.failure else planned.progress(s, run.part)), run.profile.duration - run.time

    def _lead(self, run: _Run, s: float) -> None:
        """Set the next set-point; one that no axis could follow ends the motion."""
        assert run.path is not None
        here = self._command[2]
        try:
            there = run.path.at(s, here)
        except Unreachable as error:
            self._fail(run, f"the path is not reachable: {error.text}")
            return
        self._go(run, there)

    def _go(self, run: _Run, there: Array) -> None:
        """Take a set-point unless an axis could not follow it."""
        leap = np.abs(there - self._command[2]) > self._leap
        if leap.any() and not run.failure:
            self._fail(run, f"Command Velocity violates limit A{int(leap.argmax()) + 1} (singularity)")
            return
        self._command[2] = there

    def _fail(self, run: _Run, text: str) -> None:
        """Brake every axis by itself, off the path: straight on from where the last set-points led."""
        run.failure = text
        self._halt(run)

    def _halt(self, run: _Run, *, jerk: float = 1.0) -> None:
        """Brake every axis by itself, straight on from where the last set-points led."""
        run.braking, run.ended, run.follower = True, False, None
        before, now, here = self._command
        step = here - (before if now is here else now)  # whether or not the set-points were shifted in this tick
        speed = np.clip(step / TICK, -self.robot.dq_max, self.robot.dq_max)
        run.path = JointLine(here.copy(), here + speed)
        full = float(np.abs(speed).max())
        if full < 1e-9:
            run.path, run.ended = None, True
            return
        limits = Limits(
            2.0, float(self.robot.ddq_max.min()) / full, jerk * float(self.robot.dddq_max.min()) / full
        )
        run.profile, run.time = brake((0.0, 1.0, 0.0), limits), 0.0

    def _settle(self, run: _Run) -> tuple[float, float]:
        if self._control.stays and not run.cancelled and not run.failure:
            return 1.0, 0.0
        run.settling += 1
        at_rest = not self._control.is_stiff or float(np.abs(self._q - self._command[2]).max()) <= SETTLED
        at_rest = at_rest and float(np.abs(self._dq).max()) <= SETTLED_SPEED
        if at_rest or run.settling >= SETTLE_TICKS:
            cause = "condition" if run.broken else "cancelled" if run.cancelled else "done"
            cause = "error" if run.failure else cause
            self._end(cause, run.failure)
        return (nan if run.cancelled or run.failure else 1.0), 0.0

    def _end(self, cause: str, text: str) -> None:
        run = self._run
        assert run is not None
        self._run = None
        self._closed(run.plan.order, cause, text)

    def _closed(self, order: Order, cause: str, text: str) -> None:
        with self._lock:
            self._open -= 1
        if order.listener is not None:
            order.listener.finished(cause, text)

    def _next(self) -> _Run | None:
        while self._inbox:
            serial, order, planned = self._inbox.popleft()
            if self._control.take(order):
                self._stay()
            here = self._command[2]
            if planned is None or float(np.abs(planned.start - here).max()) > 1e-9:
                try:
                    planned = plan(self.robot, order, here.copy())
                except PlanError as error:
                    self._closed(order, "error", str(error))
                    continue
                with self._lock:
                    if serial == self._serial:
                        self._tail = planned.end
            self._run = _Run(planned, serial)
            self._run.watches = self.lookout.begin(planned)
            if order.is_servo:
                self._run.follower = follower(self.robot, order, here)
            return self._run
        return None

    def _cancel_now(self, newest: int, order_id: int | None, fast: bool) -> None:
        """Carry out a cancellation; orders accepted after it are not concerned."""
        run = self._run
        if run is not None and run.serial <= newest and order_id in (None, run.plan.order.id):
            (self._brake_fast if fast else self._brake)(run)
        dropped: list[Order] = []
        with self._lock:
            for _ in range(len(self._inbox)):
                serial, order, _plan = self._inbox.popleft()
                if serial <= newest and order_id in (None, order.id):
                    dropped.append(order)
                else:
                    self._inbox.append((serial, order, None))
        for order in dropped:
            self._closed(order, "cancelled", "")

    def _brake(self, run: _Run) -> None:
        if run.cancelled or run.failure:
            return
        run.cancelled = True
        if not self.safety.latched:  # else the stop in force brings it to rest, sooner
            self._brake_on_path(run)

    def _brake_on_path(self, run: _Run) -> None:
        rate = self._pace.rate
        if run.follower is not None:
            run.follower.brake(scale=self._pace.scale, rate=rate)
            run.braking = True
            return
        if self._overlaid:
            return  # the next tick brakes from the overlay's speed
        if run.ended or run.profile is None or run.path is None:
            run.ended = run.ended or run.path is None
            return
        scale, halts = self._pace.scale, run.plan.halts
        if halts is not None:
            run.profile = halts.brake(run.time, scale, rate)
        else:
            s, velocity, acceleration = run.profile.at(run.time)
            state = (s, velocity * scale, acceleration * scale * scale + velocity * rate)
            run.profile = brake(state, run.plan.braking)
        run.time, run.braking = 0.0, True

    def _brake_fast(self, run: _Run) -> None:
        if run.failure or run.ended:
            self._brake(run)
            return
        run.cancelled = True
        if not self._overlaid:  # else the next tick brakes from the overlay's speed
            self._halt(run, jerk=FAST_JERK)

    # ------------------------------------------------------------------------------ servo motions and yielding

    def _serve(self, run: _Run, follower: Follower) -> tuple[float, float]:
        """Lead the set-point to the newest target."""
        target = self.ring.target()
        order = run.plan.order
        if target is not None and target.order == order.id and not run.cancelled:
            follower.aim(target.q, target.dq)
        there = follower.advance(TICK if run.braking else TICK * self._pace.factor)
        run.ended = follower.is_still if run.braking else follower.resting > order.goal_timeout
        beyond = (there > self._highest) | (there < self._lowest)
        if beyond.any():
            self._fail(run, f"Command Position violates limit A{int(beyond.argmax()) + 1}")
        else:
            self._go(run, there)
        return nan, follower.remaining

    def _stay(self) -> None:
        """The set-points of an arm that has yielded become what it has yielded to."""
        self._command = [self._q.copy() for _ in range(3)]

    def _catch(self, run: _Run, text: str) -> None:
        """A limit of the control mode is exceeded: become stiff and brake from the measured speed."""
        self._control.stiffen()
        way = self._dq * TICK
        self._command = [self._q - way, self._q.copy(), self._q.copy()]
        run.settling = 0
        self._fail(run, text)

    # ------------------------------------------------------------------------------ state

    def _run_id(self) -> int:
        return 0 if self._run is None else self._run.plan.order.id

    def _write(self, order: int, progress: float, remaining: float) -> None:
        k, r = self.tick_count, self.ring
        slot = k % ring.SLOTS
        words, reals = r.ints[slot], r.floats[slot]
        words[ring.SEQ] = 2 * k + 1
        words[ring.TIME] = k * TICK_NS
        q = self._q
        reals[2:9] = q
        reals[9:16] = self._command[2]
        reals[16:23] = self._dq
        reals[23:30] = self._tau
        reals[30:37] = self._load.torque
        reals[37:44] = self._tau_cmd
        values = q.tolist()
        (x, y, z), p = flange(self.robot, values)
        reals[44:47] = p
        reals[47:51] = _quaternion(x, y, z)
        reals[51:57] = self._load.wrench
        flags = self._safety_flags()
        words[ring.FLAGS] = flags | ring.MOVING if order else flags
        words[ring.MODE] = self.safety.mode
        words[ring.ORDER] = order
        reals[ring.PROGRESS] = progress
        reals[ring.REMAINING] = remaining
        reals[ring.E1], status = posture(self.robot, values)
        turn = sum((v < 0) << i for i, v in enumerate(values))
        words[ring.REDUNDANCY] = status | turn << 8
        words[ring.SEQ] = 2 * k + 2
        r.header[ring.NEWEST] = k
        wake = self.on_wake
        if wake is not None and k * TICK_NS >= r.header[ring.WAKE]:
            wake(k * TICK_NS)
        flags |= int(self.safety.mode) << 32  # a mode by itself is news, too
        if flags != self._flags:
            self._flags = flags
            if self.on_safety is not None:
                self.on_safety(flags, int(self.safety.mode))

    def _safety_flags(self) -> int:
        safety = self.safety
        flags = ring.MASTERED
        if self._brakes is None:
            flags |= ring.BRAKES_OPEN
        if self._paused or safety.latched:
            flags |= ring.PAUSED
        if safety.enabled:
            flags |= ring.ENABLED
        if not safety.halts:
            return flags | ring.READY
        flags |= ring.PROTECTIVE_STOP
        for demand in safety.demands:
            flags |= _DEMANDS[demand]
        return flags

    @property
    def snapshot(self) -> Snapshot:
        """The newest state, copied."""
        slot = self.ring.floats[self.tick_count % ring.SLOTS]
        return Snapshot(
            self.tick_count * TICK,
            self._q.copy(),
            self._command[2].copy(),
            self._dq.copy(),
            self._tau.copy(),
            self._load.torque.copy(),
            self._tau_cmd.copy(),
            self._load.wrench.copy(),
            self._run_id(),
            float(slot[ring.PROGRESS]),
        )


def _quaternion(x: tuple[float, ...], y: tuple[float, ...], z: tuple[float, ...]) -> tuple[float, ...]:
    """Quaternion x y z w of the columns of a rotation; the largest component leads."""
    xx, yy, zz = x[0], y[1], z[2]
    w = xx + yy + zz
    if w >= xx and w >= yy and w >= zz:
        q = (y[2] - z[1], z[0] - x[2], x[1] - y[0], 1.0 + w)
    elif xx >= yy and xx >= zz:
        q = (1.0 + xx - yy - zz, x[1] + y[0], x[2] + z[0], y[2] - z[1])
    elif yy >= zz:
        q = (x[1] + y[0], 1.0 + yy - xx - zz, y[2] + z[1], z[0] - x[2])
    else:
        q = (x[2] + z[0], y[2] + z[1], 1.0 + zz - xx - yy, x[1] - y[0])
    n = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) ** -0.5
    n = -n if q[3] < 0 else n
    return q[0] * n, q[1] * n, q[2] * n, q[3] * n
