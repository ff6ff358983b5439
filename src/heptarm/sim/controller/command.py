"""The command of one motion to the simulated controller, and the receivers of its events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from heptarm.planning.motion import ON_FLANGE
from heptarm.planning.seam import Condition, PlantMotion
from heptarm.values.mode.mode import Mode


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
class MotionCommand:
    """A motion, and under what terms it is executed.

    Attributes:
        id: chosen by the caller, unique.
        motion: the motion.
        tcp: flange to motion frame, x y z [m], quaternion x y z w.
        mode: control mode; None: position.
        axes: of the mode's frame as a quaternion in the base; None: as in the mode, "tool" or "base".
        listener: receives start and end.
        part_listener: receives the parts of a batch or a spline.
        watches: break conditions and triggers, of the parts as well.
        is_overlaid: an FRI client gives the set-points; the motion beneath waits for it.
    """

    id: int
    motion: PlantMotion
    tcp: tuple[float, ...] = ON_FLANGE
    mode: Mode | None = None
    axes: tuple[float, ...] | None = None
    listener: MotionListener | None = field(default=None, compare=False)
    part_listener: PartListener | None = field(default=None, compare=False)
    watches: tuple[ConditionWatch, ...] = field(default=(), compare=False)
    is_overlaid: bool = False
