"""What the plant is asked to do: one motion with all its parameters, in SI, and who wants to hear of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan
from typing import Protocol

from heptarm.values.guiding import HandGuide
from heptarm.values.mode import Mode
from heptarm.values.orientation import VARIABLE, Orientation

Seven = tuple[float, ...]
_FULL: Seven = (1.0,) * 7


class Listener(Protocol):
    """Hears of an order; called by the thread that ticks the plant, must not block."""

    def started(self) -> None:
        """The motion begins."""

    def finished(self, cause: str, text: str) -> None:
        """The motion has ended: "done", "cancelled", "condition" (one broke it) or "error" with its text."""


class PartListener(Listener, Protocol):
    """Hears of the parts of a batch or a spline, too."""

    def reached(self, part: int) -> None:
        """A part begins, another than the first."""


class PlanError(ValueError):
    """The motion cannot be planned; the text is of the kind that Sunrise gives.

    Attributes:
        kind: "joint_limit", "unreachable" or "planning".
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


@dataclass(frozen=True, slots=True)
class Watch:
    """A condition that is watched while a motion runs.

    Attributes:
        condition: as heptarm.virtual.condition reads it.
        fired: called when it holds for the first time, by the thread that ticks the plant; must not block.
        breaks: it ends the motion.
        part: of a batch or a spline which part it is watched in; -1: in all of them.
    """

    condition: tuple[float, ...]
    fired: Callable[[], None]
    breaks: bool = False
    part: int = -1


@dataclass(frozen=True, slots=True)
class Order:
    """One motion. NaN stands for "the default".

    Attributes:
        id: chosen by the caller, unique.
        kind: "ptp", "lin", "lin_rel", "circ", "hold", or of several parts: "batch",
            "spline" and "spline_joints"; "guide"; or a servo motion: "servo", "direct" or "straight". Of a spline only:
            "spl".
        joints: target of a ptp [rad]; None: `pose` is the target.
        pose: target of the moved frame in the base: x y z [m], quaternion x y z w.
        via: of a circ: the auxiliary point, as `pose`.
        orientation: how it is led along a Cartesian path.
        redundancy: E1 [rad] (NaN: keep), Status and Turn (-1: keep).
        tcp: flange to moved frame, x y z [m], quaternion.
        offset: of a lin_rel: translation and rotation in the axes of the reference.
        reference: axes of a lin_rel's offset as a quaternion in the base; None: the moved frame's own. Of a straight
            servo motion: those of its limits; None: the base's.
        joint_velocity: fractions of each axis' maximum, as the next two.
        cart_velocity: [m/s]; then [m/s²], [m/s³]; orientation [rad/s], [rad/s²], [rad/s³].
        blending: where it may turn into the next part of its batch: fraction of the path, distance from its end
            [m], rotation from its end [rad]; zeros: nowhere.
        parts: motions of a batch, segments of a spline; mode, tcp and listener of the whole count.
        guide: limits of a hand guiding.
        duration: of a hold [s]; NaN: until cancelled.
        mode: control mode; None: position.
        axes: of the mode's frame as a quaternion in the base; None: as the mode says, "tool" or "base".
        minimum_time: no trajectory to a servo target is shorter [s].
        goal_timeout: a servo motion ends so long after its target was reached and no other came [s].
        speed_timeout: how long a servo target's velocity is kept after it was passed [s].
        straight: of a straight servo motion: largest velocity x y z, about x y z, then acceleration; NaN: the usual.
        listener: hears of start and end.
        part_listener: hears of the parts of a batch or a spline.
        watches: break conditions and triggers, of the parts as well.
    """

    id: int
    kind: str
    joints: Seven | None = None
    pose: Seven | None = None
    via: Seven | None = None
    orientation: Orientation = VARIABLE
    redundancy: tuple[float, int, int] = (nan, -1, -1)
    tcp: Seven = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    offset: Seven | None = None
    reference: Seven | None = None
    joint_velocity: Seven = _FULL
    joint_acceleration: Seven = _FULL
    joint_jerk: Seven = _FULL
    cart_velocity: float = nan
    cart_acceleration: float = nan
    cart_jerk: float = nan
    ori_velocity: float = nan
    ori_acceleration: float = nan
    ori_jerk: float = nan
    blending: tuple[float, float, float] = (0.0, 0.0, 0.0)
    parts: tuple[Order, ...] = ()
    guide: HandGuide | None = None
    duration: float = nan
    mode: Mode | None = None
    axes: Seven | None = None
    minimum_time: float = 0.02
    goal_timeout: float = 30.0
    speed_timeout: float = 0.1
    straight: Seven | None = None
    listener: Listener | None = field(default=None, compare=False)
    part_listener: PartListener | None = field(default=None, compare=False)
    watches: tuple[Watch, ...] = field(default=(), compare=False)

    @property
    def is_servo(self) -> bool:
        """Whether it follows targets that come while it runs."""
        return self.kind in ("servo", "direct", "straight")
