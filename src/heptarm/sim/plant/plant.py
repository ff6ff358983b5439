"""The plant: a simulated LBR with its motion controller, advanced by one millisecond per tick."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import inf, nan

import mujoco
import numpy as np

from heptarm._library import Unavailable
from heptarm.model.inverse_kinematics import status_of
from heptarm.model.kinematics import flange
from heptarm.planning.motion import TICK
from heptarm.planning.seam import SLOTS, TICK_NS, HeaderWords, SafetyFlags, StateWords
from heptarm.sim.control_laws.active_law import ActiveLaw
from heptarm.sim.control_laws.laws import MeasuredState, PositionLaw, Superposition
from heptarm.sim.controller.interpolator import Interpolator
from heptarm.sim.controller.safety import SafetyController, StopRequest
from heptarm.sim.plant.carried import CarriedShapes, FlangeShapes
from heptarm.sim.plant.drive_monitor import LAG, DriveMonitor
from heptarm.sim.plant.external_load import ExternalLoad
from heptarm.sim.plant.gripper import SimulatedGripper, has_gripper
from heptarm.sim.plant.io_image import IoImage
from heptarm.sim.plant.native import DONE, ELSEWHERE, LOADED, NativeTick
from heptarm.sim.plant.payload import PayloadModel
from heptarm.sim.plant.safety_monitor import UNLIMITED, ExternalTorqueMonitor, SafetyLimits
from heptarm.sim.plant.scene import Scene, find_body, is_mounted
from heptarm.sim.plant.sensor_errors import SensorErrors
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.plant.world import Box, compiled
from heptarm.values.checks import Array
from heptarm.values.mode.mode import Mode as ControlMode
from heptarm.values.robot import Body, RobotModel, robot

log = logging.getLogger("heptarm.sim")

#: After a stop on the path the brakes close when no axis is faster than this [rad/s], or after this many ticks.
BRAKE_SPEED = 0.02
BRAKE_TICKS = 400
#: A brake that cannot hold its axis slips as far behind it [rad]; no drive trips at once when the brakes open.
BRAKE_SLIP = 0.8 * LAG

#: Flags as plain integers: an operation on two flags of an enumeration takes a microsecond.
_MOVING, _BRAKES_OPEN = int(SafetyFlags.MOVING), int(SafetyFlags.BRAKES_OPEN)
_PAUSED = int(SafetyFlags.PAUSED)

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
        order: id of the running command, 0 if none.
        progress: of the running command, 0 to 1.
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


#: Place of the override among the words of the shared memory.
_OVERRIDE = HeaderWords.SECTION.start + HeaderWords.OVERRIDE


class _Inputs:
    """What the controller reads from the shared state; see `ControllerInputs`."""

    def __init__(self, shared: SharedState) -> None:
        self.signals, self.target = shared.signals, shared.target
        self._reals = memoryview(shared.memory).cast("d")  # numpy takes longer for a single number

    @property
    def override(self) -> float:
        """Factor on every programmed speed, 0 to 1."""
        value: float = self._reals[_OVERRIDE]
        return value


class Plant:
    """A simulated robot.

    Args:
        model: "iiwa7", "iiwa14", "med7" or "med14".
        q: joint positions at the start, shape (7,) [rad].
        boxes: fixed boxes around it.
        scene: what else is around it and on its flange; None: nothing.
        monitored: whether drives trip; see `heptarm.sim.plant.drive_monitor`.
        errors: of the sensors, and friction of the joints; None: ideal ones.
        limits: of safety functions that depend on the load; see `heptarm.sim.plant.safety_monitor`.

    Attributes:
        submit: plans a command and queues it; see `heptarm.sim.controller.queue.MotionQueue.submit`.
    """

    def __init__(
        self,
        model: str = "iiwa14",
        *,
        q: tuple[float, ...] = HOME,
        boxes: Sequence[Box] = (),
        scene: Scene | None = None,
        monitored: bool = True,
        errors: SensorErrors | None = None,
        limits: SafetyLimits = UNLIMITED,
    ) -> None:
        self.robot: RobotModel = robot(model)
        self._errors = errors
        self.model = compiled(model, boxes, scene, room=True)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:7] = q
        mujoco.mj_forward(self.model, self.data)
        self.shared = SharedState()
        self.tick_count = 0
        self.on_wake: Callable[[int], None] | None = None
        self._views()
        self._load = ExternalLoad(self.model, self.data)
        bare = compiled(model) if is_mounted(self.model) else None
        self._limits = limits
        self._safety_monitor: ExternalTorqueMonitor | None = None
        if limits.torque < inf:
            self._safety_monitor = ExternalTorqueMonitor(copy(self.model if bare is None else bare), limits)
        self._payload = PayloadModel(self.model, self.data, self._mass, bare)
        self._mounted = FlangeShapes(self.model)
        self._changes: deque[Callable[[], None]] = deque()  # of what is carried; made before the next tick
        self._control = ActiveLaw(self.robot, self.model, self.data)
        self.signals = IoImage(self.shared.signals)
        self._gripper: SimulatedGripper | None = None
        if scene is not None and has_gripper(self.model):
            self._gripper = SimulatedGripper(self.model, self.data, self.signals, scene.wiring)
        self._sensed = MeasuredState(
            self._q, self._dq, self._mass[:7, :7], self._bias, self._passive, self._q, self._q, self._q
        )
        self.safety = SafetyController()
        self.on_safety: Callable[[int, int], None] | None = None  # called with changed flags and mode
        # safety flags, and the operation mode above them: as reported, and of the newest state
        self._flags = self._seen = 0
        # whether the next ticks need no more than the table of the running motion, while the safety flags are these
        self._is_foreseen, self._shown = False, 0
        self._brakes: PositionLaw | None = None  # closed
        self._braked = self._sensed
        self._halted = 0  # ticks for which a stop on the path has been in force
        self._monitor = DriveMonitor(self.robot) if monitored else None
        self._native = self._in_c()
        self._tripped = False  # by a drive's own supervision
        self.interpolator = Interpolator(
            self.robot, _Inputs(self.shared), self._sensed, self._load, self._control, self.safety
        )
        self.condition_monitor = self.interpolator.condition_monitor
        self.submit = self.interpolator.queue.submit
        self._take_loads()
        self.tick_count = -1
        self._write(0.0, nan)
        self._publish()

    def _views(self) -> None:
        d = self.data
        self._q, self._dq, self._acc = d.qpos[:7], d.qvel[:7], d.qacc[:7]
        self._bias, self._passive = d.qfrc_bias[:7], d.qfrc_passive[:7]
        self._ctrl = d.ctrl[:7]
        self._armature = self.model.dof_armature[:7].copy()
        self._limit, self._least = self.robot.tau_max, -self.robot.tau_max
        self._mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, d, self._mass)
        self._measured = (
            self._q if self._errors is None else self._q.copy()
        )  # positions that the sensors show
        self._torque, self._tau, self._tau_cmd = np.zeros(7), np.zeros(7), np.zeros(7)

    def _in_c(self) -> NativeTick | None:
        """The arithmetic of a tick in C; None: where it is not available."""
        d, monitor = self.data, self._monitor
        try:
            return NativeTick(
                self.robot,
                self.model,
                d,
                self.shared,
                ranges=None if monitor is None else monitor.scales,
                q=self._q,
                dq=self._dq,
                acceleration=self._acc,
                passive=self._passive,
                applied=d.qfrc_applied[:7],
                constraint=d.qfrc_constraint[:7],
                pulled=d.xfrc_applied,
                actuators=self._ctrl,
                armature=self._armature,
                shown=self._measured,
                torque=self._torque,
                tau_cmd=self._tau_cmd,
                tau=self._tau,
                load=self._load.torque,
                wrench=self._load.wrench,
            )
        except Unavailable:
            return None

    @property
    def time_ns(self) -> int:
        """Plant time [ns]."""
        return self.tick_count * TICK_NS

    @property
    def override(self) -> float:
        """Factor on every programmed speed, 0 to 1; Java writes it directly into the shared state."""
        return float(self.shared.reals[HeaderWords.OVERRIDE])

    @override.setter
    def override(self, value: float) -> None:
        self.shared.reals[HeaderWords.OVERRIDE] = value

    @property
    def idle(self) -> bool:
        """Whether no command is running or waiting."""
        return self.interpolator.queue.idle

    def cancel(self, order_id: int | None = None) -> None:
        """Cancel a command (None: all): the running one brakes on its path, waiting ones are dropped."""
        self.interpolator.queue.cancel(order_id, fast=False)

    def stop(self) -> None:
        """Cancel all commands."""
        self.cancel(None)

    def stop_fast(self) -> None:
        """Cancel all commands; every axis brakes with its full deceleration, so the arm leaves the path."""
        self.interpolator.queue.cancel(None, fast=True)

    def pause(self) -> None:
        """Come to rest on the path, keeping all commands."""
        self.interpolator.is_paused = True

    def resume(self) -> None:
        """Continue after a pause, or after a stop that is not requested any more."""
        self.interpolator.is_paused = False
        self.safety.resume()

    def acknowledge(self) -> None:
        """Acknowledge errors whose cause is gone."""
        self.safety.withdraw(StopRequest.DRIVE_ERROR)

    def trip(self, text: str) -> None:
        """Drive error: the running command fails, every axis brakes by itself, and the drives stay off."""
        self.safety.request_stop(StopRequest.DRIVE_ERROR)
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

    def set_load_data(self, load: Body) -> None:
        """Declare the load data of the controller; also the true payload, unless `set_payload` sets another one."""
        self._changes.append(lambda: self._payload.declare(load))

    def set_safety_load(self, load: Body, *, workpiece: float) -> None:
        """Set the load that the safety functions count: tools and the safety workpiece.

        Args:
            load: in the flange frame.
            workpiece: mass of the safety workpiece [kg]; 0: there is none.

        Raises:
            ValueError: the safety configuration allows no workpiece as heavy as that.
        """
        most = self._limits.workpiece
        if workpiece > most:
            raise ValueError(
                f"the safety workpiece has {workpiece:g} kg, the safety configuration allows {most:g} kg"
            )
        monitor = self._safety_monitor
        if monitor is not None:
            self._changes.append(lambda: monitor.count(load))

    def set_payload(self, load: Body) -> None:
        """Set the true payload on the flange; declared load data do not change it any more."""
        self._changes.append(lambda: self._payload.set_true(load))

    def carry(self, bodies: Sequence[CarriedShapes]) -> None:
        """Mount the shapes of tool and workpiece on the flange, in place of those before; they collide.

        Where the scene has a tool on the flange, it stays there alone.
        """
        self._changes.append(lambda: self._mounted.mount(bodies))

    def _take_loads(self) -> None:
        payload, sensed = self._payload, self._sensed
        while self._changes:
            self._changes.popleft()()
        sensed.mass, sensed.bias, self._load.is_misjudged = payload.mass, payload.bias, payload.differs
        self._is_ideal = self._errors is None and self._safety_monitor is None and not payload.differs
        if self._native is not None:
            self._native.believe(payload.mass, payload.bias, is_misjudged=payload.differs)

    def change_mode(self, order_id: int, mode: ControlMode) -> None:
        """Change the parameters of the running command's control mode; does nothing for another command or mode."""
        self.interpolator.change_mode(order_id, mode)

    def abort(self, order_id: int, text: str) -> None:
        """End a running command (0: whichever runs) by an error; every axis brakes by itself."""
        self.interpolator.abort(order_id, text)

    @property
    def interpolated(self) -> Array:
        """Set-point of the next tick without an overlay, shape (7,) [rad]; of a hold: its start."""
        return self.interpolator.interpolated

    def body_pose(self, name: str) -> Array:
        """Pose of a body of the scene in the base: x y z [m] and quaternion x y z w, shape (7,).

        Raises:
            ValueError: the scene has no such body.
        """
        index = find_body(self.model, name)
        return np.concatenate([self.data.xpos[index], np.roll(self.data.xquat[index], -1)])

    def overlay(self, action: Superposition | None) -> None:
        """Overlay the running hold in the next tick; None after an overlay: brake, and end the hold."""
        self.interpolator.action = action

    def step(self, ticks: int = 1) -> None:
        """Run a number of ticks."""
        while ticks > 0:
            ticks -= self.tick(ticks)

    def tick(self, most: int = 1) -> int:
        """Advance by one millisecond: set-point, control law, dynamics, state.

        Args:
            most: so many ticks at once where they need no more than the table of the running motion, and nobody waits
                for a state before the last one.

        Returns:
            How many ticks they were.
        """
        if self._is_foreseen and self._is_undisturbed:
            done = self._follow(most)
            if done:
                return done
        self._compute()
        self._publish()
        self._foresee()
        return 1

    @property
    def _is_undisturbed(self) -> bool:
        """Whether nothing has happened since the last tick that the next one has to look at."""
        return not (
            self._changes
            or self._load.is_pushed
            or self.safety.flags != self._shown
            or self.interpolator.is_disturbed
        )

    def _foresee(self) -> None:
        """Find out whether the next ticks need no more than the running motion's table, unless something happens."""
        native, interpolator = self._native, self.interpolator
        self._is_foreseen = (
            native is not None and self._gripper is None and interpolator.is_foreseen and self._is_plain
        )
        if native is None or not self._is_foreseen:
            return
        run, self._shown = interpolator.run, self.safety.flags
        assert run is not None and run.table is not None
        part = (*run.plan.measured(run.part), run.plan.end_of(run.part))
        native.prepare(interpolator.command, run.table, time=run.time, step=interpolator.step, part=part)

    def _follow(self, most: int) -> int:
        """Compute at most so many ticks by the table of the running motion; returns how many."""
        native, interpolator = self._native, self.interpolator
        assert native is not None
        done = native.follow(self.tick_count + 1, most)
        left = DONE if done == most else native.left
        if not done and left == DONE:
            return 0
        interpolator.passed = native
        self.tick_count += done
        if left == DONE:
            if native.is_awaited and self.on_wake is not None:
                self.on_wake(self.tick_count * TICK_NS)
            return done
        interpolator.catch_up()
        run = interpolator.run
        assert run is not None
        self._complete(left, run.plan.progress(run.place, run.part), run.plan.duration - run.time)
        self._publish()
        self._foresee()
        return done + 1

    def _compute(self) -> None:
        """Compute the next tick: set-point, control law, dynamics."""
        if self._changes:
            self._take_loads()
        progress, remaining = self._advance()
        if self._gripper is not None:
            self._gripper.tick()
        native, left = self._native, ELSEWHERE
        if native is not None and self._is_plain:
            words, times = self._words(), (progress, remaining)
            left = native.tick(self.tick_count + 1, self.interpolator.command, words=words, times=times)
        self._complete(left, progress, remaining)

    def _complete(self, left: int, progress: float, remaining: float) -> None:
        """Do what is left of a tick; see `NativeTick.tick`."""
        if left == DONE:
            return
        if left == ELSEWHERE:
            self._simulate()
        elif left == LOADED:
            self._load.resolve(is_loaded=True)
        if self._monitor is not None and not self._tripped:
            self._supervise(self._monitor)
        self._write(progress, remaining)

    @property
    def _is_plain(self) -> bool:
        """Whether `NativeTick.tick` may compute the next tick: position control, and nothing special."""
        return (
            self._is_ideal
            and self._control.is_plain
            and self._brakes is None
            and not (self.interpolator.is_overlaid or self._load.is_pushed)
            and (self._monitor is None or not self._monitor.is_strained)
        )

    def _simulate(self) -> None:
        """Control law, dynamics, and what the sensors show."""
        m, d = self.model, self.data
        mujoco.mj_step1(m, d)
        self._load.apply(self.tick_count * TICK)
        mujoco.mj_fullM(m, d, self._mass)
        if self._payload.differs:
            self._payload.believe()
        watched = self._safety_monitor if self.interpolator.order and not self.safety.latched else None
        if watched is not None:
            watched.follow(d)
        self._drive()
        mujoco.mj_step2(m, d)
        self._sense()
        if watched is not None:
            self._watch(watched)

    def _publish(self) -> None:
        """Give readers the computed state, and wake those that wait for it: they read it when it is due."""
        self.tick_count = k = self.tick_count + 1
        if self._native is not None:
            is_awaited = self._native.publish(k)
        else:
            header = self.shared.header
            self.shared.ints[k % SLOTS, StateWords.SEQ] = 2 * k + 2
            header[HeaderWords.NEWEST] = k
            is_awaited = k * TICK_NS >= header[HeaderWords.WAKE]
        if is_awaited and self.on_wake is not None:
            self.on_wake(k * TICK_NS)
        if self._seen != self._flags:
            self._flags = self._seen
            if self.on_safety is not None:
                self.on_safety(self._flags, self._flags >> 32)

    def _drive(self) -> None:
        """The control law in force: torques of the motors."""
        interpolator, native = self.interpolator, self._native
        command = interpolator.command
        if (
            native is not None
            and self._control.is_plain
            and self._brakes is None
            and not interpolator.is_overlaid
        ):
            native.command(command.before, command.now, command.after)
        else:
            sensed = self._sensed
            sensed.before, sensed.now, sensed.after = command
            sensed.is_overlaid = interpolator.is_overlaid
            torque = (
                self._control.torque(sensed) if self._brakes is None else self._brakes.torque(self._braked)
            )
            if interpolator.is_overlaid and interpolator.action is not None:
                self._control.superpose(torque, interpolator.action)
            np.minimum(torque, self._limit, out=torque)
            np.maximum(torque, self._least, out=self._torque)
            self._tau_cmd[:] = self._torque if self._brakes is None else 0.0
            self._ctrl[:] = self._torque
        if self._errors is not None:
            self._torque -= self._errors.friction(self._dq)
            self._ctrl[:] = self._torque

    def _sense(self) -> None:
        """What the sensors show after the dynamics, and the external load."""
        load, sensed = self._load, self._sensed
        if self._native is not None:
            is_loaded = self._native.sense()
        else:
            # the torque sensors are on the link side of the gear: they do not measure rotor inertia and gear friction
            self._tau[:] = self._torque - self._armature * self._acc + self._passive
            load.measure(sensed.mass @ self._acc + sensed.bias - self._passive - self._torque)
            is_loaded = bool(load.torque.any())
        if self._errors is not None:
            reading = self._errors.read(self._q, self._tau)
            self._measured[:], self._tau[:] = reading.q, reading.tau
            load.torque -= reading.tau_error
            is_loaded = True
        load.resolve(is_loaded=is_loaded)

    def _advance(self) -> tuple[float, float]:
        """Compute the next set-point; returns progress and remaining time."""
        if self.safety.latched or self._brakes is not None:
            self._brake_or_open()
        return self.interpolator.advance()

    def _supervise(self, monitor: DriveMonitor) -> None:
        """Let a drive trip: its brakes close at once, wherever the arm is."""
        is_stiff = self._brakes is None and self._control.is_stiff
        native = self._native
        if (
            native is not None
            and not monitor.is_strained
            and not native.strained(self.interpolator.command.after, is_stiff=is_stiff)
        ):
            return
        lag = self.interpolator.command.after - self._q if is_stiff else None
        reason = monitor.check(self._dq, self._q, self._tau, lag)
        if reason:
            self._tripped = True
            self.safety.request_stop(StopRequest.DRIVE_ERROR)
            self.interpolator.trip(reason)
            self._close_brakes()
            log.warning("%s", reason)

    def _watch(self, monitor: ExternalTorqueMonitor) -> None:
        """Let a safety function stop the arm on its path."""
        reason = monitor.check(self._load.torque, self._sensed.mass, self._sensed.bias, self._acc)
        if reason:
            self.safety.request_stop(StopRequest.PROTECTIVE_STOP)
            log.warning("%s", reason)

    def _brake_or_open(self) -> None:
        """Close the brakes when a stop has brought the arm to rest; open them when execution may continue."""
        if not self.safety.latched:
            if self._tripped and self._brakes is not None:  # the arm is where the brakes have stopped it
                self._control.take_over(self._brakes.released(self._braked))
                self.interpolator.command.stay(self._q)
            if self._tripped and self._monitor is not None:
                self._monitor.acknowledge(self._q)
            self._brakes, self._halted, self._tripped = None, 0, False
            return
        if self._tripped:
            here = self._braked.now
            np.clip(here, self._q - BRAKE_SLIP, self._q + BRAKE_SLIP, out=here)
        self._halted = self._halted + 1 if self.interpolator.rests else 0
        if self._brakes is not None or not self._halted:
            return
        if self._halted > BRAKE_TICKS or float(np.abs(self._dq).max()) < BRAKE_SPEED:
            self._close_brakes()

    def _close_brakes(self) -> None:
        here = self._q.copy()
        self._braked = replace(self._sensed, before=here, now=here, after=here, is_overlaid=False)
        self._brakes = PositionLaw.locked(self._tau_cmd, self._braked)

    def _write(self, progress: float, remaining: float) -> None:
        """Write the state after the next tick into its slot; readers see it after `_publish`."""
        k, shared, after = self.tick_count + 1, self.shared, self.interpolator.command.after
        given = self._words()
        if self._native is not None:
            self._native.write(k, after, words=given, times=(progress, remaining))
            return
        words, reals = shared.ints[k % SLOTS], shared.floats[k % SLOTS]
        words[StateWords.SEQ] = 2 * k + 1
        words[StateWords.TIME] = k * TICK_NS
        q = self._measured
        reals[StateWords.Q] = q
        reals[StateWords.Q_CMD] = after
        reals[StateWords.DQ] = self._dq
        reals[StateWords.TAU] = self._tau
        reals[StateWords.TAU_EXT] = self._load.torque
        reals[StateWords.TAU_CMD] = self._tau_cmd
        values = q.tolist()
        (x, y, z), p = flange(self.robot, values)
        reals[StateWords.POSE] = (*p, *_quaternion(x, y, z))
        reals[StateWords.WRENCH] = self._load.wrench
        words[StateWords.FLAGS], words[StateWords.MODE], words[StateWords.ORDER] = given
        reals[StateWords.PROGRESS], reals[StateWords.REMAINING] = progress, remaining
        reals[StateWords.E1], words[StateWords.STATUS] = values[2], status_of(self.robot, values)
        words[StateWords.TURN] = sum((v < 0) << i for i, v in enumerate(values))

    def _words(self) -> tuple[int, int, int]:
        """Flags, operation mode and running command of the next tick."""
        safety, order = self.safety, self.interpolator.order
        flags, mode = safety.flags, safety.mode
        if self._brakes is None:
            flags |= _BRAKES_OPEN
        if self.interpolator.is_paused or safety.latched:
            flags |= _PAUSED
        self._seen = flags | mode << 32  # a change of the mode alone is reported, too
        return (flags | _MOVING if order else flags), mode, order

    @property
    def snapshot(self) -> Snapshot:
        """The newest state, copied."""
        slot = self.shared.floats[self.tick_count % SLOTS]
        return Snapshot(
            self.tick_count * TICK,
            self._measured.copy(),
            self.interpolator.command.after.copy(),
            self._dq.copy(),
            self._tau.copy(),
            self._load.torque.copy(),
            self._tau_cmd.copy(),
            self._load.wrench.copy(),
            self.interpolator.order,
            float(slot[StateWords.PROGRESS]),
        )


def _quaternion(x: tuple[float, ...], y: tuple[float, ...], z: tuple[float, ...]) -> tuple[float, ...]:
    """Quaternion x y z w of the columns of a rotation, computed from its largest component."""
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
