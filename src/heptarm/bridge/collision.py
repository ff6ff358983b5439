"""The collision guard of a node: in force until it is taken off, with a reaction to what it meets."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable
from math import inf

from heptarm.arm.arm import Arm
from heptarm.errors import CollisionDetected, HeptarmError
from heptarm.values.collision import Collision, CollisionGuard
from heptarm.values.impedance import JointImpedance
from heptarm.values.motion import hold

_log = logging.getLogger("heptarm.bridge")


class CollisionWatch:
    """Keeps a guard in force.

    Args:
        arm: in control.
        tell: told of each collision, from the connection's threads; it must not block.
        start: starts motions.
    """

    def __init__(self, arm: Arm, *, tell: Callable[[Collision], None], start: Callable[..., object]) -> None:
        self._arm, self._tell, self._start = arm, tell, start
        self._lock = threading.Lock()
        self._block = contextlib.ExitStack()
        self._soft: float | None = None

    def on(self, guard: CollisionGuard, *, soft: float | None = None) -> None:
        """Put a guard in force, in place of the one that is.

        Args:
            guard: the bands.
            soft: after a collision, take the guard off and give way with this stiffness of each joint [Nm/rad];
                None: stay.
        """
        self.off()
        with self._lock:
            self._soft = soft
            self._block.enter_context(self._arm.guarded(guard, on_collision=self._on_collision))

    def off(self) -> None:
        """Take it off, if there is one."""
        with self._lock, contextlib.suppress(CollisionDetected):  # it was told of
            self._block.close()

    def _on_collision(self, found: Collision) -> None:
        _log.warning("collision at %s", found)
        self._tell(found)
        if self._soft is not None:
            threading.Thread(target=self._give_way, args=(self._soft,), name="heptarm-collision").start()

    def _give_way(self, stiffness: float) -> None:
        try:
            self.off()  # what the arm leans against is no collision any more
            self._arm.wait_for_rest()
            self._start(hold(inf), mode=JointImpedance(stiffness), when="reject")
        except HeptarmError as error:
            _log.warning("the arm does not give way after the collision: %s", error)
