"""The collision guard of a node: enabled until it is disabled, with a reaction to a collision."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections.abc import Callable
from math import inf

import numpy as np

from heptarm.arm.arm import Arm
from heptarm.errors import CollisionDetected, HeptarmError
from heptarm.values.condition.collision import Collision, CollisionGuard
from heptarm.values.mode.impedance import JointImpedance
from heptarm.values.motion.motion import hold
from heptarm.values.state import State

#: Longest wait for the end of braking [s].
_REST_TIMEOUT = 5.0
#: Highest velocity of an axis at rest [rad/s].
_RESTING = 0.01

_log = logging.getLogger("heptarm.ros")


class CollisionReaction:
    """Keeps a collision guard enabled and reacts to collisions.

    Args:
        arm: in control.
        notify: receives each collision, from the threads of the connection; it must not block.
        start: starts motions.
    """

    def __init__(
        self, arm: Arm, *, notify: Callable[[Collision], None], start: Callable[..., object]
    ) -> None:
        self._arm, self._notify, self._start = arm, notify, start
        self._lock = threading.Lock()
        self._block = contextlib.ExitStack()
        self._stiffness: float | None = None

    def enable(self, guard: CollisionGuard, *, compliance: float | None = None) -> None:
        """Enable a guard; it replaces the previous one.

        Args:
            guard: the bands.
            compliance: after a collision, disable the guard and comply with this stiffness of each joint [Nm/rad];
                None: brake and hold.
        """
        self.disable()
        with self._lock:
            self._stiffness = compliance
            self._block.enter_context(self._arm.guarded(guard, on_collision=self._on_collision))

    def disable(self) -> None:
        """Disable the guard, if there is one."""
        with self._lock, contextlib.suppress(CollisionDetected):  # it was reported already
            self._block.close()

    def _on_collision(self, found: Collision) -> None:
        _log.warning("collision at %s", found)
        self._notify(found)
        if self._stiffness is not None:
            motion = self._arm.state.motion
            given = (self._stiffness, motion.id if motion else 0)
            threading.Thread(target=self._comply, args=given, name="heptarm-collision").start()

    def _comply(self, stiffness: float, stopped: int) -> None:
        """Become compliant after the motion that the collision stopped, unless another one has begun meanwhile."""

        def is_over(state: State) -> bool:
            motion = state.motion
            if motion is not None and motion.active:
                return motion.id != stopped
            return not (np.abs(state.dq) > _RESTING).any()

        try:
            self.disable()  # the contact that remains is not another collision
            self._arm.wait_until(is_over, timeout=_REST_TIMEOUT)
            self._start(hold(inf), mode=JointImpedance(stiffness), when="reject")
        except HeptarmError as error:
            _log.warning("the arm does not become compliant after the collision: %s", error)
