"""The plant: a simulated LBR with its motion controller, one millisecond a tick.

The interpolator gives the set-points, a control law the torques, and MuJoCo steps the dynamics. The plant needs
neither JVM nor clock: whoever calls `tick` owns its time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, nan

import mujoco
import numpy as np

from heptarm.model.kinematics import flange
from heptarm.values.arrays import Array
from heptarm.values.links import Body
from heptarm.values.mode import Mode as ControlMode
from heptarm.values.robot import RobotModel, robot
from heptarm.virtual import ring
from heptarm.virtual.control import Control
from heptarm.virtual.fri.overlay import Superposition
from heptarm.virtual.interpolator import Interpolator
from heptarm.virtual.law import PositionLaw, Sensed
from heptarm.virtual.load import Load
from heptarm.virtual.order import Order
from heptarm.virtual.payload import Payload
from heptarm.virtual.posture import posture
from heptarm.virtual.safety import Demand, Safety
from heptarm.virtual.signals import Signals
from heptarm.virtual.tick import TICK, TICK_NS
from heptarm.virtual.world import Box, compiled

#: After a stop on the path the brakes close when no axis is faster than this [rad/s], or after so many ticks.
BRAKE_SPEED = 0.02
BRAKE_TICKS = 400

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
        self._control = Control(self.robot, self.model, self.data)
        self.signals = Signals(self.ring.signals)
        self._sensed = Sensed(
            self._q, self._dq, self._mass[:7, :7], self._bias, self._passive, self._q, self._q, self._q
        )
        self.safety = Safety()
        self.on_safety: Callable[[int, int], None] | None = (
            None  # called with flags and mode that have changed
        )
        self._flags = 0
        self._brakes: PositionLaw | None = None  # closed
        self._braked = self._sensed
        self._halted = 0  # ticks for which a stop on the path has been in force
        self.interpolator = Interpolator(
            self.robot, self.ring, self._sensed, self._load, self._control, self.safety
        )
        self.lookout = self.interpolator.lookout
        self._write(0, 0.0, nan)

    def _views(self) -> None:
        d = self.data
        self._q, self._dq, self._acc = d.qpos[:7], d.qvel[:7], d.qacc[:7]
        self._bias, self._passive = d.qfrc_bias[:7], d.qfrc_passive[:7]
        self._ctrl = d.ctrl[:7]
        self._armature = self.model.dof_armature[:7].copy()
        self._limit, self._least = self.robot.tau_max, -self.robot.tau_max
        self._mass = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, d, self._mass)
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
        return self.interpolator.queue.idle

    def submit(self, order: Order) -> None:
        """Plan an order from the end of what is queued and append it.

        While the arm brakes, the place it will come to rest at is not known; then the order is planned when
        its turn comes, and a planning error reaches its listener.

        Raises:
            PlanError: it cannot be planned; nothing has changed.
        """
        self.interpolator.queue.submit(order)

    def cancel(self, order_id: int | None = None) -> None:
        """Cancel an order (None: all): the running one brakes on its path, waiting ones are dropped."""
        self.interpolator.queue.cancel(order_id, fast=False)

    def stop(self) -> None:
        """Cancel everything."""
        self.cancel(None)

    def stop_fast(self) -> None:
        """Cancel everything; what runs leaves its path, since every axis brakes as hard as it may."""
        self.interpolator.queue.cancel(None, fast=True)

    def pause(self) -> None:
        """Come to rest on the path, keeping all orders."""
        self.interpolator.is_paused = True

    def resume(self) -> None:
        """Go on after a pause, or after a stop that nobody demands any more."""
        self.interpolator.is_paused = False
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
        self.interpolator.change_mode(order_id, mode)

    def abort(self, order_id: int, text: str) -> None:
        """End a running order (0: whichever runs) by an error; every axis brakes by itself."""
        self.interpolator.abort(order_id, text)

    # ------------------------------------------------------------------------------ overlays, from the tick's thread

    @property
    def interpolated(self) -> Array:
        """Set-point of the next tick without an overlay, shape (7,) [rad]: where a held arm was when the hold began."""
        return self.interpolator.interpolated

    def overlay(self, action: Superposition | None) -> None:
        """Lay an action on the running hold in the next tick; None after one: brake, and end the hold."""
        self.interpolator.action = action

    # ------------------------------------------------------------------------------ the tick

    def step(self, ticks: int = 1) -> None:
        """Run a number of ticks."""
        for _ in range(ticks):
            self.tick()

    def tick(self) -> None:
        """One millisecond: set-point, control law, dynamics, state."""
        m, d, interpolator = self.model, self.data, self.interpolator
        if self._payloads:
            self._take_loads()
        progress, remaining = self._advance()
        mujoco.mj_step1(m, d)
        self._load.apply(self.tick_count * TICK)
        mujoco.mj_fullM(m, d, self._mass)
        if self._payload.differs:
            self._payload.believe()
        sensed = self._sensed
        sensed.before, sensed.now, sensed.after = interpolator.command
        sensed.is_overlaid = interpolator.is_overlaid
        torque = self._control.torque(sensed) if self._brakes is None else self._brakes.torque(self._braked)
        if interpolator.is_overlaid and interpolator.action is not None:
            self._control.superpose(torque, interpolator.action)
        np.minimum(torque, self._limit, out=torque)
        np.maximum(torque, self._least, out=torque)
        self._ctrl[:] = torque
        mujoco.mj_step2(m, d)
        self._tau_cmd = torque if self._brakes is None else np.zeros(7)
        # the sensors sit behind the gear: rotor inertia and gear friction are not in them
        self._tau = torque - self._armature * self._acc + self._passive
        self._load.measure(sensed.mass @ self._acc + sensed.bias - self._passive - torque)
        self.tick_count += 1
        self._write(interpolator.order, progress, remaining)

    def _advance(self) -> tuple[float, float]:
        """Compute the next set-point; returns progress and remaining time."""
        if self.safety.latched or self._brakes is not None:
            self._brake_or_open()
        return self.interpolator.advance()

    def _brake_or_open(self) -> None:
        """Close the brakes when a stop has brought the arm to rest; open them when execution may go on."""
        if not self.safety.latched:
            self._brakes, self._halted = None, 0
            return
        self._halted = self._halted + 1 if self.interpolator.rests else 0
        if self._brakes is not None or not self._halted:
            return
        if self._halted > BRAKE_TICKS or float(np.abs(self._dq).max()) < BRAKE_SPEED:
            here = self._q.copy()
            self._braked = replace(self._sensed, before=here, now=here, after=here, is_overlaid=False)
            self._brakes = PositionLaw.that_goes_on(self._tau_cmd, self._braked)

    # ------------------------------------------------------------------------------ state

    def _write(self, order: int, progress: float, remaining: float) -> None:
        k, r = self.tick_count, self.ring
        slot = k % ring.SLOTS
        words, reals = r.ints[slot], r.floats[slot]
        words[ring.SEQ] = 2 * k + 1
        words[ring.TIME] = k * TICK_NS
        q = self._q
        reals[2:9] = q
        reals[9:16] = self.interpolator.command.after
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
        if self.interpolator.is_paused or safety.latched:
            flags |= ring.PAUSED
        if safety.enabled:
            flags |= ring.ENABLED
        if safety.guides:
            flags |= ring.HAND_GUIDING
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
            self.interpolator.command.after.copy(),
            self._dq.copy(),
            self._tau.copy(),
            self._load.torque.copy(),
            self._tau_cmd.copy(),
            self._load.wrench.copy(),
            self.interpolator.order,
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
