"""Who hears of what becomes of an arm: a node."""

from __future__ import annotations

from typing import Protocol

from heptarm.bridge.execution import Listener
from heptarm.values.collision import Collision
from heptarm.values.event import MotionEvent
from heptarm.values.state import State


class DriverListener(Listener, Protocol):
    """Hears of everything, from the driver's threads; it must not block."""

    def on_state(self, state: State) -> None:
        """A new state came."""
        ...

    def on_link(self, trouble: str) -> None:
        """The connection came (empty) or went (why)."""
        ...

    def on_key(self, slot: int, down: bool) -> None:
        """A user key of the smartPAD was pressed or released."""
        ...

    def on_event(self, number: int, event: MotionEvent) -> None:
        """Something has become of the program of that number."""
        ...

    def on_collision(self, found: Collision) -> None:
        """The collision guard has met something."""
        ...
