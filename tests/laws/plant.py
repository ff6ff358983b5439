"""A rigid arm whose cabinet compensates gravity and Coriolis torques, a law at 1 kHz one cycle late, and a wall."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from heptarm.fri import LawTrial
from heptarm.laws import ReadyLaw
from heptarm.laws.ready import shared_library
from heptarm.model.dynamics import ROTOR, rigid_bodies
from heptarm.values.robot import robot

Floats = npt.NDArray[np.float64]
ARM = robot("iiwa14")
HOME: Floats = np.radians([0.0, 30.0, 0.0, -90.0, 0.0, 60.0, 0.0])
DT, SUBSTEPS = 1e-3, 4


def still(t: float) -> Floats:
    return np.zeros(3)


@dataclass
class Plant:
    """The arm under a law.

    Attributes:
        law: called every millisecond.
        wall: height of a surface under the flange [m]; None: none.
        wall_stiffness, wall_damping: of the surface [N/m], [N s/m].
        friction: of the joints [Nm s/rad], as in the simulator.
        push: external force on the flange at a time, shape (3,) [N].
    """

    law: ReadyLaw
    q: Floats = field(default_factory=HOME.copy)
    dq: Floats = field(default_factory=lambda: np.zeros(7))
    wall: float | None = None
    wall_stiffness: float = 30_000.0
    wall_damping: float = 30.0
    friction: float = 0.5
    push: Callable[[float], Floats] = still

    def __post_init__(self) -> None:
        self.trial = LawTrial(self.law, dt=DT)
        self._tau = np.zeros(7)
        self.force = 0.0
        self._library = ctypes.CDLL(str(shared_library()))
        self._constants = rigid_bodies(ARM, rotor=ROTOR)
        self.mass, self._none = np.zeros((7, 7)), np.zeros(7)
        self.jacobian, self._pose = np.zeros((6, 7)), np.zeros(7)
        self.look()

    def look(self) -> None:
        """Update the model to the present posture."""
        arrays = (
            self._constants,
            self.q,
            self.dq,
            self.mass,
            self._none,
            self._none,
            self.jacobian,
            self._pose,
        )
        self._library.heptarm_model(*(ctypes.c_void_p(array.ctypes.data) for array in arrays))

    @property
    def place(self) -> Floats:
        return self._pose[:3].copy()

    @property
    def velocity(self) -> Floats:
        return self.jacobian @ self.dq

    def energy(self) -> float:
        """Kinetic energy [J]."""
        return float(0.5 * self.dq @ (self.mass + ROTOR * np.eye(7)) @ self.dq)

    def external(self) -> Floats:
        """External force on the flange [N]."""
        push = np.array(self.push(self.trial.t), dtype=float)
        if self.wall is not None:
            depth, closing = self.wall - self._pose[2], -self.velocity[2]
            pressed = self.wall_stiffness * depth + self.wall_damping * closing
            self.force = max(0.0, pressed) if depth > 0.0 else 0.0
            push[2] += self.force
        return push

    def torque_step(self) -> None:
        """A millisecond of a torque session: the law's torques act one cycle later."""
        measured, speed = self.q.copy(), self.dq.copy()
        for _ in range(SUBSTEPS):
            load = self.jacobian[:3].T @ self.external()
            inertia = self.mass + ROTOR * np.eye(7)
            rates = np.linalg.solve(inertia, self._tau + load - self.friction * self.dq)
            self.dq = self.dq + rates * DT / SUBSTEPS
            self.q = self.q + self.dq * DT / SUBSTEPS
            self.look()
        self._tau = np.array(self.trial(measured, speed, q_ipo=HOME).tau)

    def position_step(self, stiffness: float = 15_000.0) -> None:
        """A millisecond of a position session: elastic joints follow the setpoint with a lag of 5 ms."""
        load = self.jacobian[:3].T @ self.external()
        setpoint = np.array(self.trial(self.q, self.dq, q_ipo=HOME, tau_ext=load).q)
        new = self.q + (setpoint + load / stiffness - self.q) * DT / 5e-3
        self.dq = (new - self.q) / DT
        self.q = new
        self.look()

    def run(self, seconds: float, *, by: str = "torque") -> list[Floats]:
        """Places of the flange, one a millisecond."""
        places = []
        for _ in range(round(seconds / DT)):
            (self.torque_step if by == "torque" else self.position_step)()
            places.append(self.place)
        return places
