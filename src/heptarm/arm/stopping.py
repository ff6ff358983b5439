"""Stopping, pausing and slowing down: the verbs that may be used at any time, from any thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from heptarm.arm import recovery
from heptarm.arm.connection import Connection
from heptarm.errors import ShapeError, StaleState
from heptarm.values.arrays import within
from heptarm.values.recovery import Recovery
from heptarm.values.state import State
from heptarm.wire import messages as wire

_STOPS = {kind.name.lower(): kind for kind in wire.StopKind}
#: Below this speed of every axis the arm counts as being at rest [rad/s].
_REST = 0.01
#: How long an arm that brakes may take to rest [s].
REST_TIMEOUT = 10.0


class Stopping:
    """The part of an arm that brings it to rest."""

    _connection: Connection

    def stop(self, kind: Literal["path", "fast", "after_motion"] = "path") -> None:
        """Stop whatever runs and drop what waits; anybody may, at any time, from any thread, again and again.

        It returns when the cabinet has taken the order; `wait_for_rest` waits until the arm rests. If the connection
        was lost, a new one is made for it.

        Args:
            kind: "path": brake on the path; "fast": brake every axis as hard as it may, off the path (a cabinet has one
                kind of braking only, so there it is the same); "after_motion": finish what runs and drop the rest.

        Raises:
            ConnectionLost: the cabinet cannot be reached.
        """
        if kind not in _STOPS:
            raise ShapeError(
                f"kind is {kind!r}; allowed are {', '.join(map(repr, _STOPS))}", parameter="kind"
            )
        self._connection.stop(_STOPS[kind])

    def recover(self, *, timeout: float = 0.0) -> Recovery:
        """Make the robot ready again, as far as software may; says what is left to a person.

        It makes a new connection if the old one was lost, takes control if this client has none, acknowledges errors
        whose cause has gone, and ends a pause: a motion that waits goes on along its path. No stop is lifted by it, and
        no motion that was ended begins again.

        Args:
            timeout: while something is left to a person, try again for so long [s].

        Returns:
            What was done, and the steps that remain.

        Raises:
            ConnectionLost: the arm was closed.
        """
        seconds = within(timeout, "timeout", 0.0, 1e6, unit="s")
        with self._connection.stopping_on_interrupt():
            return recovery.recover(self._connection, timeout=seconds)

    def pause(self) -> None:
        """Pause on the path."""
        self._connection.request(wire.Pause())

    def resume(self) -> None:
        """Go on after a pause."""
        self._connection.request(wire.Resume())

    def set_override(self, value: float) -> None:
        """Set the application override: a factor in [0, 1] on every programmed speed, at once.

        Raises:
            LimitError: outside [0, 1].
        """
        self._connection.request(wire.SetOverride(value=within(value, "override", 0.0, 1.0)))

    def wait_for_rest(self, *, timeout: float = REST_TIMEOUT) -> State:
        """Wait until nothing runs, nothing waits, and no axis turns.

        Raises:
            Timeout: the arm does not come to rest in time.
            StaleState: the subscribed groups lack "joints" or "motion".
        """
        seconds = within(timeout, "timeout", 0.0, 1e9, unit="s")
        with self._connection.stopping_on_interrupt():
            return self._connection.wait_for(self._resting(), seconds)

    def _resting(self) -> Callable[[State], bool]:
        """A condition that holds for the second state in a row, from now on, in which the arm rests."""
        newest = self._connection.newest()  # what was sampled before this call proves nothing
        first = 0 if newest is None else newest.stamp
        quiet = 0

        def rests(state: State) -> bool:
            nonlocal quiet
            if state.joints is None or state.motion is None:
                raise StaleState(
                    'waiting for rest needs the groups "joints" and "motion"',
                    hint='arm.subscribe(groups=("joints", "motion"))',
                )
            fast = np.abs(state.dq[np.isfinite(state.dq)])
            calm = not state.motion.active and not state.motion.queued and bool((fast < _REST).all())
            quiet = quiet + 1 if calm and state.joints.stamp > first else 0
            return quiet >= 2

        return rests
