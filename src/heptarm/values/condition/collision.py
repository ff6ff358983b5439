"""Collision guard: a band of allowed external torque for each joint, around the torques at rest."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np
import numpy.typing as npt

from heptarm.errors import LimitError, ShapeError
from heptarm.values.checks import Array, Value, array, frozen, instance, integer, one_or_each, shown, within
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

    def __post_init__(self) -> None:
        object.__setattr__(self, "threshold", _each(self.threshold, "threshold", above=True))
        object.__setattr__(self, "baseline", array(self.baseline, 7, "baseline"))
        object.__setattr__(self, "margin", _each(self.margin, "margin"))
        far = np.abs(self.baseline) + self.threshold > JOINT
        if far.any():
            axis = int(far.argmax())
            room = JOINT - abs(float(self.baseline[axis]))
            raise LimitError(
                f"threshold[{axis}] must be in (0, {room:g}] Nm beside the baseline of A{axis + 1}, got "
                f"{self.threshold[axis]:g} Nm",
                code=2,
                parameter=f"threshold[{axis}]",
                value=float(self.threshold[axis]),
                allowed=f"(0, {room:g}] Nm",
            )

    @staticmethod
    def of(
        threshold: npt.ArrayLike, *, baseline: npt.ArrayLike = (0.0,) * 7, margin: npt.ArrayLike = 0.0
    ) -> CollisionGuard:
        """A guard from one number for all joints or seven.

        Raises:
            ShapeError: neither one number nor seven.
            LimitError: a threshold that is not positive, a negative margin, or a band beyond the largest joint torque.
        """
        return CollisionGuard(cast("Array", threshold), cast("Array", baseline), cast("Array", margin))

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
        instance(state, State, "state")
        allowed = self.threshold
        if self.is_moving:
            allowed = allowed + self.margin * np.abs(np.nan_to_num(state.dq))
        joint = int((np.abs(state.tau_ext - self.baseline) - allowed).argmax())
        found = self.seen(joint, state, allowed=float(allowed[joint]))
        return found if abs(found.torque) > found.allowed else None

    def named(self, part: Condition, state: State | None) -> Collision:
        """The collision that one of `parts` stands for."""
        parts = self.parts
        if not isinstance(part, Condition) or part not in parts:
            raise ShapeError(
                f"part must be one of this guard's, got {shown(part)}", parameter="part", value=part
            )
        joint = parts.index(part)
        if state is None:
            return Collision(joint, float("nan"), float(self.threshold[joint]))
        return self.seen(joint, state)

    def seen(self, joint: int, state: State, *, allowed: float | None = None) -> Collision:
        """The collision of a joint in a state."""
        joint = integer(joint, "joint", 0, 6)
        torque = float(instance(state, State, "state").tau_ext[joint] - self.baseline[joint])
        return Collision(joint, torque, float(self.threshold[joint]) if allowed is None else allowed, state)


def _each(value: npt.ArrayLike, name: str, *, above: bool = False) -> Array:
    result = one_or_each(value, 7, name)
    for index, entry in enumerate(result.tolist()):
        within(entry, f"{name}[{index}]", 0.0, JOINT, above=above, unit="Nm")
    return result
