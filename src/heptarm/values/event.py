"""What becomes of a program while it is under way."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

from heptarm.values.arrays import Value
from heptarm.values.state import State
from heptarm.values.trigger import Notify, Trigger


@dataclass(frozen=True, slots=True, eq=False)
class MotionEvent(Value):
    """One thing that has happened.

    Attributes:
        kind: "begun" or "ended": a motion of the program; "segment": one of a spline has begun; "trigger": one has
            fired and its action is done.
        item: index of the motion in the program.
        segment: index of the segment; -1 for other kinds.
        trigger: the trigger; None for other kinds.
        time: since the program's start, on the cabinet's clock [s]; NaN for other kinds than triggers.
        state: the joints when the cabinet's application heard that the trigger fired; None for other kinds, and if the
            robot did not tell.
        code: why an output was not written, as in the protocol's table; 0: it was.
        text: the same in words.
    """

    kind: str
    item: int
    segment: int = -1
    trigger: Trigger | None = None
    time: float = nan
    state: State | None = None
    code: int = 0
    text: str = ""

    @property
    def label(self) -> str:
        """Of a trigger that notifies; otherwise empty."""
        action = None if self.trigger is None else self.trigger.action
        return action.label if isinstance(action, Notify) else ""
