"""The plant as an arm that FRI overlays act on."""

from __future__ import annotations

from itertools import count

from heptarm.fri import messages as m
from heptarm.values.mode import Mode
from heptarm.values.robot import RobotModel
from heptarm.virtual.fri.overlay import Reading, Superposition
from heptarm.virtual.fri.standalone import control_of
from heptarm.virtual.order import Order
from heptarm.virtual.plant import Plant
from heptarm.virtual.ring import Ring
from heptarm.virtual.safety import Demand

_numbers = count(-1, -1)  # of own orders, so that they are nobody else's


class PlantArm:
    """A plant that holds its position for overlays.

    Args:
        plant: the plant; whoever ticks it ticks through this.
    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self._order = 0
        self._control = m.ControlMode.POSITION

    @property
    def robot(self) -> RobotModel:
        """Dimensions and limits."""
        return self.plant.robot

    @property
    def ring(self) -> Ring:
        """The plant's ring."""
        return self.plant.ring

    def reading(self) -> Reading:
        """The state after the last tick."""
        state, safety = self.plant.snapshot, self.plant.safety
        return Reading(
            tuple(state.q.tolist()),
            tuple(state.q_cmd.tolist()),
            tuple(self.plant.interpolated.tolist()),
            tau=tuple(state.tau.tolist()),
            tau_cmd=tuple(state.tau_cmd.tolist()),
            tau_ext=tuple(state.tau_ext.tolist()),
            wrench=tuple(state.wrench.tolist()),
            safety=m.Safety.STOP_1 if safety.halts else m.Safety.NORMAL_OPERATION,  # stops keep the path
            drives=m.DriveState.OFF if Demand.DRIVE_ERROR in safety.demands else m.DriveState.ACTIVE,
            operation_mode=m.OperationMode(int(safety.mode)),
            control_mode=self._control,
        )

    def overlay(self, action: Superposition | None) -> None:
        """Take what the next tick does."""
        self.plant.overlay(action)

    def hold(self, mode: Mode) -> None:
        """Hold the present position in a control mode, until `release`."""
        self._order, self._control = next(_numbers), control_of(mode)
        self.plant.submit(Order(self._order, "hold", mode=mode))

    def release(self) -> None:
        """End the hold; the arm rests in position control."""
        self.plant.cancel(self._order)
        self._control = m.ControlMode.POSITION

    def tick(self) -> None:
        """One millisecond."""
        self.plant.tick()
