"""What the flange carries, and what the controller and the safety functions count of it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from copy import copy
from math import inf

import mujoco

from heptarm.sim.plant.carried import CarriedShapes, FlangeShapes
from heptarm.sim.plant.payload import PayloadModel
from heptarm.sim.plant.safety_monitor import ExternalTorqueMonitor, SafetyLimits
from heptarm.values.checks import Array
from heptarm.values.robot import Body


class FlangeLoad:
    """The load on the flange: true payload, load data of the controller, load of the safety functions, shapes.

    Any thread may change it; the thread of the ticks takes the changes with `take`, since they change MuJoCo's model.

    Args:
        model: MuJoCo's model of the world; its first seven joints are the arm's.
        data: its state.
        mass: inertia matrix of the world, shape (nv, nv), which the plant keeps up to date [kg m²].
        bare: model of the arm alone, if a tool of the scene is on its flange; None: the flange is empty.
        limits: of safety functions that depend on the load.

    Attributes:
        model: payload and load data.
        torque_monitor: safety function that limits external torques; None: there is no such limit.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        mass: Array,
        *,
        bare: mujoco.MjModel | None,
        limits: SafetyLimits,
    ) -> None:
        self._limits = limits
        self.torque_monitor: ExternalTorqueMonitor | None = None
        if limits.torque < inf:
            self.torque_monitor = ExternalTorqueMonitor(copy(model if bare is None else bare), limits)
        self.model = PayloadModel(model, data, mass, bare)
        self._mounted = FlangeShapes(model)
        self._changes: deque[Callable[[], None]] = deque()

    @property
    def has_changed(self) -> bool:
        """Whether there is something for `take`."""
        return bool(self._changes)

    def take(self) -> None:
        """Make the changes."""
        while self._changes:
            self._changes.popleft()()

    def declare(self, load: Body) -> None:
        """Set the load data of the controller, in the flange frame; see `PayloadModel.declare`."""
        self._changes.append(lambda: self.model.declare(load))

    def set_true(self, load: Body) -> None:
        """Set the true payload, in the flange frame; declared load data do not change it any more."""
        self._changes.append(lambda: self.model.set_true(load))

    def count(self, load: Body, *, workpiece: float) -> None:
        """Set the load that the safety functions count.

        Args:
            load: tools and safety workpiece, in the flange frame.
            workpiece: mass of the safety workpiece [kg]; 0: there is none.

        Raises:
            ValueError: the safety configuration allows no workpiece as heavy as that.
        """
        most, monitor = self._limits.workpiece, self.torque_monitor
        if workpiece > most:
            raise ValueError(
                f"the safety workpiece has {workpiece:g} kg, the safety configuration allows {most:g} kg"
            )
        if monitor is not None:
            self._changes.append(lambda: monitor.count(load))

    def mount(self, bodies: Sequence[CarriedShapes]) -> None:
        """Mount shapes of tool and workpiece in place of those before; they collide."""
        self._changes.append(lambda: self._mounted.mount(bodies))
