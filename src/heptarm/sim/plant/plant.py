"""The plant: a simulated LBR with its motion controller, advanced by one millisecond per tick.

Theory of operation
-------------------

**A tick** computes the state k + 1 from the state k, in the order of a real controller's cycle:

1. changes of the load on the flange are taken (`FlangeLoad`), and the interpolator advances: cancellations,
   conditions and stops first, then the set-point of the next tick;
2. `Drives` computes the torques of the motors: the control law in force, or the brakes; MuJoCo integrates
   between `mj_step1` and `mj_step2`, since a law needs the inertia matrix of the posture that it acts on;
3. the sensors are read, and the external load and its wrench at the flange are derived from them as a
   controller would: what it does not know (an undeclared payload, say) shows as an external load;
4. each drive supervises itself and may trip, whatever the controller commands;
5. the state is written into its slot of the shared memory and published. `time` of tick k is k ms: the plant
   has no other clock, so it may run at any pace.

**Three forms of a tick**, from the general to the fast one; tests hold them together, bit by bit or
nearly:

* *In parts* (`_simulate`): impedance laws, brakes, pushes, noisy sensors, overlays of FRI clients.
* *At once* (`NativeTick.tick`): `_is_plain`, so position control of an arm that nothing disturbs. C does
  steps 2 to 5. If it finds a load or a strained drive on the way, it leaves the rest to Python: see `LOADED`,
  `STRAINED`.
* *Many at once* (`NativeTick.follow`): `_foreseen`, so that the table of the running joint motion alone
  decides about the set-points. C does step 1, too, until the table or a part of the motion ends, somebody
  waits for a state, or a tick is no longer plain. The interpolator learns of it when it is next asked for
  anything (`Interpolator.catch_up`).

What makes the fast forms safe is one test before each call, `_is_undisturbed`: whatever any thread may have
done in between is a flag that this property reads. A new way to disturb the arm has to appear there, or in
`_is_plain`.

**States.** The arm is *in motion* or *at rest* under a control law; a stop (`safety.latched`) brings it to
rest on the path, and then the *brakes close*; they open when the stop is withdrawn and somebody resumes. A
drive that *trips* closes the brakes where the arm is, moving or not; position control takes over from there
without a step. `Drives` has these states; `SafetyController` decides about stops; the interpolator knows
neither.

**Threads.** One thread calls `tick`. Any thread may call the verbs (`submit`, `cancel`, `pause`,
`set_load_data`, ...): they append to a queue or set a flag, which the next tick takes; none waits.
`snapshot`, `interpolated` and `body_pose` are for the thread of the ticks. Everybody else reads the state
from the shared memory, where a sequence number marks a torn one, so that no reader can delay a tick.
`on_wake` and `on_safety` are called by the thread of the ticks, and must not block.

**Memory.** `ArmVectors` names the vectors of the arm once. MuJoCo, the tick in C and the parts all use these
arrays; none of them is ever replaced, only written to, since C keeps their addresses.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, nan
from pathlib import Path

import mujoco
import numpy as np

from heptarm.errors import CommandRejected, LimitError
from heptarm.model.dynamics import ROTOR
from heptarm.planning.motion import TICK
from heptarm.planning.seam import SLOTS, TICK_NS, HeaderWords, SafetyFlags, StateWords
from heptarm.sim.control_laws.active_law import ActiveLaw
from heptarm.sim.control_laws.laws import (
    GAINS,
    STIFFNESS,
    STIFFNESS_DAMPING,
    MeasuredState,
    Superposition,
    position_gains,
)
from heptarm.sim.controller.interpolator import Interpolator
from heptarm.sim.controller.safety import SafetyController, StopRequest
from heptarm.sim.plant.arm_vectors import ArmVectors
from heptarm.sim.plant.carried import CarriedShapes
from heptarm.sim.plant.drive_monitor import DriveMonitor
from heptarm.sim.plant.drives import Drives
from heptarm.sim.plant.external_load import ExternalLoad
from heptarm.sim.plant.flange_load import FlangeLoad
from heptarm.sim.plant.free_bodies import FreeBodies
from heptarm.sim.plant.gripper import SimulatedGripper, has_gripper
from heptarm.sim.plant.io_image import IoImage
from heptarm.sim.plant.native import DONE, ELSEWHERE, LOADED, NativeTick
from heptarm.sim.plant.safety_monitor import UNLIMITED, ExternalTorqueMonitor, SafetyLimits
from heptarm.sim.plant.scene import Scene, find_body, is_mounted
from heptarm.sim.plant.sensor_errors import SensorErrors
from heptarm.sim.plant.shared_state import SharedState
from heptarm.sim.plant.world import Box, compiled
from heptarm.values.checks import Array
from heptarm.values.fitted_arm import FittedArm, load_fitted
from heptarm.values.mode.mode import Mode as ControlMode
from heptarm.values.robot import Body, RobotModel, robot

log = logging.getLogger("heptarm.sim")

#: Flags as plain integers: an operation on two flags of an enumeration takes a microsecond.
_MOVING, _BRAKES_OPEN = int(SafetyFlags.MOVING), int(SafetyFlags.BRAKES_OPEN)
_PAUSED = int(SafetyFlags.PAUSED)

#: Stiffness by inertia up to which the damping of position control is stable in ticks [1/s²].
_STIFFEST = 1.2 / (STIFFNESS_DAMPING * TICK)

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


def fitted_gains(fitted: FittedArm) -> Array:
    """Gains of position control of a fitted arm, see `position_gains`.

    Raises:
        LimitError: it is too stiff to be simulated with its rotors.
    """
    stiffness, rotor = fitted.value("stiffness", STIFFNESS), fitted.value("rotor", ROTOR)
    most = _STIFFEST * rotor
    for axis in range(7):
        if stiffness[axis] > most[axis]:
            raise LimitError(
                f"stiffness of A{axis + 1} must be in (0, {most[axis]:.0f}] Nm/rad with a rotor of "
                f"{rotor[axis]:g} kg m², got {stiffness[axis]:.0f} Nm/rad",
                code=2,
                parameter="fitted",
                value=float(stiffness[axis]),
                hint="the simulator's tick of 1 ms is too long for a stiffer one: fit both, or leave one out",
            )
    return position_gains(stiffness)


def fitted_arm(file: Path | None, model: RobotModel) -> FittedArm | None:
    """The measured arm that is simulated; None: no file is given.

    Raises:
        CommandRejected: the file cannot be read, or is of another robot.
        LimitError: a number outside its range, or an arm that is too stiff to be simulated.
    """
    if file is None:
        return None
    found = load_fitted(file)
    if found.model.base_name != model.base_name:
        raise CommandRejected(
            f"{file} is of the robot {found.robot}, and the simulated one is {model.name}",
            parameter="fitted",
            value=str(file),
            hint=f"simulate its model: sim://{found.model.base_name}?fitted={file}",
        )
    fitted_gains(found)
    return found


def _fit(model: mujoco.MjModel, fitted: FittedArm) -> None:
    """Give a world the rotors and the damping of a fitted arm."""
    model.dof_armature[:7] = fitted.value("rotor", model.dof_armature[:7])
    if "viscous" in fitted:
        model.dof_damping[:7] = 0.0  # all of it is in the friction of the joints


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
        fitted: a measured arm: its stiffness, rotors, load and delay of FRI commands are this one's. Its sensors and
            friction are `errors`.

    Raises:
        LimitError: the fitted arm is too stiff to be simulated with its rotors.

    Attributes:
        bodies: the free bodies of the scene, which can be placed.
        fri_command_delay: of FRI clients' commands, beyond their interpolation [ticks].
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
        fitted: FittedArm | None = None,
    ) -> None:
        self.robot: RobotModel = robot(model)
        self.model = compiled(model, boxes, scene, room=True)
        gains, self.fri_command_delay = GAINS, 0
        if fitted is not None:
            self.fri_command_delay = round(float(fitted.value("fri_command_delay", 0.0)[0]) / TICK)
            gains = fitted_gains(fitted)
            _fit(self.model, fitted)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:7] = q
        mujoco.mj_forward(self.model, self.data)
        self.shared, self.tick_count = SharedState(), 0
        self.on_wake: Callable[[int], None] | None = None
        self.on_safety: Callable[[int, int], None] | None = None
        # safety flags, and the operation mode above them: as reported, and of the newest state
        self._reported = self._newest = 0
        self.signals, self.safety = IoImage(self.shared.signals), SafetyController()
        self._errors = errors
        self._arm = arm = ArmVectors.of(self.model, self.data, has_errors=errors is not None)
        self._load = ExternalLoad(self.model, self.data, arm)
        bare = compiled(model) if is_mounted(self.model) else None
        self._carried = FlangeLoad(self.model, self.data, arm.mass, bare=bare, limits=limits)
        self.bodies = FreeBodies(self.model, self.data)
        self._gripper: SimulatedGripper | None = None
        if scene is not None and has_gripper(self.model):
            self._gripper = SimulatedGripper(self.model, self.data, self.signals, scene.wiring)
        monitor = DriveMonitor(self.robot) if monitored else None
        ranges = None if monitor is None else monitor.scales
        self._native = NativeTick(
            self.robot, self.model, self.data, self.shared, arm, gains=gains, ranges=ranges
        )
        self._sensed = MeasuredState(
            arm.q, arm.dq, arm.mass[:7, :7], arm.bias, arm.passive, arm.q, arm.q, arm.q
        )
        law = ActiveLaw(self.robot, self.model, self.data, gains=gains)
        self._drives = Drives(
            arm, self._native, self._sensed, law, gains=gains, monitor=monitor, errors=errors
        )
        self.interpolator = Interpolator(
            self.robot, _Inputs(self.shared), self._sensed, self._load, law, self.safety
        )
        self.condition_monitor = self.interpolator.condition_monitor
        self.submit = self.interpolator.queue.submit
        self._foreseen: int | None = None
        if fitted is not None and fitted.load is not None:
            self._carried.set_true(fitted.load)
        self._take_loads()
        self.tick_count = -1
        self._write(0.0, nan)
        self._publish()

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
        self._carried.declare(load)

    def set_safety_load(self, load: Body, *, workpiece: float) -> None:
        """Set the load that the safety functions count: tools and the safety workpiece.

        Args:
            load: in the flange frame.
            workpiece: mass of the safety workpiece [kg]; 0: there is none.

        Raises:
            ValueError: the safety configuration allows no workpiece as heavy as that.
        """
        self._carried.count(load, workpiece=workpiece)

    def set_payload(self, load: Body) -> None:
        """Set the true payload on the flange; declared load data do not change it any more."""
        self._carried.set_true(load)

    def carry(self, bodies: Sequence[CarriedShapes]) -> None:
        """Mount the shapes of tool and workpiece on the flange, in place of those before; they collide.

        Where the scene has a tool on the flange, it stays there alone.
        """
        self._carried.mount(bodies)

    def _take_loads(self) -> None:
        carried, sensed = self._carried, self._sensed
        carried.take()
        known = carried.model
        sensed.mass, sensed.bias = known.mass, known.bias
        self._native.believe(known.mass, known.bias, is_misjudged=known.differs)

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
        """Overlay the running motion in the next tick; None after an overlay: brake, and end the motion."""
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
        if self._foreseen is not None and self._is_undisturbed:
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
            self._carried.has_changed
            or self.bodies.has_changed
            or self._load.is_pushed
            or self.safety.flags != self._foreseen
            or self.interpolator.is_disturbed
        )

    def _foresee(self) -> None:
        """Find out whether the next ticks need no more than the running motion's table, unless something happens."""
        interpolator = self.interpolator
        if self._gripper is not None or not interpolator.is_foreseen or not self._is_plain:
            self._foreseen = None
            return
        run, self._foreseen = interpolator.run, self.safety.flags
        assert run is not None and run.table is not None
        part = (*run.plan.measured(run.part), run.plan.end_of(run.part))
        self._native.prepare(
            interpolator.command, run.table, time=run.time, step=interpolator.step, part=part
        )

    def _follow(self, most: int) -> int:
        """Compute at most so many ticks by the table of the running motion; returns how many."""
        native, interpolator = self._native, self.interpolator
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
        if self._carried.has_changed:
            self._take_loads()
        self.bodies.take()
        progress, remaining = self._advance()
        if self._gripper is not None:
            self._gripper.tick()
        left = ELSEWHERE
        if self._is_plain:
            words, times = self._words(), (progress, remaining)
            left = self._native.tick(self.tick_count + 1, self.interpolator.command, words=words, times=times)
        self._complete(left, progress, remaining)

    def _complete(self, left: int, progress: float, remaining: float) -> None:
        """Do what is left of a tick; see `NativeTick.tick`."""
        if left == DONE:
            return
        if left == ELSEWHERE:
            self._simulate()
        elif left == LOADED:
            self._load.resolve(is_loaded=True)
        self._supervise()
        self._write(progress, remaining)

    @property
    def _is_plain(self) -> bool:
        """Whether `NativeTick.tick` may compute the next tick: position control, and nothing special."""
        carried, interpolator = self._carried, self.interpolator
        return (
            self._errors is None
            and carried.torque_monitor is None
            and not carried.model.differs
            and self._drives.is_plain
            and not (interpolator.is_overlaid or self._load.is_pushed)
        )

    def _simulate(self) -> None:
        """Control law, dynamics, and what the sensors show."""
        m, d, carried, interpolator = self.model, self.data, self._carried, self.interpolator
        mujoco.mj_step1(m, d)
        self._load.apply(self.tick_count * TICK)
        mujoco.mj_fullM(m, d, self._arm.mass)
        if carried.model.differs:
            carried.model.believe()
        watched = carried.torque_monitor if interpolator.order and not self.safety.latched else None
        if watched is not None:
            watched.follow(d)
        self._drives.exert(
            interpolator.command, is_overlaid=interpolator.is_overlaid, action=interpolator.action
        )
        mujoco.mj_step2(m, d)
        self._sense()
        if watched is not None:
            self._watch(watched)

    def _publish(self) -> None:
        """Give readers the computed state, and wake those that wait for it: they read it when it is due."""
        self.tick_count = k = self.tick_count + 1
        if self._native.publish(k) and self.on_wake is not None:
            self.on_wake(k * TICK_NS)
        if self._newest != self._reported:
            self._reported = self._newest
            if self.on_safety is not None:
                self.on_safety(self._reported, self._reported >> 32)

    def _sense(self) -> None:
        """What the sensors show after the dynamics, and the external load."""
        load, is_loaded = self._load, self._native.sense()
        if self._errors is not None:
            arm = self._arm
            reading = self._errors.read(arm.q, arm.tau, load.torque)
            arm.shown[:], arm.tau[:], load.torque[:] = reading.q, reading.tau, reading.load
            is_loaded = True
        load.resolve(is_loaded=is_loaded)

    def _advance(self) -> tuple[float, float]:
        """Compute the next set-point; returns progress and remaining time."""
        if self.safety.latched:
            self._drives.stop(rests=self.interpolator.rests)
        elif self._drives.are_braked:
            self._drives.release(self.interpolator.command)
        return self.interpolator.advance()

    def _supervise(self) -> None:
        """End the running command where a drive trips."""
        reason = self._drives.supervise(self.interpolator.command.after)
        if reason:
            self.safety.request_stop(StopRequest.DRIVE_ERROR)
            self.interpolator.trip(reason)
            log.warning("%s", reason)

    def _watch(self, monitor: ExternalTorqueMonitor) -> None:
        """Let a safety function stop the arm on its path."""
        reason = monitor.check(
            self._load.torque, self._sensed.mass, self._sensed.bias, self._arm.acceleration
        )
        if reason:
            self.safety.request_stop(StopRequest.PROTECTIVE_STOP)
            log.warning("%s", reason)

    def _write(self, progress: float, remaining: float) -> None:
        """Write the state after the next tick into its slot; readers see it after `_publish`."""
        after, words = self.interpolator.command.after, self._words()
        self._native.write(self.tick_count + 1, after, words=words, times=(progress, remaining))

    def _words(self) -> tuple[int, int, int]:
        """Flags, operation mode and running command of the next tick."""
        safety, order = self.safety, self.interpolator.order
        flags, mode = safety.flags, safety.mode
        if not self._drives.are_braked:
            flags |= _BRAKES_OPEN
        if self.interpolator.is_paused or safety.latched:
            flags |= _PAUSED
        self._newest = flags | mode << 32  # a change of the mode alone is reported, too
        return (flags | _MOVING if order else flags), mode, order

    @property
    def snapshot(self) -> Snapshot:
        """The newest state, copied."""
        slot, arm = self.shared.floats[self.tick_count % SLOTS], self._arm
        return Snapshot(
            self.tick_count * TICK,
            arm.shown.copy(),
            self.interpolator.command.after.copy(),
            arm.dq.copy(),
            arm.tau.copy(),
            arm.load.copy(),
            arm.tau_cmd.copy(),
            arm.wrench.copy(),
            self.interpolator.order,
            float(slot[StateWords.PROGRESS]),
        )
