"""The command of one motion to the plant, in SI units, and the receivers of its events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan
from typing import Protocol

from heptarm.planning.seam import TICK_NS, Condition, ServoTiming, StraightLimits
from heptarm.values.mode.mode import Mode
from heptarm.values.motion.hand_guiding import HandGuide
from heptarm.values.motion.orientation import VARIABLE, Orientation

#: Length of one tick [s].
TICK = TICK_NS / 1e9

Seven = tuple[float, ...]
_FULL: Seven = (1.0,) * 7
DEFAULT_TIMING = ServoTiming()


class MotionListener(Protocol):
    """Receives the events of a command; called by the thread that ticks the plant, must not block."""

    def started(self) -> None:
        """The motion begins."""

    def finished(self, cause: str, text: str) -> None:
        """The motion has ended: "done", "cancelled", "condition" (a break condition) or "error" with its text."""


class PartListener(MotionListener, Protocol):
    """Also receives the parts of a batch or a spline."""

    def reached(self, part: int) -> None:
        """A part begins, other than the first."""


class PlanError(ValueError):
    """The motion cannot be planned; the text is of the kind that Sunrise gives.

    Attributes:
        kind: "joint_limit", "unreachable" or "planning".
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


@dataclass(frozen=True, slots=True)
class ConditionWatch:
    """A condition that is evaluated while a motion runs.

    Attributes:
        condition: the condition.
        fired: called when it holds for the first time, by the thread that ticks the plant; must not block.
        breaks: it ends the motion.
        part: the part of a batch or a spline in which it is evaluated; -1: all of them.
    """

    condition: Condition
    fired: Callable[[], None]
    breaks: bool = False
    part: int = -1


@dataclass(frozen=True, slots=True)
class Order:
    """The command of one motion. NaN stands for "the default".

    Attributes:
        id: chosen by the caller, unique.
        kind: "ptp", "lin", "lin_rel", "circ", "hold", or of several parts: "batch",
            "spline" and "spline_joints"; "guide"; or a servo motion: "servo", "direct" or "straight". Of a spline only:
            "spl".
        joints: target of a ptp [rad]; None: `pose` is the target.
        pose: target of the tool frame in the base: x y z [m], quaternion x y z w.
        via: of a circ: the auxiliary point, as `pose`.
        orientation: orientation control along a Cartesian path.
        redundancy: E1 [rad] (NaN: keep), Status and Turn (-1: keep).
        tcp: flange to tool frame, x y z [m], quaternion.
        offset: of a lin_rel: translation and rotation in the axes of the reference.
        reference: axes of a lin_rel's offset as a quaternion in the base; None: the tool frame's own. Of a straight
            servo motion: those of its limits; None: the base's.
        joint_velocity: fractions of each axis' maximum, as the next two.
        cart_velocity: [m/s]; then [m/s²], [m/s³]; orientation [rad/s], [rad/s²], [rad/s³].
        blending: where the transition to the next part of its batch may begin: fraction of the path, distance from
            its end [m], rotation from its end [rad]; zeros: no blending.
        parts: motions of a batch, segments of a spline; mode, tcp and listener are those of the whole.
        guide: limits of a hand guiding.
        duration: of a hold [s]; NaN: until cancelled.
        mode: control mode; None: position.
        axes: of the mode's frame as a quaternion in the base; None: as in the mode, "tool" or "base".
        servo_timing: times of a servo motion.
        straight_limits: limits of a straight servo motion; None: the defaults.
        listener: receives start and end.
        part_listener: receives the parts of a batch or a spline.
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
    servo_timing: ServoTiming = DEFAULT_TIMING
    straight_limits: StraightLimits | None = None
    listener: MotionListener | None = field(default=None, compare=False)
    part_listener: PartListener | None = field(default=None, compare=False)
    watches: tuple[ConditionWatch, ...] = field(default=(), compare=False)

    @property
    def is_servo(self) -> bool:
        """Whether it follows targets that arrive while it runs."""
        return self.kind in ("servo", "direct", "straight")
