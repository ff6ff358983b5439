"""Collision guard: a band of allowed external torque for each joint, around the torques at rest."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError
from heptarm.values.arrays import Array, Value, array, frozen, within
from heptarm.values.condition.condition import AnyOf, Condition
from heptarm.values.condition.force import JOINT, JointTorqueOutside
from heptarm.values.state import State


def _nothing() -> Array:
    return frozen(np.zeros(7))


@dataclass(frozen=True, slots=True, eq=False)
class Collision(Value):
    """A collision that a guard has detected.

    Attributes:
        joint: the joint whose torque left its band, 0 for A1.
        torque: its external torque minus the baseline [Nm].
        allowed: largest deviation from the baseline [Nm].
        state: the robot at that moment; None if no state was received.
    """

    joint: int
    torque: float
    allowed: float
    state: State | None = None

    def __str__(self) -> str:
        return f"A{self.joint + 1}: {self.torque:+.1f} Nm external torque, allowed are {self.allowed:.1f} Nm"


@dataclass(frozen=True, slots=True, eq=False)
class CollisionGuard(Value):
    """Bands around the external torques at rest; made by `Arm.collision_guard`.

    Attributes:
        threshold: allowed deviation from the baseline, shape (7,) [Nm].
        baseline: external torques at rest, shape (7,) [Nm]; not zero where the load data are inexact.
        margin: added to a joint's threshold per speed of the joint, shape (7,) [Nm s/rad].
    """

    threshold: Array
    baseline: Array = field(default_factory=_nothing)
    margin: Array = field(default_factory=_nothing)

    @staticmethod
    def of(
        threshold: npt.ArrayLike, *, baseline: npt.ArrayLike = (0.0,) * 7, margin: npt.ArrayLike = 0.0
    ) -> CollisionGuard:
        """A guard from one number for all joints or seven.

        Raises:
            ShapeError: neither one number nor seven.
            LimitError: a threshold that is not positive, a negative margin, or a band beyond the largest joint torque.
        """
        guard = CollisionGuard(
            _each(threshold, "threshold", above=True), array(baseline, 7, "baseline"), _each(margin, "margin")
        )
        far = np.abs(guard.baseline) + guard.threshold > JOINT
        if far.any():
            axis = int(far.argmax())
            raise LimitError(
                f"threshold[{axis}] must be in (0, {JOINT - abs(guard.baseline[axis]):g}] Nm beside the baseline of "
                f"A{axis + 1}, got {guard.threshold[axis]:g} Nm",
                code=2,
                parameter=f"threshold[{axis}]",
                value=float(guard.threshold[axis]),
                allowed=f"(0, {JOINT - abs(guard.baseline[axis]):g}] Nm",
            )
        return guard

    @property
    def is_moving(self) -> bool:
        """Whether its bands depend on the speed; conditions of the cabinet cannot, so the client evaluates them."""
        return bool(self.margin.any())

    @property
    def parts(self) -> tuple[Condition, ...]:
        """A condition for each joint, at rest."""
        low, high = self.baseline - self.threshold, self.baseline + self.threshold
        return tuple(JointTorqueOutside(i, float(low[i]), float(high[i])) for i in range(7))

    @property
    def condition(self) -> Condition:
        """The torque of any joint has left its band; for `until=`."""
        return AnyOf(self.parts)

    def collision(self, state: State) -> Collision | None:
        """The joint farthest beyond its band in a state; None: all are within.

        Raises:
            StaleState: the state lacks torques or, with a margin, joints.
        """
        allowed = self.threshold
        if self.is_moving:
            allowed = allowed + self.margin * np.abs(np.nan_to_num(state.dq))
        joint = int((np.abs(state.tau_ext - self.baseline) - allowed).argmax())
        found = self.seen(joint, state, allowed=float(allowed[joint]))
        return found if abs(found.torque) > found.allowed else None

    def named(self, part: Condition, state: State | None) -> Collision:
        """The collision that one of `parts` stands for."""
        joint = self.parts.index(part)
        if state is None:
            return Collision(joint, float("nan"), float(self.threshold[joint]))
        return self.seen(joint, state)

    def seen(self, joint: int, state: State, *, allowed: float | None = None) -> Collision:
        """The collision of a joint in a state."""
        torque = float(state.tau_ext[joint] - self.baseline[joint])
        return Collision(joint, torque, float(self.threshold[joint]) if allowed is None else allowed, state)


def _each(value: npt.ArrayLike, name: str, *, above: bool = False) -> Array:
    result = array(np.full(7, value) if np.ndim(value) == 0 else value, 7, name)
    for index, entry in enumerate(result.tolist()):
        within(entry, f"{name}[{index}]", 0.0, JOINT, above=above, unit="Nm")
    return result
