"""The collision guard: every motion of a block ends when the external torque of a joint leaves its band."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from heptarm.arm.verbs import ArmVerbs, guards_in_force
from heptarm.errors import CollisionDetected, HeptarmError, ModeConflict, NotReady, StaleState, Timeout
from heptarm.values.checks import Array, callback, instance, within
from heptarm.values.condition.collision import Collision, CollisionGuard
from heptarm.values.condition.reaction import Reaction, check_reaction
from heptarm.values.result import Result
from heptarm.values.state import State

#: Default of the allowed deviation of a joint's external torque from its baseline [Nm].
THRESHOLD = 20.0
#: No joint may turn faster than this while the baseline is taken [rad/s].
_REST = 0.01
#: So often an average is begun when no state comes, as after a standstill of this machine.
_WINDOWS = 5
#: Longest sleep of the watching thread without a state [s].
_NAP = 0.2


def collision_guard(
    arm: ArmVerbs, threshold: npt.ArrayLike = THRESHOLD, *, margin: npt.ArrayLike = 0.0, seconds: float = 0.2
) -> CollisionGuard:
    """Make a guard around the present external torques, while the arm rests and nobody touches it.

    These are caused by a load that is not quite known. They change with the posture, so take the guard where it is
    used; `threshold` has to cover the rest.

    Args:
        arm: at rest.
        threshold: allowed deviation from the baseline [Nm], one number for all joints or shape (7,).
        margin: added to it per speed of the joint [Nm s/rad], likewise: for friction and dynamics that the model does
            not contain.
        seconds: how long to average the baseline [s].

    Raises:
        NotReady: the arm does not rest.
        StaleState: no state is received.
        LimitError: a value outside its range.
    """
    CollisionGuard.of(threshold, margin=margin)
    within(seconds, "seconds", 0.0, 60.0, above=True, unit="s")
    torques = next(filter(None, (_torques_at_rest(arm, seconds) for _ in range(_WINDOWS))), None)
    if torques is None:
        raise StaleState(
            f"no state received within {_WINDOWS * seconds:g} s",
            hint="give more seconds, or arm.subscribe(rate=100)",
        )
    return CollisionGuard.of(threshold, baseline=np.mean(torques, axis=0), margin=margin)


def _torques_at_rest(arm: ArmVerbs, seconds: float) -> list[Array]:
    """External torques of the states of a time [s]; none if no state came."""
    torques = []
    for state in arm.states(duration=seconds):
        if (np.abs(np.nan_to_num(state.dq)) > _REST).any():
            raise NotReady(
                f"the arm moves; a baseline is taken at rest, with every joint below {_REST:g} rad/s",
                hint="arm.wait_for_rest()",
            )
        torques.append(state.tau_ext)
    return torques


def guarded(
    arm: ArmVerbs,
    guard: CollisionGuard | None = None,
    *,
    on_collision: Callable[[Collision], None] | None = None,
    then: Reaction = "relax",
) -> contextlib.AbstractContextManager[CollisionGuard]:
    """A block whose motions, servo motions and FRI sessions end at a collision.

    The cabinet monitors the torques, as a break condition of each motion; the arm brakes on its path and relaxes. A
    guard with a margin is monitored by this program, in every pushed state, and stops the arm as hard as possible; it
    reacts later by the delay of the network. The loop of an FRI session monitors either kind in every message.

    Args:
        arm: in control.
        guard: the bands; None: `collision_guard()` at the start of the block.
        on_collision: called with each collision, from another thread, so it must not block. A guard with a margin
            stays in force then and stops each further motion that collides.
        then: what the arm does after it has braked; see `Arm.move`. A guard with a margin and servo motions only stop.

    Raises:
        CollisionDetected: from `move`, `wait` or the end of the block; names the joint and its torque.
        ModeConflict: the block is inside another one.
    """
    return _block(arm, guard, on_collision, then)


@contextlib.contextmanager
def _block(
    arm: ArmVerbs,
    guard: CollisionGuard | None,
    on_collision: Callable[[Collision], None] | None,
    then: Reaction,
) -> Iterator[CollisionGuard]:
    if arm in guards_in_force:
        raise ModeConflict("a collision guard is in force already", hint="leave its block first")
    if on_collision is not None:
        callback(on_collision, "on_collision")
    reaction = check_reaction(then)
    bands = collision_guard(arm) if guard is None else instance(guard, CollisionGuard, "guard")
    guards_in_force[arm] = (bands, on_collision)
    try:
        with (
            _watched(arm, bands, on_collision)
            if bands.is_moving
            else _broken_off(arm, bands, on_collision, reaction)
        ):
            yield bands
    finally:
        del guards_in_force[arm]


@contextlib.contextmanager
def _broken_off(
    arm: ArmVerbs, guard: CollisionGuard, on_collision: Callable[[Collision], None] | None, then: Reaction
) -> Iterator[None]:
    """A block whose motions the cabinet ends at a collision."""

    def error(result: Result) -> CollisionDetected:
        assert result.stopped_by is not None
        found = guard.named(result.stopped_by, result.fired_at or result.state)
        if on_collision is not None:
            on_collision(found)
        return _collided(found, result, arm.history())

    with arm.breaking_on(guard.condition, error=error, then=then):
        yield


@contextlib.contextmanager
def _watched(
    arm: ArmVerbs, guard: CollisionGuard, on_collision: Callable[[Collision], None] | None
) -> Iterator[None]:
    """A block whose motions this program stops at a collision."""
    watch = _Watch(arm, guard, on_collision)
    try:
        yield
    except HeptarmError as error:
        if watch.found is not None and not isinstance(error, CollisionDetected):
            raise _collided(watch.found, getattr(error, "result", None), arm.history()) from error
        raise
    finally:
        watch.close()
    if watch.found is not None:
        raise _collided(watch.found, None, arm.history())


class _Watch:
    """Checks every state until it is closed; stops the arm at the first collision, or at that of each motion.

    Attributes:
        found: the first collision; None: there was none.
    """

    def __init__(
        self, arm: ArmVerbs, guard: CollisionGuard, on_collision: Callable[[Collision], None] | None
    ) -> None:
        self.found: Collision | None = None
        self._arm, self._guard, self._on_collision = arm, guard, on_collision
        self._hit: Collision | None = None
        self._stopped = 0  # id of the motion that the last collision ended
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._run, name="heptarm-guard", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                self._arm.wait_until(self._is_hit, timeout=_NAP)
            except Timeout:
                continue
            except (
                HeptarmError
            ):  # the connection is lost; the running motion raises it, and the cabinet stops the arm
                self._closed.wait(_NAP)
                continue
            if self._hit is None:
                return
            self.found = self.found or self._hit
            with contextlib.suppress(HeptarmError):  # likewise
                self._arm.stop("fast")
            if self._on_collision is None:
                return
            self._on_collision(self._hit)

    def _is_hit(self, state: State) -> bool:
        self._hit = None
        if self._closed.is_set():
            return True
        motion = state.motion
        number = motion.id if motion is not None and motion.active else 0
        if self.found is not None and number in (0, self._stopped):
            return False  # this motion was stopped already
        self._hit = self._guard.collision(state)
        if self._hit is not None:
            self._stopped = number
        return self._hit is not None

    def close(self) -> None:
        self._closed.set()
        self._thread.join()


def _collided(found: Collision, result: Result | None, history: Sequence[State]) -> CollisionDetected:
    return CollisionDetected(
        f"collision at {found}",
        collision=found,
        result=result,
        history=history,
        hint="check what the arm has hit; arm.collision_guard() takes a new baseline",
    )
