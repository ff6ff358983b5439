"""The drives of the seven axes: motors under the control law in force, brakes, and each drive's own supervision."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heptarm.sim.control_laws.active_law import ActiveLaw
from heptarm.sim.control_laws.laws import MeasuredState, PositionLaw, Superposition
from heptarm.sim.controller.setpoints import SetPoints
from heptarm.sim.plant.arm_vectors import ArmVectors
from heptarm.sim.plant.drive_monitor import LAG, DriveMonitor
from heptarm.sim.plant.native import NativeTick
from heptarm.sim.plant.sensor_errors import SensorErrors
from heptarm.values.checks import Array

#: After a stop on the path the brakes close when no axis is faster than this [rad/s], or after this many ticks.
BRAKE_SPEED = 0.02
BRAKE_TICKS = 400
#: A brake that cannot hold its axis slips as far behind it [rad]; no drive trips at once when the brakes open.
BRAKE_SLIP = 0.8 * LAG


class Brakes:
    """Brakes of all axes. Closed, they hold the motors where they were; the elastic joints between stay wound.

    Args:
        sensed: measured state.
        gains: of position control.
    """

    __slots__ = ("_gains", "_halted", "_held", "_law", "_sensed")

    def __init__(self, sensed: MeasuredState, gains: Array) -> None:
        self._gains = gains
        self._sensed = self._held = sensed
        self._law: PositionLaw | None = None  # open
        self._halted = 0  # ticks for which the set-points have rested under a stop

    @property
    def are_closed(self) -> bool:
        """Whether they hold."""
        return self._law is not None

    def close(self, torque: Array) -> None:
        """Close; `torque`: what the motors exert now, shape (7,) [Nm]."""
        here = self._sensed.q.copy()
        self._held = replace(self._sensed, before=here, now=here, after=here, is_overlaid=False)
        self._law = PositionLaw.locked(torque, self._held, self._gains)

    def open(self) -> PositionLaw:
        """Open; returns the law that takes over without a step.

        It is for an arm that the brakes have stopped; one that had come to rest before goes on as it was.
        """
        assert self._law is not None, "open already"
        law, self._law, self._halted = self._law, None, 0
        return law.released(self._held)

    def torque(self) -> Array:
        """By which the closed brakes hold, shape (7,) [Nm]."""
        assert self._law is not None, "open"
        return self._law.torque(self._held)

    def slip(self) -> None:
        """Let an axis that is pushed away take its brake with it."""
        here = self._held.now
        np.clip(here, self._sensed.q - BRAKE_SLIP, self._sensed.q + BRAKE_SLIP, out=here)

    def are_due(self, *, rests: bool) -> bool:
        """Whether a stop that is in force closes them in this tick.

        Args:
            rests: whether the set-points rest.
        """
        self._halted = self._halted + 1 if rests else 0
        if self.are_closed or not self._halted:
            return False
        return self._halted > BRAKE_TICKS or float(np.abs(self._sensed.dq).max()) < BRAKE_SPEED


class Drives:
    """Motors, brakes and supervision of the drives of an arm.

    Args:
        arm: its vectors.
        native: computes on the same.
        sensed: measured state; the set-points are put into it for the laws.
        law: control law in force.
        gains: of position control, see `position_gains`.
        monitor: the drives' own supervision; None: no drive trips.
        errors: of friction; None: the joints have none.

    Attributes:
        is_tripped: whether a drive's own supervision has closed the brakes.
    """

    def __init__(
        self,
        arm: ArmVectors,
        native: NativeTick,
        sensed: MeasuredState,
        law: ActiveLaw,
        *,
        gains: Array,
        monitor: DriveMonitor | None,
        errors: SensorErrors | None,
    ) -> None:
        self._arm, self._native, self._sensed = arm, native, sensed
        self._law, self._monitor, self._errors = law, monitor, errors
        self._brakes = Brakes(sensed, gains)
        self.is_tripped = False

    @property
    def are_braked(self) -> bool:
        """Whether the brakes are closed."""
        return self._brakes.are_closed

    @property
    def is_plain(self) -> bool:
        """Whether they are under position control without anything that remains from before."""
        monitor = self._monitor
        return (
            self._law.is_plain
            and not self._brakes.are_closed
            and (monitor is None or not monitor.is_strained)
        )

    def exert(self, points: SetPoints, *, is_overlaid: bool, action: Superposition | None) -> None:
        """Compute the torques of the motors for the dynamics of a tick.

        Args:
            points: set-points.
            is_overlaid: they are an FRI client's.
            action: what such a client adds; None: nothing.
        """
        arm, is_braked = self._arm, self._brakes.are_closed
        if self._law.is_plain and not is_braked and not is_overlaid:
            self._native.command(points)  # what `PositionLaw` computes, without looking for addresses
        else:
            sensed = self._sensed
            sensed.before, sensed.now, sensed.after = points
            sensed.is_overlaid = is_overlaid
            torque = self._brakes.torque() if is_braked else self._law.torque(sensed)
            if is_overlaid and action is not None:
                self._law.superpose(torque, action)
            arm.torque[:] = torque
            self._native.drive()
            if is_braked:
                arm.tau_cmd[:] = 0.0
        if self._errors is not None:
            arm.torque[:] -= self._errors.friction(arm.dq)
            arm.actuators[:] = arm.torque

    def supervise(self, after: Array) -> str:
        """Let a drive trip: the brakes close at once, wherever the arm is. Returns why; "" while none does.

        Args:
            after: set-point of the next tick, shape (7,) [rad].
        """
        monitor, arm = self._monitor, self._arm
        if monitor is None or self.is_tripped:
            return ""
        is_stiff = self._law.is_stiff and not self._brakes.are_closed
        # the monitor finds out which range it is, and remembers; whether there is anything to find costs less in C
        if not monitor.is_strained and not self._native.strained(after, is_stiff=is_stiff):
            return ""
        reason = monitor.check(arm.dq, arm.q, arm.tau, after - arm.q if is_stiff else None)
        if reason:
            self.is_tripped = True
            self._brakes.close(arm.tau_cmd)
        return reason

    def stop(self, *, rests: bool) -> None:
        """While a stop is in force: close the brakes as soon as the arm is at rest.

        Args:
            rests: whether the set-points rest.
        """
        if self.is_tripped:
            self._brakes.slip()
        if self._brakes.are_due(rests=rests):
            self._brakes.close(self._arm.tau_cmd)

    def release(self, points: SetPoints) -> None:
        """Open the brakes: execution may continue."""
        law = self._brakes.open()
        if self.is_tripped:  # the arm is where the brakes have stopped it
            self._law.take_over(law)
            points.stay(self._arm.q)
            if self._monitor is not None:
                self._monitor.acknowledge(self._arm.q)
        self.is_tripped = False
