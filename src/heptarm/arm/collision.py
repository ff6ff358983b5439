"""The collision guard: every motion of a block ends when a joint's external torque leaves its band."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt

from heptarm.arm.connection import Connection
from heptarm.arm.feed import States
from heptarm.arm.handle import collided
from heptarm.errors import CollisionDetected, HeptarmError, ModeConflict, NotReady, StaleState, Timeout
from heptarm.values.arrays import within
from heptarm.values.collision import Collision, CollisionGuard
from heptarm.values.condition import Condition
from heptarm.values.state import State
from heptarm.wire import messages as wire

#: Allowed external torque of a joint beside its baseline [Nm].
THRESHOLD = 20.0
#: No joint turns faster than this while the baseline is taken [rad/s].
_REST = 0.01
#: How long the watching thread may sleep without a state [s].
_NAP = 0.2


class Guarding:
    """The part of an arm that stops at collisions."""

    _connection: Connection
    states: Callable[..., States]

    def collision_guard(
        self, threshold: npt.ArrayLike = THRESHOLD, *, margin: npt.ArrayLike = 0.0, seconds: float = 0.2
    ) -> CollisionGuard:
        """A guard round the external torques that there are now, while the arm rests and nobody touches it.

        These are what a load makes that is not quite known. It changes with the posture, so a guard is best taken where
        it will be used; `threshold` has to cover the rest.

        Args:
            threshold: allowed deviation from the baseline [Nm], one number for all joints or shape (7,).
            margin: what the speed of a joint adds to it [Nm s/rad], likewise: for friction and dynamics that the
                model does not know.
            seconds: how long to look for the baseline [s].

        Raises:
            NotReady: the arm does not rest.
            LimitError: a value outside its range.
        """
        CollisionGuard.of(threshold, margin=margin)
        found = []
        for state in self.states(duration=within(seconds, "seconds", 0.0, 60.0, above=True, unit="s")):
            if (np.abs(np.nan_to_num(state.dq)) > _REST).any():
                raise NotReady("the arm moves; a baseline is taken at rest", hint="arm.wait_for_rest()")
            found.append(state.tau_ext)
        if not found:
            raise StaleState(
                f"no state came within {seconds:g} s", hint="give more seconds, or arm.subscribe(rate=100)"
            )
        return CollisionGuard.of(threshold, baseline=np.mean(found, axis=0), margin=margin)

    @contextlib.contextmanager
    def guarded(
        self,
        guard: CollisionGuard | None = None,
        *,
        on_collision: Callable[[Collision], None] | None = None,
    ) -> Iterator[CollisionGuard]:
        """A block whose motions and servo motions end at a collision.

        The cabinet watches, as a break condition of each motion; the arm brakes on its path. A guard with a margin is
        watched here, in every pushed state, and stops the arm as hard as it can; the network has a part in that.

        Args:
            guard: the bands; None: `collision_guard()` as the block begins.
            on_collision: told of each collision, from another thread, so it must not block. A guard with a margin
                goes on watching then: each further motion that meets something is stopped as well.

        Raises:
            CollisionDetected: from `move`, `wait` or the end of the block; says which joint and how much.
            ModeConflict: the block lies within another one.
        """
        link = self._connection
        if link.guard is not None:
            raise ModeConflict("a collision guard is in force already", hint="leave its block first")
        bands = self.collision_guard() if guard is None else guard
        watch = _Watch(link, bands, on_collision) if bands.is_moving else None
        link.guard, link.on_collision = bands, on_collision
        try:
            yield bands
        except HeptarmError as error:
            if watch is not None and watch.found is not None and not isinstance(error, CollisionDetected):
                raise collided(watch.found, getattr(error, "result", None), link.history()) from error
            raise
        finally:
            link.guard = link.on_collision = None
            if watch is not None:
                watch.close()
        if watch is not None and watch.found is not None:
            raise collided(watch.found, None, link.history())

    def _guarded(self, until: Condition | None) -> Condition | None:
        """A break condition, and that of the guard in force."""
        guard = self._connection.guard
        if guard is None or guard.is_moving:
            return until
        return guard.condition if until is None else until | guard.condition


class _Watch:
    """Looks at every state until it is closed; stops the arm at the first collision, or at that of each motion."""

    def __init__(
        self, link: Connection, guard: CollisionGuard, on_collision: Callable[[Collision], None] | None
    ) -> None:
        self.found: Collision | None = None
        self._link, self._guard, self._tell = link, guard, on_collision
        self._hit: Collision | None = None
        self._stopped = 0  # the motion that the last collision ended
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._work, name="heptarm-guard", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        while not self._closed.is_set():
            try:
                self._link.wait_for(self._is_hit, _NAP)
            except Timeout:
                continue
            except HeptarmError:  # the link is lost; whatever runs says so, and the cabinet stops the arm
                self._closed.wait(_NAP)
                continue
            if self._hit is None:
                return
            self.found = self.found or self._hit
            with contextlib.suppress(HeptarmError):  # likewise
                self._link.stop(wire.StopKind.FAST)
            if self._tell is None:
                return
            self._tell(self._hit)

    def _is_hit(self, state: State) -> bool:
        self._hit = None
        if self._closed.is_set():
            return True
        motion = state.motion
        number = motion.id if motion is not None and motion.active else 0
        if self.found is not None and number in (0, self._stopped):
            return False  # of this one it was told
        self._hit = self._guard.collision(state)
        if self._hit is not None:
            self._stopped = number
        return self._hit is not None

    def close(self) -> None:
        self._closed.set()
        self._thread.join()
