"""Follows a path through a world that changes: the arm brakes before a new body, and goes on around it.

The cabinet executes each path as one joint spline, so that its limits hold at any time. While a new path is searched
the arm holds its position: a stop, a break condition or a safety function ends the hold, and nothing moves on.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Literal, Protocol

import numpy as np

from heptarm.arm.devices.tools import Tooling
from heptarm.arm.link.connection import Connection
from heptarm.arm.motion.handle import MotionHandle
from heptarm.arm.motion.rest import settle
from heptarm.errors import CollisionForeseen, NoPath, Timeout
from heptarm.values.checks import Array, Value
from heptarm.values.clearance import Clearance, CollisionWorld, TouchOnPath
from heptarm.values.motion.motion import Motion, hold
from heptarm.values.motion.planned_path import Path
from heptarm.values.result import Cause, Result
from heptarm.values.robot import RobotModel
from heptarm.values.state import State
from heptarm.values.text import lines

#: Longest time between two looks whether the path has ended or is to end [s].
_CYCLE = 0.02
#: Longest wait for the state of an arm that has begun to hold its position [s].
_SOON = 10.0
#: Places of a path that are so near to the arm may all be where it is [rad]; the first of them counts.
_SAME = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Detour(Value):
    """A path that took the place of the rest of another one.

    Attributes:
        clearance: the bodies that would have touched.
        reaction: from when the change was noticed to the command to brake [s].
        braking: from there to when the arm held its position [s].
        seconds: from when the change was noticed to the new path, after braking and searching [s].
        path: on which the arm went on.
    """

    clearance: Clearance
    reaction: float
    braking: float
    seconds: float
    path: Path

    def __str__(self) -> str:
        """In words."""
        return (
            f"{self.clearance}; went on after {self.seconds:.2f} s, of which it braked for {self.braking:.2f} s: "
            f"{self.path}"
        )


@dataclass(frozen=True, slots=True, eq=False)
class FollowedPath(Value):
    """How an arm followed a path through a world that changes.

    Attributes:
        result: how its last motion ended.
        detours: made on the way.
    """

    result: Result
    detours: tuple[Detour, ...]

    def __str__(self) -> str:
        """A few lines."""
        rows = {"cause": self.result.cause.value}
        rows |= {f"detour {number}": str(detour) for number, detour in enumerate(self.detours, 1)}
        return lines("FollowedPath", rows)


class PathSearch(Protocol):
    """Searches a path from where the arm holds its position, or is about to."""

    def __call__(self, *, start: Array, known: Path | None, stop: Callable[[], bool]) -> Path:
        """Find a path to the goal, along a known one if that is free; raises NoPath."""


class Sender(Protocol):
    """Sends a motion."""

    def __call__(self, motion: Motion, *, when: Literal["replace", "reject"]) -> MotionHandle:
        """Send it; while another one runs: in its place, or not at all. Raises as `Arm.start`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowTerms:
    """How a path is followed.

    Attributes:
        world: that is watched.
        search: searches a new path.
        send: sends a motion.
        timeout: longest time for all of it [s].
        stop: ends it when it returns true.
        on_progress: called with the completed fraction of the present path.
    """

    world: CollisionWorld
    search: PathSearch
    send: Sender
    timeout: float
    stop: Callable[[], bool]
    on_progress: Callable[[float], object]


@dataclass(frozen=True, slots=True)
class _Blocked(Value):
    """What is in the way on the rest of a path.

    Attributes:
        clearance: the bodies that would touch.
        stop: about where the arm comes to rest, shape (7,) [rad].
        noticed: when this was noticed, by `time.monotonic` [s].
        braked: when the arm was commanded to brake, likewise.
    """

    clearance: Clearance
    stop: Array
    noticed: float
    braked: float


@dataclass(slots=True)
class PathFollower:
    """Follows one path; see `Arm.follow`.

    Attributes:
        connection: to the cabinet.
        tooling: what is attached.
        terms: how the path is followed.
    """

    connection: Connection
    tooling: Tooling
    terms: FollowTerms
    _running: MotionHandle | None = None
    _seen: int = 0  # revision of the world against which the rest of the path was checked
    _detours: list[Detour] = field(default_factory=list)
    _deadline: float = inf

    def follow(self, path: Path) -> FollowedPath:
        """Follow a path to its end; after an error the arm brakes."""
        self._deadline = time.monotonic() + self.terms.timeout
        try:
            blocked = self._begun(path)
            while True:
                if blocked is None:
                    blocked = self._watched(path)
                found = None if blocked is None else self._around(blocked)
                if found is None:
                    return self._ended()
                path, blocked = found, None
        except BaseException:
            if self._running is not None:
                self._running.cancel()
            raise

    def _begun(self, path: Path) -> _Blocked | None:
        """Begin the path; where a body is in the way already, begin to hold the position."""
        noticed = time.monotonic()
        touch = self._first_on(path.curve) or self._refused(path, when="reject")
        if touch is None:
            return None
        self._running = self.terms.send(hold(), when="reject")
        return _Blocked(touch.clearance, path.start, noticed, time.monotonic())

    def _watched(self, path: Path) -> _Blocked | None:
        """Watch the world until a body is in the way, and brake; None: the path has ended, or is to end."""
        running, index = self._motion, 0
        while not running.done and not self._is_over():
            if self.terms.world.revision != self._seen:
                noticed = time.monotonic()
                state = self.connection.fresh()
                index, rest = _rest(path.curve, self._commanded(state), index)
                touch = self._first_on(rest)
                if touch is not None:
                    self._running = self.terms.send(hold(), when="replace")
                    stop = _stop(rest, state.dq, self.connection.robot)
                    return _Blocked(touch.clearance, stop, noticed, time.monotonic())
            self.terms.on_progress(running.progress)
            self.terms.world.wait_for_change(self._seen, timeout=_CYCLE)
        return None

    def _around(self, blocked: _Blocked) -> Path | None:
        """Find another path from where the arm holds its position, and begin it; None: the hold ends.

        Raises:
            NoPath: there is none in the world as it is now.
        """
        held, world = self._motion, self.terms.world

        def is_over() -> bool:
            return held.done or self._is_over()

        known = none = None
        self._seen = world.revision
        try:  # while the arm brakes, from about where it will rest
            known = self.terms.search(start=blocked.stop, known=None, stop=is_over)
        except NoPath as error:
            none = error
        start = self._held(held)
        rests = time.monotonic()
        if none is not None and start is not None and none.reason != "start" and world.revision == self._seen:
            raise none  # from where the arm rests there is none, either
        while start is not None:
            self._seen = world.revision
            try:
                found = self.terms.search(start=start, known=known, stop=is_over)
            except NoPath:
                if is_over():
                    return None
                if world.revision == self._seen:
                    raise
                continue  # what was in the way may have gone
            if self._refused(found, when="replace") is not None:
                continue
            if held.wait().cause is not Cause.REPLACED:  # it was ended before: nothing moves on
                return None
            noticed, braked = blocked.noticed, blocked.braked
            seconds = time.monotonic() - noticed
            self._detours.append(Detour(blocked.clearance, braked - noticed, rests - braked, seconds, found))
            return found
        return None

    def _held(self, held: MotionHandle) -> Array | None:
        """Set-point at which the arm holds its position, once it has braked; None: the hold ends."""
        while not held.done and not self._is_over():
            if held.wait_started(_CYCLE) and not held.done:
                state = self.connection.wait_for(
                    lambda state: held.done or (state.motion is not None and state.motion.id == held.id),
                    _SOON,
                )
                return None if held.done else self._commanded(state)
        return None

    def _ended(self) -> FollowedPath:
        """The result of the last motion, which is cancelled if it has not ended.

        Raises:
            Timeout: the time has run out.
        """
        running = self._motion
        running.cancel()
        result = running.wait()
        if result.cause is Cause.CANCELLED and time.monotonic() > self._deadline:
            raise Timeout(f"the end of the path was not reached within {self.terms.timeout:g} s")
        return FollowedPath(settle(self.connection, running.id, result), tuple(self._detours))

    # ------------------------------------------------------------------------------------- parts

    @property
    def _motion(self) -> MotionHandle:
        assert self._running is not None
        return self._running

    def _is_over(self) -> bool:
        return time.monotonic() > self._deadline or self.terms.stop()

    def _first_on(self, curve: Array) -> TouchOnPath | None:
        """The first touch on joint positions, in the world as it is now."""
        world = self.tooling.loaded(self.terms.world)
        self._seen = world.revision
        return world.first_on(curve)

    def _refused(self, path: Path, *, when: Literal["replace", "reject"]) -> TouchOnPath | None:
        """Send a path; the touch for which it was refused, because the world has changed since it was checked.

        Raises:
            CollisionForeseen: it is refused by a model that has not changed.
        """
        try:
            self._running = self.terms.send(path, when=when)
        except CollisionForeseen as error:
            if self.terms.world.revision == self._seen:
                raise
            touch: TouchOnPath = error.touch
            return touch
        return None

    @staticmethod
    def _commanded(state: State) -> Array:
        """The set-points of the joints in a state; where the cabinet reports none, their positions."""
        return np.where(np.isnan(state.q_cmd), state.q, state.q_cmd)


def _rest(curve: Array, here: Array, first: int) -> tuple[int, Array]:
    """What is left of a path: the index of the piece on which the arm is, and joint positions from there on.

    Args:
        curve: joint positions along the path, shape (n, 7) [rad].
        here: where the arm is, shape (7,) [rad].
        first: the piece on which it was before.
    """
    begins, steps = curve[first:-1], np.diff(curve[first:], axis=0)
    lengths = np.maximum((steps**2).sum(axis=1), 1e-12)
    parts = np.clip(((here - begins) * steps).sum(axis=1) / lengths, 0.0, 1.0)
    gaps = np.linalg.norm(begins + parts[:, None] * steps - here, axis=1)
    index = first + int(np.flatnonzero(gaps <= gaps.min() + _SAME)[0])
    return index, np.vstack([here, curve[index + 1 :]])


def _stop(rest: Array, dq: Array, robot: RobotModel) -> Array:
    """About where an arm comes to rest that brakes on what is left of a path, shape (7,) [rad].

    Args:
        rest: as of `_rest`.
        dq: velocities of the joints, shape (7,) [rad/s].
        robot: the robot.
    """
    # with the acceleration that its joints have, which the limit of the jerk lets them reach in time
    seconds = float((np.abs(dq) / robot.ddq_max + robot.ddq_max / robot.dddq_max).max())
    marks = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rest, axis=0), axis=1))])
    at = min(0.5 * seconds * float(np.linalg.norm(dq)), float(marks[-1]))
    return np.array([np.interp(at, marks, column) for column in rest.T])
