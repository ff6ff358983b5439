"""A world that open panels draw: its files follow its changes."""

from __future__ import annotations

import atexit
import contextlib
import threading
import weakref
from typing import TYPE_CHECKING

from heptarm.io.panel_box import WorldFiles

if TYPE_CHECKING:
    from heptarm.values.clearance import CollisionWorld

#: Longest time after which panels are looked for, and the world is reported as fresh; shortest between two changes [s].
_PERIOD, _SHORTEST = 0.5, 0.05


class ShownWorld:
    """Shows a world in the open panels that show its robot, in a thread of its own, until `end` or the program ends.

    Args:
        world: the model; it is held by a weak reference, so that the thread ends with it.

    Attributes:
        is_seen: whether a panel is open.
    """

    def __init__(self, world: CollisionWorld) -> None:
        self._files = WorldFiles(world.robot.name)
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self.is_seen = False
        self._put(world)
        atexit.register(self.end)
        threading.Thread(
            target=self._follow, args=(weakref.ref(world),), name="heptarm-shown-world", daemon=True
        ).start()

    def end(self) -> None:
        """Show it no more."""
        with self._lock:
            self._ended.set()
            self._files.remove()
        atexit.unregister(self.end)

    def _put(self, world: CollisionWorld) -> int:
        """Write what has changed; returns the revision that was written."""
        revision, outline = world.revision, world.outline()
        with self._lock, contextlib.suppress(OSError):
            if not self._ended.is_set():
                self.is_seen = self._files.put(outline)
        return revision

    def _follow(self, of: weakref.ref[CollisionWorld]) -> None:
        while not self._ended.wait(_SHORTEST):
            world = of()
            if world is None:
                self.end()
                break
            world.wait_for_change(self._put(world), timeout=_PERIOD)
            del world
