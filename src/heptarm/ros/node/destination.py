"""Destinations: targets of a servo topic that the arm goes on to when no further message comes."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass

from heptarm.errors import HeptarmError
from heptarm.ros.node.target_stream import TargetStream
from heptarm.values.state import State

_log = logging.getLogger("heptarm.ros")


@dataclass(frozen=True, slots=True)
class Destination:
    """What the arm is on its way to.

    Attributes:
        reached: whether the arm is there in a state.
        stays: the servo motion stays open there, as a compliant arm needs; otherwise it ends.
    """

    reached: Callable[[State], bool]
    stays: bool = False


class DestinationKeeper:
    """Repeats the newest target of a stream until the arm is there, because the cabinet brakes when targets stop.

    It never opens a servo motion: whatever ends that one, such as a stop, ends the repeating too.

    Args:
        stream: of the targets.
        states: returns the newest state; None: there is none.
        period: between two repetitions [s].
        arrived: called once for each destination that was reached, from a thread of its own.
    """

    def __init__(
        self,
        stream: TargetStream,
        states: Callable[[], State | None],
        *,
        period: float,
        arrived: Callable[[], None],
    ) -> None:
        self._stream, self._states = stream, states
        self._period, self._arrived = period, arrived
        self._changed = threading.Condition()
        self._destination: Destination | None = None
        self._closed = False
        self._thread: threading.Thread | None = None

    def go(self, destination: Destination) -> None:
        """Keep the target that the stream has just sent."""
        with self._changed:
            self._destination = destination
            if self._thread is None and not self._closed:
                self._thread = threading.Thread(target=self._run, name="heptarm-destination", daemon=True)
                self._thread.start()
            self._changed.notify()

    def close(self) -> None:
        """Keep nothing any more. Closing twice is legal."""
        with self._changed:
            self._closed, self._destination = True, None
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        announced: Destination | None = None
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._destination is not None)
                if self._closed:
                    return
                destination = self._destination
                self._changed.wait_for(lambda: self._closed, self._period)
            assert destination is not None
            if not self._repeats():
                self._forget(destination)
                continue
            state = self._states()
            if announced is not destination and state is not None and destination.reached(state):
                announced = destination
                if not destination.stays:
                    self._forget(destination)
                self._arrived()

    def _repeats(self) -> bool:
        try:
            return self._stream.repeat()
        except HeptarmError as error:
            _log.warning("the arm does not go on to its destination: %s", error)
            return False

    def _forget(self, destination: Destination) -> None:
        with self._changed:
            if self._destination is destination:
                self._destination = None
